//! Planes of pixels, row by row from the upper left, and means over squares of them.

use rayon::prelude::*;

/// Pixels across and down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl Size {
    /// Pixels in all.
    pub fn pixels(self) -> usize {
        self.width * self.height
    }
}

/// Pixels that a core takes at a time.
const RUN: usize = 4096;

/// A plane of what `value` has for every pixel.
pub fn plane(size: Size, value: impl Fn(usize) -> f32 + Sync) -> Vec<f32> {
    let mut plane = vec![0.0; size.pixels()];
    add(&mut plane, value);
    plane
}

/// Adds what `value` has for every pixel.
pub fn add(plane: &mut [f32], value: impl Fn(usize) -> f32 + Sync) {
    plane.par_chunks_mut(RUN).enumerate().for_each(|(run, values)| {
        for (i, v) in values.iter_mut().enumerate() {
            *v += value(run * RUN + i);
        }
    });
}

/// Means over the squares of 2 `radius` + 1 pixels around each pixel, as far as they lie in the picture.
pub fn box_mean(plane: &[f32], size: Size, radius: usize) -> Vec<f32> {
    let Size { width, height } = size;
    let near = |at: usize, end: usize| at.saturating_sub(radius)..(at + radius + 1).min(end);
    let shares: Vec<f32> = (0..width).map(|x| 1.0 / near(x, width).len() as f32).collect();
    let mut across = vec![0.0; size.pixels()];
    let padded = || vec![0.0; width + 2 * radius];
    across.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each_init(padded, |padded, (out, row)| {
        padded[radius..radius + width].copy_from_slice(row);
        for shift in 0..=2 * radius {
            out.iter_mut().zip(&padded[shift..]).for_each(|(sum, v)| *sum += v);
        }
        out.iter_mut().zip(&shares).for_each(|(sum, share)| *sum *= share);
    });
    let mut means = vec![0.0; size.pixels()];
    means.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let rows = near(y, height);
        let share = 1.0 / rows.len() as f32;
        for row in rows {
            out.iter_mut().zip(&across[row * width..(row + 1) * width]).for_each(|(out, v)| *out += share * v);
        }
    });
    means
}

/// Mean of several planes.
pub fn mean_plane(size: Size, planes: &[Vec<f32>]) -> Vec<f32> {
    let share = 1.0 / planes.len() as f32;
    plane(size, |p| share * planes.iter().map(|plane| plane[p]).sum::<f32>())
}

/// Mean over the picture.
pub fn mean(plane: &[f32]) -> f32 {
    (plane.iter().map(|&v| f64::from(v)).sum::<f64>() / plane.len().max(1) as f64) as f32
}
