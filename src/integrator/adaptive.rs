//! Where the samples of camera paths go: more to blocks of pixels whose errors are large, less to the others (Kajiya 1986, section 5; Zwicker et al. 2015).
//!
//! Every batch has the same weight in a pixel's mean, however many samples it had there, and how many is settled by the batches before it. So
//! no batch has a say in its own sample counts, all of them have the same expected value, and their mean is unbiased.

use super::sample_counts::MOST;
use crate::color::cie::is_visible;
use crate::film::{Film, Tile};
use crate::scene::{Bins, FilmSettings};
use crate::state::{Persistent, State};
use rayon::prelude::*;
use std::io;

/// Batches after which rates are settled anew: two differences of two.
const BATCHES: u32 = 4;
/// Fewest samples of a batch that blocks share out unevenly: each has one at least.
const LEAST_SHARED: u32 = 4;
/// Fewest samples of a block, over the mean of all.
const LEAST: f64 = 0.25;
/// Squared relative deviation of rates from which on they are worth it: the part of the work that they save. What blocks differ by where only wavelengths are random
/// is less, and there even rates let errors fall faster.
const WORTHWHILE: f64 = 0.05;

/// Rates of sampling over a picture, and what they are learned from.
#[derive(Debug)]
pub(super) struct Adaptive {
    /// What is kept of the picture.
    bounds: Tile,
    /// Blocks of 8 x 8 pixels in a row of it.
    across: usize,
    /// Pixels count by luminance; where the bins are not visible, by the sum over them.
    by_luminance: bool,
    /// Whether what light paths bring counts, too: where they are merged at the visible points of camera paths, it is the less noisy the more of those there are.
    pub(super) counts_merged: bool,
    /// Samples of each block over the mean of all, in the batch under way and in the next ones: what a batch settles counts from the second one after it on,
    /// so that the adapter need not wait for it.
    rates: Vec<f64>,
    next: Vec<f64>,
    /// What counts of each pixel in the batch before, `[pixel]`, per sample.
    before: Vec<f32>,
    /// Samples of that batch.
    spp_before: u32,
    /// Sum over pixels of what they were in the film, and its mean over the film in the last batch.
    total: f64,
    mean: f64,
    /// Sums over pixels of each block and pairs of batches: squared relative deviation of a sample, from every other pair.
    squares: [Vec<f64>; 2],
    batches: u32,
}

impl Adaptive {
    /// Even rates, where light paths are merged or not.
    pub(super) fn new(settings: &FilmSettings, merges: bool) -> Self {
        let bounds = settings.pixel_bounds();
        let across = bounds.width.div_ceil(8) as usize;
        let blocks = across * bounds.height.div_ceil(8) as usize;
        let Bins { min_nm, max_nm, .. } = settings.bins;
        Self {
            bounds,
            across,
            by_luminance: is_visible(min_nm, max_nm),
            counts_merged: merges,
            rates: vec![1.0; blocks],
            next: vec![1.0; blocks],
            before: vec![0.0; bounds.pixels()],
            spp_before: 0,
            total: 0.0,
            mean: 0.0,
            squares: [vec![0.0; blocks], vec![0.0; blocks]],
            batches: 0,
        }
    }

    /// Numbers of the blocks of `tile`, row by row.
    fn blocks(&self, tile: Tile) -> impl Iterator<Item = usize> + use<> {
        let (tile, across) = (tile.within(self.bounds), self.across);
        let (x, y) = (tile.x as usize / 8, tile.y as usize / 8);
        let columns = tile.width.div_ceil(8) as usize;
        (0..columns * tile.height.div_ceil(8) as usize).map(move |i| (y + i / columns) * across + x + i % columns)
    }

    /// Rates of the blocks of `tile` in a batch of `spp` samples, row by row.
    pub(super) fn rates(&self, tile: Tile, spp: u32) -> Vec<f64> {
        self.blocks(tile).map(|block| if spp < LEAST_SHARED { 1.0 } else { self.rates[block] }).collect()
    }

    /// After all tiles of a batch were traced, of which the last is yet to be learned from.
    pub(super) fn finish_batch(&mut self) {
        self.rates.clone_from(&self.next);
    }

    /// Takes note of what camera paths brought to the pixels of `tile` (and light paths, where they count), radiance and Y, at these rates of its blocks, as sums that stand for
    /// `spp` samples each; `film` has had the batch. To be called for every tile, and then [`Adaptive::settle`].
    pub(super) fn learn(&mut self, (tile, rates): (Tile, &[f64]), found: &[[f32; 2]], spp: u32, film: &Film) {
        let is_pair = self.batches % 2 == 1 && self.mean > 0.0 && self.spp_before == spp;
        let floor = 0.01 * self.mean * self.mean;
        let (tile, width) = (tile.within(self.bounds), self.bounds.width as usize);
        let columns = tile.width as usize;
        let place = |i: usize| (tile.x as usize + i % columns, tile.y as usize + i / columns);
        let rate = |i: usize| rates[i / columns / 8 * columns.div_ceil(8) + i % columns / 8];
        let of_pixel = |(i, [radiance, luminance]): (usize, &[f32; 2])| {
            let (x, y) = place(i);
            let pixel = y * width + x;
            let (value, known) = if self.by_luminance {
                (luminance, film.xyz(pixel)[1])
            } else {
                (radiance, film.pixel(pixel)[..film.bins()].iter().sum())
            };
            let value = value / spp as f32;
            let deviation = f64::from(value) - f64::from(self.before[pixel]);
            let samples = f64::from(spp) * rate(i);
            (value, known, samples * deviation * deviation / (known * known + floor))
        };
        let of_pixels: Vec<(f32, f64, f64)> = found.par_iter().with_min_len(1024).enumerate().map(of_pixel).collect();
        for (i, (value, known, squares)) in of_pixels.into_iter().enumerate() {
            let (x, y) = place(i);
            self.total += known;
            if is_pair {
                self.squares[self.batches as usize / 2 % 2][y / 8 * self.across + x / 8] += squares;
            }
            self.before[y * width + x] = value;
        }
    }

    /// After every batch: settles rates for the next ones, where there are new pairs of batches.
    pub(super) fn settle(&mut self, spp: u32) {
        self.spp_before = spp;
        self.mean = std::mem::take(&mut self.total) / self.before.len() as f64;
        self.batches += 1;
        if self.batches.is_multiple_of(BATCHES) {
            self.next = rates(&self.squares);
        }
    }
}

impl Persistent for Adaptive {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Adaptive {
            bounds: _,
            across: _,
            by_luminance: _,
            counts_merged: _,
            rates,
            next,
            before,
            spp_before,
            total,
            mean,
            squares,
            batches,
        } = self;
        state.slice(rates)?;
        state.slice(next)?;
        state.slice(before)?;
        state.value(spp_before)?;
        state.value(total)?;
        state.value(mean)?;
        squares.iter_mut().try_for_each(|squares| state.slice(squares))?;
        state.value(batches)
    }
}

/// Samples are best spent in proportion to the deviation of one (Neyman 1934), as far as deviations are known: of what sets blocks apart, as much is
/// believed as two independent halves of the data have in common (Spearman-Brown). That some samples take longer was tried, and gained nothing.
fn rates([a, b]: &[Vec<f64>; 2]) -> Vec<f64> {
    let n = a.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
    let covariance = |a: &[f64], b: &[f64]| {
        let (mean_a, mean_b) = (mean(a), mean(b));
        a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum::<f64>() / n
    };
    let deviations = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| (0.5 * (a + b)).sqrt()).collect() };
    let (halves, both) = ([deviations(a, a), deviations(b, b)], deviations(a, b));
    let variance = 0.5 * (covariance(&halves[0], &halves[0]) + covariance(&halves[1], &halves[1]));
    let usual = mean(&both);
    if !(variance > 0.0 && variance.is_finite()) {
        return vec![1.0; a.len()];
    }
    let in_common = (covariance(&halves[0], &halves[1]) / variance).clamp(0.0, 1.0);
    let believed = 2.0 * in_common / (1.0 + in_common);
    let mut rates: Vec<f64> = both.iter().map(|d| usual + believed * (d - usual)).collect();
    if covariance(&rates, &rates) < WORTHWHILE * usual * usual {
        return vec![1.0; a.len()];
    }
    // Bounded, and one in the mean.
    for _ in 0..8 {
        let mean = mean(&rates);
        rates.iter_mut().for_each(|rate| *rate = (*rate / mean).clamp(LEAST, MOST));
    }
    rates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_go_with_deviations_as_far_as_both_halves_agree_on_them() {
        let known = [vec![1.0, 4.0, 9.0, 16.0], vec![1.0, 4.0, 9.0, 16.0]];
        rates(&known)
            .iter()
            .zip([0.4, 0.8, 1.2, 1.6])
            .for_each(|(rate, best)| assert!((rate - best).abs() < 1e-12, "{rate} for {best}"));
        // One bright path in one half says nothing.
        assert_eq!(rates(&[vec![1.0, 1.0, 1.0, 1.0], vec![1.0, 1.0, 100.0, 1.0]]), [1.0; 4]);
        // Nor does a black film, nor one without noise.
        assert_eq!(rates(&[vec![0.0; 4], vec![0.0; 4]]), [1.0; 4]);
        let few = [vec![1.0; 1], vec![1e6; 1]];
        assert_eq!(rates(&few), [1.0]);
        // A tenth more or less is not worth it.
        assert_eq!(rates(&[vec![0.81, 1.21, 0.81, 1.21], vec![0.81, 1.21, 0.81, 1.21]]), [1.0; 4]);
        // Within bounds, and one in the mean.
        let mut lone = vec![0.0; 100];
        lone[3] = 1.0;
        let rates = rates(&[lone.clone(), lone]);
        assert_eq!((rates[3], rates[4] < 1.0, rates[4] >= LEAST), (MOST, true, true));
        assert!((rates.iter().sum::<f64>() / 100.0 - 1.0).abs() < 1e-2, "{rates:?}");
    }

    #[test]
    fn a_block_of_noise_has_more_samples_from_the_sixth_batch_on() {
        let settings = FilmSettings::new(16, 20, Bins { count: 2, min_nm: 400.0, max_nm: 700.0 });
        let (mut adaptive, mut film) = (Adaptive::new(&settings, false), Film::new(&settings));
        let tiles = [Tile { x: 0, y: 0, width: 16, height: 8 }, Tile { x: 0, y: 8, width: 16, height: 12 }];
        let all = |adaptive: &Adaptive| tiles.map(|tile| adaptive.rates(tile, 4)).concat();
        for batch in 0..4 {
            assert_eq!(all(&adaptive), [1.0; 6]);
            adaptive.finish_batch();
            for tile in tiles {
                // Pixels at (8, 8) and beyond, but not those of the last rows, are 1 and 3 in turns, the others always 2.
                let value = |i: u32| {
                    let (x, y) = (i % 16, tile.y + i / 16);
                    if x >= 8 && (8..16).contains(&y) { 1.0 + 2.0 * (batch % 2) as f32 } else { 2.0 }
                };
                let values: Vec<f32> = (0..tile.width * tile.height).map(value).collect();
                let sums: Vec<f32> = values.iter().flat_map(|v| [*v, *v, 0.0, 4.0 * v, 0.0]).collect();
                film.add_batch(tile, &sums, 4);
                let by_camera: Vec<[f32; 2]> = values.iter().map(|v| [2.0 * v, 4.0 * v]).collect();
                let even = vec![1.0; tile.width.div_ceil(8) as usize * tile.height.div_ceil(8) as usize];
                adaptive.learn((tile, &even), &by_camera, 4, &film);
            }
            adaptive.settle(4);
        }
        // The fifth may be under way.
        assert_eq!(all(&adaptive), [1.0; 6]);
        adaptive.finish_batch();
        let rates = all(&adaptive);
        assert!(rates[3] > 3.0, "{rates:?}");
        assert!(rates.iter().enumerate().all(|(block, &rate)| block == 3 || rate < 0.6), "{rates:?}");
    }
}
