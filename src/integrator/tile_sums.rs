//! What passes over a tile came to, read where it came back from the adapter, on all cores.

use crate::film::Tile;
use crate::gpu::Mapped;
use crate::gpu::layout::XYZ_RATIO;
use bytemuck::cast_slice;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

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
    /// By camera paths, f32; of the last passes, where single precision does not hold all. Through a lens quanta, as of light paths.
    pub(super) film: Mapped,
    pub(super) in_quanta: bool,
    /// Those before.
    pub(super) earlier: Vec<f64>,
    /// By light paths: quanta, u64.
    pub(super) splats: Option<Mapped>,
    /// A quantum's worth in a bin.
    pub(super) quantum: f64,
}

/// Of a pixel, by camera paths alone: radiance (sum over the bins) and Y.
pub(super) type ByCamera = [f32; 2];

/// Radiance and Y of a pixel's sums.
pub(super) fn radiance_and_y(sums: &[f32]) -> [f32; 2] {
    let bins = sums.len() - 3;
    [sums[..bins].iter().sum(), sums[bins + 1]]
}

impl TileSums {
    /// The sums of a pixel, for which there is room in `sums`, by camera paths alone, and how many were cut since they are too large.
    fn pixel(&self, pixel: usize, sums: &mut [f32]) -> (ByCamera, u64) {
        let channels = self.channels;
        let at = pixel * channels..(pixel + 1) * channels;
        let mut cut = self.by_camera(at.clone(), sums);
        let by_camera = radiance_and_y(sums);
        for (i, (sum, quanta)) in sums.iter_mut().zip(self.quanta(at)).enumerate() {
            cut += with_splats(sum, *quanta, self.unit(i));
        }
        (by_camera, cut)
    }

    /// Sums by camera paths alone: those of `at` among all; and how many were cut.
    fn by_camera(&self, at: Range<usize>, sums: &mut [f32]) -> u64 {
        if self.in_quanta {
            sums.fill(0.0);
            let quanta: &[[u32; 2]] = cast_slice(&self.film);
            let sums = sums.iter_mut().enumerate().zip(&quanta[at]);
            return sums.map(|((i, sum), quanta)| with_splats(sum, *quanta, self.unit(i % self.channels))).sum();
        }
        sums.copy_from_slice(&cast_slice(&self.film)[at.clone()]);
        if !self.earlier.is_empty() {
            sums.iter_mut().zip(&self.earlier[at]).for_each(|(sum, earlier)| *sum = (earlier + f64::from(*sum)) as f32);
        }
        0
    }

    /// What a quantum of channel `i` is worth.
    fn unit(&self, i: usize) -> f64 {
        if i + 3 < self.channels { self.quantum } else { self.quantum * f64::from(XYZ_RATIO) }
    }

    /// And by light paths; none where there are none.
    fn quanta(&self, at: Range<usize>) -> &[[u32; 2]] {
        self.splats.as_ref().map_or(&[], |splats| &cast_slice(splats)[at])
    }

    fn pixels(&self) -> usize {
        self.tile.width as usize * self.tile.height as usize
    }

    /// All sums, in `room` where they do not lie ready; by camera paths alone, and how many were cut.
    pub(super) fn all<'a>(&'a self, room: &'a mut Vec<f32>) -> (Cow<'a, [f32]>, Vec<ByCamera>, u64) {
        let lie_ready = self.earlier.is_empty() && self.splats.is_none() && !self.in_quanta;
        let mut by_camera = vec![[0.0; 2]; self.pixels()];
        if lie_ready {
            let sums: &[f32] = cast_slice(&self.film);
            let pixels = sums.par_chunks_exact(self.channels).with_min_len(PIXELS);
            pixels.zip(&mut by_camera).for_each(|(sums, of)| *of = radiance_and_y(sums));
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
}

/// Adds splats, each worth `unit`, to a sum; returns 1 if it is cut, since it is too large.
fn with_splats(sum: &mut f32, [low, high]: [u32; 2], unit: f64) -> u64 {
    // Most light paths meet few pixels.
    if low == 0 && high == 0 {
        return 0;
    }
    let quanta = (u64::from(high) << 32 | u64::from(low)) as f64;
    let is_cut = f64::from(*sum) + quanta * unit > f64::from(f32::MAX);
    *sum += (quanta * unit).min(f64::from(f32::MAX - *sum)) as f32;
    u64::from(is_cut)
}
