//! What passes over a tile came to, read where it came back from the adapter, on all cores.

use crate::film::Tile;
use crate::gpu::Mapped;
use crate::gpu::layout::XYZ_RATIO;
use bytemuck::cast_slice;
use rayon::prelude::*;
use std::borrow::Cow;

/// Pixels that a core takes at a time.
const PIXELS: usize = 1024;

/// Sums over the passes of a tile, `[pixel][bins + 3]`.
#[derive(Debug)]
pub(super) struct TileSums {
    pub(super) tile: Tile,
    /// Samples that they stand for.
    pub(super) spp: u32,
    /// Bins, and X, Y, Z.
    pub(super) channels: usize,
    /// By camera paths, f32; of the last passes, where single precision does not hold all.
    pub(super) film: Mapped,
    /// Those before.
    pub(super) earlier: Vec<f64>,
    /// By light paths: quanta, u64.
    pub(super) splats: Option<Mapped>,
    /// A quantum's worth in a bin.
    pub(super) quantum: f64,
}

/// Of a pixel, by camera paths alone: radiance (sum over the bins) and Y.
pub(super) type ByCamera = [f32; 2];

impl TileSums {
    /// The sums of a pixel, for which there is room in `sums`, by camera paths alone, and how many were cut since they are too large.
    fn pixel(&self, pixel: usize, sums: &mut [f32]) -> (ByCamera, u64) {
        let (channels, bins) = (self.channels, self.channels - 3);
        let at = pixel * channels..(pixel + 1) * channels;
        sums.copy_from_slice(&cast_slice(&self.film)[at.clone()]);
        if !self.earlier.is_empty() {
            sums.iter_mut().zip(&self.earlier[at.clone()]).for_each(|(sum, earlier)| *sum = (earlier + f64::from(*sum)) as f32);
        }
        let by_camera = [sums[..bins].iter().sum(), sums[bins + 1]];
        let mut cut = 0;
        if let Some(splats) = &self.splats {
            let quanta: &[[u32; 2]] = &cast_slice(splats)[at];
            for (i, (sum, [low, high])) in sums.iter_mut().zip(quanta).enumerate() {
                let quanta = (u64::from(*high) << 32 | u64::from(*low)) as f64;
                let unit = if i < bins { self.quantum } else { self.quantum * f64::from(XYZ_RATIO) };
                cut += u64::from(f64::from(*sum) + quanta * unit > f64::from(f32::MAX));
                *sum += (quanta * unit).min(f64::from(f32::MAX - *sum)) as f32;
            }
        }
        (by_camera, cut)
    }

    fn pixels(&self) -> usize {
        self.tile.width as usize * self.tile.height as usize
    }

    /// All sums, in `room` where they do not lie ready; by camera paths alone, and how many were cut.
    pub(super) fn all<'a>(&'a self, room: &'a mut Vec<f32>) -> (Cow<'a, [f32]>, Vec<ByCamera>, u64) {
        let lie_ready = self.earlier.is_empty() && self.splats.is_none();
        let bins = self.channels - 3;
        let mut by_camera = vec![[0.0; 2]; self.pixels()];
        if lie_ready {
            let sums: &[f32] = cast_slice(&self.film);
            let pixels = sums.par_chunks_exact(self.channels).with_min_len(PIXELS);
            pixels.zip(&mut by_camera).for_each(|(sums, of)| *of = [sums[..bins].iter().sum(), sums[bins + 1]]);
            return (Cow::Borrowed(sums), by_camera, 0);
        }
        room.resize(self.pixels() * self.channels, 0.0);
        let pixels = room.par_chunks_exact_mut(self.channels).with_min_len(PIXELS).zip(&mut by_camera).enumerate();
        let one = |(pixel, (sums, of)): (usize, (&mut [f32], &mut ByCamera))| {
            let (by_camera, cut) = self.pixel(pixel, sums);
            *of = by_camera;
            cut
        };
        let cut = pixels.map(one).sum();
        (Cow::Borrowed(room), by_camera, cut)
    }

    /// Radiance (sum over the bins) of each pixel.
    pub(super) fn radiance(&self) -> Vec<f64> {
        let mut radiance = vec![0.0; self.pixels()];
        radiance.par_chunks_mut(PIXELS).enumerate().for_each(|(chunk, radiance)| {
            let mut sums = vec![0.0; self.channels];
            for (i, of) in radiance.iter_mut().enumerate() {
                self.pixel(chunk * PIXELS + i, &mut sums);
                *of = sums[..self.channels - 3].iter().map(|&s| f64::from(s)).sum();
            }
        });
        radiance
    }
}
