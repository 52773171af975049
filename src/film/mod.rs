//! The film on the host: for every pixel that is kept of the picture and every channel the mean over batches and its standard error.
//!
//! A channel is a wavelength bin (mean radiance over the bin, W m^-2 sr^-1 nm^-1, or irradiance, W m^-2 nm^-1, for irradiance
//! sensors) or, after the bins, one of CIE X, Y, Z (683.002 times the integral of radiance and matching function: cd m^-2, or
//! lx).
//!
//! Errors come from batches, not from single samples: samples of one batch may be correlated (low-discrepancy points, shared
//! photons). Independent batches (those that are measured: [`crate::render::Batch::even`]) tell errors as they are. Batches of a render go on in one low-discrepancy sequence: they make
//! up for each other, and what they differ by overstates the error of their mean. A batch of `spp` samples has weight `spp`; with batch means `x_i` and weights `w_i` summing to `W`,
//! the mean is `sum w_i x_i / W` and its variance `sum w_i (x_i - mean)^2 / ((n - 1) W)`, kept by the weighted recurrence of West
//! (1979), "Updating mean and variance estimates". With equal weights, as in any render but for its last batch, that is the
//! textbook s^2 / n.
//!
//! Pixels of one batch may be correlated too (they share their wavelengths), so the error of the image's mean does not follow from theirs: it is
//! kept by itself, from the means of batches.
//!
//! Memory: `12 (bins + 3) + 12` bytes per pixel, 288 for 20 bins. Deviations are kept in single precision: sums of squares, which cannot
//! cancel, of as many terms as there are batches.

pub mod aov;
mod earlier;
mod errors;
mod half;
mod merge;
mod whole;

pub use earlier::Earlier;
pub use errors::Errors;

use crate::color::cie::is_visible;
use crate::error::{Error, Result};
use crate::memory;
use crate::scene::FilmSettings;
pub use crate::scene::Tile;
use crate::state::{Persistent, State, invalid};
use half::Half;
use rayon::prelude::*;
use std::io;
use whole::Whole;

/// Pixels and values that a core takes at a time, at least.
const PIXELS: usize = 1 << 10;
const VALUES: usize = 1 << 14;

/// Means and deviations, weights and numbers of batches of a row of the film, and the sums of a tile's row.
type Row<'a, T> = (((&'a mut [f64], &'a mut [f32]), (&'a mut [f64], &'a mut [u32])), &'a [T]);

/// Batch statistics of every pixel and channel. Pixels are counted row by row from the upper left of what is kept ([`FilmSettings::pixel_bounds`]).
#[derive(Debug, Clone)]
pub struct Film {
    settings: FilmSettings,
    channels: usize,
    /// Means, `[pixel][channel]`.
    mean: Vec<f64>,
    /// Weighted sums of squared deviations, `[pixel][channel]`.
    deviation: Vec<f32>,
    /// Samples so far, per pixel.
    weight: Vec<f64>,
    /// Batches so far, per pixel.
    batches: Vec<u32>,
    whole: Whole,
    half: Option<Half>,
}

impl Film {
    /// An empty film. Aborts where memory runs out; [`Film::try_new`] says so instead.
    pub fn new(settings: &FilmSettings) -> Self {
        let pixels = settings.pixel_bounds().pixels();
        let channels = settings.bins.count as usize + 3;
        Film {
            settings: settings.clone(),
            channels,
            mean: vec![0.0; pixels * channels],
            deviation: vec![0.0; pixels * channels],
            weight: vec![0.0; pixels],
            batches: vec![0; pixels],
            whole: Whole::new(channels),
            half: None,
        }
    }

    /// An empty film, or [`Error::Usage`] where the memory for it cannot be had.
    pub fn try_new(settings: &FilmSettings) -> Result<Self> {
        let bytes = Self::bytes(settings);
        if !memory::can_have(bytes) {
            let (Tile { width: w, height: h, .. }, n) = (settings.pixel_bounds(), settings.bins.count);
            return Err(Error::usage(
                format!("a film of {w}x{h} pixels and {n} bins takes {:.1} GB, more than there is", bytes as f64 * 1e-9),
                "choose a smaller --size or fewer --channels",
            ));
        }
        Ok(Self::new(settings))
    }

    /// Bytes that a film of these settings takes.
    pub fn bytes(settings: &FilmSettings) -> u64 {
        let pixels = settings.pixel_bounds().pixels() as u64;
        pixels.saturating_mul(12 * (u64::from(settings.bins.count) + 3) + 12)
    }

    /// Adds one batch to the pixels of `tile`, a part of what is kept of the picture. `sums` holds `[pixel][bins + 3]` sums over the batch's `spp` samples of each bin's
    /// mean radiance, then of X, Y, Z. Every pixel of the film is to be in one tile of every batch.
    ///
    /// # Panics
    /// If the tile is not inside the film, `sums` has the wrong length or `spp` is 0: the caller's mistakes, which no input can
    /// make.
    pub fn add_batch(&mut self, tile: Tile, sums: &[f32], spp: u32) {
        let (bounds, channels) = (self.settings.pixel_bounds(), self.channels);
        let leaves_columns = tile.x < bounds.x || tile.x + tile.width > bounds.x + bounds.width;
        let leaves_rows = tile.y < bounds.y || tile.y + tile.height > bounds.y + bounds.height;
        assert!(!leaves_columns && !leaves_rows, "tile {tile:?} leaves the film, {bounds:?}");
        assert_eq!(sums.len(), tile.width as usize * tile.height as usize * channels, "sums of tile {tile:?}");
        self.add(tile, sums, spp);
    }

    /// Adds one batch to the whole film; `sums` as in [`Film::add_batch`], in double precision.
    ///
    /// # Panics
    /// If `sums` has the wrong length or `spp` is 0.
    pub fn add_batch_f64(&mut self, sums: &[f64], spp: u32) {
        assert_eq!(sums.len(), self.mean.len(), "sums of the whole film");
        self.add(self.settings.pixel_bounds(), sums, spp);
    }

    /// Adds to rows on all cores, while one sums up the whole; in the same order always.
    fn add<T: Copy + Into<f64> + Sync>(&mut self, tile: Tile, sums: &[T], spp: u32) {
        assert!(spp > 0, "a batch without samples");
        let (channels, w, bounds) = (self.channels, f64::from(spp), self.settings.pixel_bounds());
        let (tile, width, columns) = (tile.within(bounds), bounds.width as usize, tile.width as usize);
        let (first, end) = (tile.x as usize, tile.x as usize + columns);
        let rows = |y: u32| y as usize * width..(y + tile.height) as usize * width;
        let (pixels, values) = (rows(tile.y), rows(tile.y).start * channels..rows(tile.y).end * channels);
        if let Some(half) = &mut self.half {
            for (i, sums) in sums.chunks_exact(channels).enumerate() {
                let pixel = (tile.y as usize + i / columns) * width + first + i % columns;
                half.add(pixel, self.weight[pixel], sums, w);
            }
        }
        let whole = &mut self.whole;
        let (mean, deviation) = (&mut self.mean[values.clone()], &mut self.deviation[values]);
        let (weight, batches) = (&mut self.weight[pixels.clone()], &mut self.batches[pixels]);
        let of_row = |(((mean, deviation), (weight, batches)), sums): Row<'_, T>| {
            let pixels = mean.chunks_exact_mut(channels).zip(deviation.chunks_exact_mut(channels)).skip(first);
            let weights = weight[first..end].iter_mut().zip(&mut batches[first..end]);
            for (((mean, deviation), (weight, batches)), sums) in pixels.zip(weights).zip(sums.chunks_exact(channels)) {
                *weight += w;
                *batches += 1;
                let share = w / *weight;
                for ((mean, deviation), sum) in mean.iter_mut().zip(deviation).zip(sums) {
                    // Finite, whatever the film holds: a square beyond single precision stays at its greatest.
                    *deviation = (*deviation + update(mean, (*sum).into() / w, w, share) as f32).min(f32::MAX);
                }
            }
        };
        let update_rows = || {
            let rows = mean.par_chunks_mut(width * channels).zip(deviation.par_chunks_mut(width * channels));
            let weights = weight.par_chunks_mut(width).zip(batches.par_chunks_mut(width));
            let rows = rows.zip(weights).zip(sums.par_chunks(columns * channels));
            rows.with_min_len((VALUES / (columns * channels)).max(1)).for_each(of_row);
        };
        let add_to_whole = || {
            for sums in sums.chunks_exact(channels) {
                whole.sums.iter_mut().zip(sums).for_each(|(whole, sum)| *whole += (*sum).into() / w);
            }
            whole.pixels += sums.len() / channels;
        };
        rayon::join(update_rows, add_to_whole);
        if self.whole.pixels == self.weight.len() {
            self.whole.finish_batch(w);
        }
    }

    /// Resolution, part of the picture, bins and filter.
    pub fn settings(&self) -> &FilmSettings {
        &self.settings
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.weight.len()
    }

    /// Number of wavelength bins.
    pub fn bins(&self) -> usize {
        self.channels - 3
    }

    /// Channels per pixel: the bins, then X, Y, Z.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Mean of every channel of a pixel: the bins, then X, Y, Z.
    pub fn pixel(&self, pixel: usize) -> &[f64] {
        &self.mean[pixel * self.channels..(pixel + 1) * self.channels]
    }

    /// Mean of bin `b` of a pixel.
    pub fn bin(&self, pixel: usize, b: usize) -> f64 {
        self.pixel(pixel)[..self.bins()][b]
    }

    /// Mean X, Y, Z of a pixel.
    pub fn xyz(&self, pixel: usize) -> [f64; 3] {
        let xyz = &self.pixel(pixel)[self.bins()..];
        [xyz[0], xyz[1], xyz[2]]
    }

    /// X, Y, Z of every pixel, as the colour stage takes them.
    pub fn xyz_image(&self) -> Vec<[f32; 3]> {
        (0..self.pixels()).map(|pixel| self.xyz(pixel).map(|v| v as f32)).collect()
    }

    /// Standard error of the mean of a pixel's channel (bins, then X, Y, Z) from its own batches; infinite before the second one. While a pixel has
    /// found little light, [`Film::errors`] know better.
    pub fn standard_error(&self, pixel: usize, channel: usize) -> f64 {
        self.variance(pixel, channel).sqrt()
    }

    /// The square of [`Film::standard_error`].
    fn variance(&self, pixel: usize, channel: usize) -> f64 {
        let n = self.batches[pixel];
        if n < 2 {
            return f64::INFINITY;
        }
        let deviation = self.deviation[pixel * self.channels..(pixel + 1) * self.channels][channel];
        f64::from(deviation) / (f64::from(n - 1) * self.weight[pixel])
    }

    /// Standard errors of a channel's pixels with what is known of their surroundings.
    pub fn errors(&self, channel: usize) -> Errors<'_> {
        Errors::new(self, channel)
    }

    /// Standard error of the mean of a channel over all pixels, correlations between them included, from [`Film::mean_groups`]; infinite before the second
    /// batch.
    pub fn mean_standard_error(&self, channel: usize) -> f64 {
        self.whole.standard_error(channel)
    }

    /// Groups of successive batches that [`Film::mean_standard_error`] comes from: up to 32, of ever more batches.
    pub fn mean_groups(&self) -> usize {
        self.whole.groups()
    }

    /// The film's estimate of its own error: the root over pixels of the mean of `sigma^2 / (Y^2 + 0.01 <Y>^2)`, sigma and
    /// Y being what is expected of a pixel ([`Errors`]) and `<Y>` the mean over the film; the second term keeps dark pixels from ruling. Where the bins are not visible, likewise
    /// over all of them in place of Y. Infinite before the second batch, and for a black film, which says nothing about itself.
    pub fn relative_error(&self) -> f64 {
        let (bins, range) = (self.bins(), self.settings.bins);
        let channels = if is_visible(range.min_nm, range.max_nm) { bins + 1..bins + 2 } else { 0..bins };
        let squares: Vec<f64> = channels.filter_map(|channel| self.squared_relative_error(channel)).collect();
        if squares.is_empty() { f64::INFINITY } else { (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() }
    }

    /// The mean over pixels of a channel's squared error, as in [`Film::relative_error`]; `None` if it is black.
    fn squared_relative_error(&self, channel: usize) -> Option<f64> {
        let mean = self.mean_of(channel);
        if mean == 0.0 {
            return None;
        }
        let (errors, floor) = (self.errors(channel), 0.01 * mean * mean);
        let square = |pixel: usize| {
            let (value, variance) = errors.expected(pixel);
            variance / (value * value + floor)
        };
        Some(self.sum_over_pixels(square) / self.pixels() as f64)
    }

    /// Mean of a channel over all pixels.
    pub fn mean_of(&self, channel: usize) -> f64 {
        self.sum_over_pixels(|pixel| self.pixel(pixel)[channel]) / self.pixels() as f64
    }

    /// Of values that all cores work out; in the order of the pixels always.
    fn sum_over_pixels(&self, value: impl Fn(usize) -> f64 + Sync + Send) -> f64 {
        let (mut sum, mut values) = (0.0, Vec::new());
        for first in (0..self.pixels()).step_by(PIXELS << 8) {
            let end = self.pixels().min(first + (PIXELS << 8));
            (first..end).into_par_iter().with_min_len(PIXELS).map(&value).collect_into_vec(&mut values);
            values.iter().for_each(|value| sum += value);
        }
        sum
    }

    /// Batches that every pixel has had.
    pub fn batches(&self) -> u32 {
        self.batches.iter().copied().min().unwrap_or(0)
    }

    /// Samples of a pixel so far.
    pub fn samples(&self, pixel: usize) -> f64 {
        self.weight[pixel]
    }

    /// Samples that every pixel has had.
    pub fn samples_per_pixel(&self) -> u64 {
        self.weight.iter().copied().reduce(f64::min).unwrap_or(0.0) as u64
    }

    /// Samples of the pixels that have had most: more than others where a batch ended early.
    pub fn most_samples_per_pixel(&self) -> u64 {
        self.weight.iter().copied().reduce(f64::max).unwrap_or(0.0) as u64
    }

    /// Total flux through an irradiance sensor of `area` m^2, whose pixels all have the same area: W nm^-1 of each bin, then X, Y
    /// (lm) and Z.
    pub fn total_flux(&self, area: f64) -> Vec<f64> {
        (0..self.channels).map(|channel| area * self.mean_of(channel)).collect()
    }

    /// The settings of the film that [`Film::block_means`] fills.
    pub fn block_settings(settings: &FilmSettings, size: u32) -> FilmSettings {
        let Tile { width, height, .. } = settings.pixel_bounds();
        FilmSettings { width: width.div_ceil(size), height: height.div_ceil(size), crop: None, ..settings.clone() }
    }

    /// Means over blocks of `size` x `size` pixels (less at the right and lower rim), `[block][bins + 3]`. Pixels of one batch
    /// are correlated, so the error of a block does not follow from those of its pixels: render every batch into a film of its
    /// own and add its block means to a film of [`Film::block_settings`], as [`crate::render::render_blocks`] does.
    pub fn block_means(&self, size: u32) -> Vec<f64> {
        let blocks = Self::block_settings(&self.settings, size);
        let mut sums = vec![0.0; blocks.width as usize * blocks.height as usize * self.channels];
        let mut counts = vec![0u32; blocks.width as usize * blocks.height as usize];
        let width = self.settings.pixel_bounds().width as usize;
        for pixel in 0..self.pixels() {
            let (x, y) = (pixel % width, pixel / width);
            let block = y / size as usize * blocks.width as usize + x / size as usize;
            counts[block] += 1;
            let sums = &mut sums[block * self.channels..(block + 1) * self.channels];
            sums.iter_mut().zip(self.pixel(pixel)).for_each(|(sum, v)| *sum += v);
        }
        for (sums, &count) in sums.chunks_exact_mut(self.channels).zip(&counts) {
            sums.iter_mut().for_each(|sum| *sum /= f64::from(count));
        }
        sums
    }
}

impl Persistent for Film {
    /// The settings are the request's.
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Film { settings: _, channels, mean, deviation, weight, batches, whole, half } = self;
        state.slice(mean)?;
        state.slice(deviation)?;
        state.slice(weight)?;
        state.slice(batches)?;
        if let Some(many) = batches.iter().find(|n| **n > u32::MAX >> 1) {
            return Err(invalid(format!("{many} batches of a pixel")));
        }
        whole.persist(state)?;
        let mut keeps_half = half.is_some();
        state.flag(&mut keeps_half)?;
        // Who only reads it need not know.
        *half = if keeps_half { half.take().or_else(|| Some(Half::new(weight.len(), *channels))) } else { None };
        half.as_mut().map_or(Ok(()), |half| half.persist(state))
    }
}

/// West's recurrence for one more value `x` of weight `w`, which is `share` of all weights so far: what the sum of squared deviations grows by.
fn update(mean: &mut f64, x: f64, w: f64, share: f64) -> f64 {
    let delta = x - *mean;
    *mean += share * delta;
    w * delta * (x - *mean)
}
