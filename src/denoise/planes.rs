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

/// A plane of what `value` has for every pixel.
pub fn plane(size: Size, value: impl Fn(usize) -> f32 + Sync) -> Vec<f32> {
    let mut plane = vec![0.0; size.pixels()];
    plane.par_iter_mut().with_min_len(4096).enumerate().for_each(|(pixel, v)| *v = value(pixel));
    plane
}

/// Means over the squares of 2 `radius` + 1 pixels around each pixel, as far as they lie in the picture.
pub fn box_mean(plane: &[f32], size: Size, radius: usize) -> Vec<f32> {
    let Size { width, height } = size;
    let mut across = vec![0.0; size.pixels()];
    across.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        for (x, out) in out.iter_mut().enumerate() {
            let near = &row[x.saturating_sub(radius)..(x + radius + 1).min(width)];
            *out = near.iter().sum::<f32>() / near.len() as f32;
        }
    });
    let mut means = vec![0.0; size.pixels()];
    means.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(height);
        let share = 1.0 / rows.len() as f32;
        for row in rows {
            out.iter_mut().zip(&across[row * width..(row + 1) * width]).for_each(|(out, v)| *out += share * v);
        }
    });
    means
}

/// Mean over the picture.
pub fn mean(plane: &[f32]) -> f32 {
    (plane.iter().map(|&v| f64::from(v)).sum::<f64>() / plane.len().max(1) as f64) as f32
}
