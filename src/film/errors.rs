//! Standard errors of pixels, from their own batches and from those of their surroundings.
//!
//! Where light is rare, as that of a caustic in a young render, a pixel's own batches say too little: they found nothing and do not differ, or one found
//! a bright path that is then taken for the pixel's brightness. So a pixel's error is shrunk towards that of the block of 2 x 2 pixels around it, the
//! block's towards that of the block of 4 x 4, and so on up to the whole film. Batches that find light are taken for a Poisson process, whose
//! rate around is known as q. Jeffreys' prior is worth half such an event, that is `m = 1 / 2q` batches of the surroundings:
//! ```text
//! v = (N v_own + m v_around) / (N + m),    q = (c + 1/2) / (N + m)
//! ```
//! with N batches of all pixels of the block together, c of which found light; likewise the mean that errors are relative to. Of `n` batches with mean
//! `x` and standard deviation `s`, `n x^2 / (x^2 + s^2)` count as having found it: `n` where all are alike, 1 where one alone is not zero. With 16
//! batches that all found light, a pixel takes 3 % from its surroundings. Over the film the sum of `v` stays about what it was, that is, unbiased.

use super::{Film, PIXELS};
use rayon::prelude::*;

/// Sums over the pixels of a block, `N` times: 1, events per batch, mean, variance of the mean.
type Sums = [f32; 4];

/// 2^26 pixels of it have a sum in single precision.
const LARGEST: f64 = 1e30;

/// Weight of the surroundings, in batches, and what they have: mean and variance.
#[derive(Debug, Clone, Copy)]
struct Around {
    weight: f32,
    mean: f32,
    variance: f32,
}

impl Around {
    /// What a block of these sums, within this, is around its parts.
    fn around(&self, &[batches, events, mean, variance]: &Sums) -> Around {
        let shrunk = |sum: f32, around: f32| (sum + self.weight * around) / (batches + self.weight);
        let weight = 0.5 * (batches + self.weight) / (events + 0.5);
        Around { weight, mean: shrunk(mean, self.mean), variance: shrunk(variance, self.variance) }
    }
}

/// Mean and standard error of a channel's pixels; before the second batch the errors are infinite.
#[derive(Debug)]
pub struct Errors<'a> {
    film: &'a Film,
    channel: usize,
    /// Blocks of 2 x 2 pixels, row by row.
    around: Vec<Around>,
}

impl<'a> Errors<'a> {
    /// Of the bins and then X, Y, Z, channel `channel`.
    pub fn new(film: &'a Film, channel: usize) -> Self {
        let mut errors = Errors { film, channel, around: Vec::new() };
        if film.batches() < 2 {
            return errors;
        }
        // Up: sums over ever larger blocks, the last one of which is the film.
        let size = halved(errors.size());
        let mut levels = vec![(size, sums_of_blocks(errors.size(), |pixel| errors.sums(pixel)))];
        while let Some((size, blocks)) = levels.last()
            && blocks.len() > 1
        {
            levels.push((halved(*size), sums_of_blocks(*size, |block| blocks[block])));
        }
        // And down, each within the one before.
        let mut above = ([1, 1], vec![Around { weight: 0.0, mean: 0.0, variance: 0.0 }]);
        while let Some((size, blocks)) = levels.pop() {
            let around = |(i, sums): (usize, &Sums)| above.1[block_of(i, size, above.0)].around(sums);
            above = (size, blocks.par_iter().with_min_len(PIXELS).enumerate().map(around).collect());
        }
        errors.around = above.1;
        errors
    }

    fn size(&self) -> [usize; 2] {
        let bounds = self.film.settings.pixel_bounds();
        [bounds.width as usize, bounds.height as usize]
    }

    /// Mean and variance of the mean that are expected of `pixel`.
    pub fn expected(&self, pixel: usize) -> (f64, f64) {
        if self.around.is_empty() {
            return (self.film.pixel(pixel)[self.channel], f64::INFINITY);
        }
        let size = self.size();
        let expected = self.around[block_of(pixel, size, halved(size))].around(&self.sums(pixel));
        (f64::from(expected.mean), f64::from(expected.variance))
    }

    /// Standard error of `pixel`.
    pub fn standard_error(&self, pixel: usize) -> f64 {
        self.expected(pixel).1.sqrt()
    }

    fn sums(&self, pixel: usize) -> Sums {
        let n = f64::from(self.film.batches[pixel]);
        let mean = self.film.pixel(pixel)[self.channel];
        let variance = self.film.variance(pixel, self.channel);
        let square = mean * mean + variance * (n - 1.0);
        let events = if square > 0.0 { n * (mean * mean / square) } else { 0.0 };
        // Sums over all pixels of a film stay finite.
        [n, events, n * mean, n * variance].map(|v| v.min(LARGEST) as f32)
    }
}

fn halved(size: [usize; 2]) -> [usize; 2] {
    size.map(|n| n.div_ceil(2))
}

/// The block that holds `place` of a grid of `size`, in one of `coarse`.
fn block_of(place: usize, size: [usize; 2], coarse: [usize; 2]) -> usize {
    place / size[0] / 2 * coarse[0] + place % size[0] / 2
}

/// Sums over blocks of 2 x 2 (less at the right and lower rim) of a grid of `size`.
fn sums_of_blocks(size: [usize; 2], at: impl Fn(usize) -> Sums + Sync) -> Vec<Sums> {
    let coarse = halved(size);
    let mut blocks = vec![[0.0; 4]; coarse[0] * coarse[1]];
    let of_row = |(row, blocks): (usize, &mut [Sums])| {
        for place in 2 * row * size[0]..(2 * row + 2).min(size[1]) * size[0] {
            let block = &mut blocks[place % size[0] / 2];
            block.iter_mut().zip(at(place)).for_each(|(sum, v)| *sum += v);
        }
    };
    let rows = blocks.par_chunks_mut(coarse[0]).with_min_len(PIXELS.div_ceil(coarse[0]));
    rows.enumerate().for_each(of_row);
    blocks
}
