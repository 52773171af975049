//! One of two halves of a film's batches, whose difference says what is noise without asking how pixels share it.

use super::Film;
use crate::state::{Persistent, State};
use std::io;

/// Means over about half of the batches.
#[derive(Debug, Clone)]
pub(super) struct Half {
    /// `[pixel][channel]`.
    mean: Vec<f32>,
    /// Samples of a pixel.
    weight: Vec<f32>,
}

impl Half {
    pub(super) fn new(pixels: usize, channels: usize) -> Self {
        Half { mean: vec![0.0; pixels * channels], weight: vec![0.0; pixels] }
    }

    /// Adds a batch's `sums` over `w` samples of a pixel that has had `before`, if it is one of this half. Wavelengths of passes in a row make up for each
    /// other, so that halves that took turns would each lack what the other has: they have long runs, each as long as all before it.
    pub(super) fn add<T: Copy + Into<f64>>(&mut self, pixel: usize, before: f64, sums: &[T], w: f64) {
        let run = (before as u64).checked_ilog2().map_or(0, |run| run + 1);
        if run % 2 == 1 {
            return;
        }
        self.weight[pixel] += w as f32;
        let share = w as f32 / self.weight[pixel];
        let means = &mut self.mean[pixel * sums.len()..(pixel + 1) * sums.len()];
        means.iter_mut().zip(sums).for_each(|(mean, sum)| *mean += share * ((*sum).into() / w - f64::from(*mean)) as f32);
    }

    /// Takes over the batches of another half.
    pub(super) fn append(&mut self, other: &Half) {
        let channels = self.mean.len() / self.weight.len().max(1);
        for (pixel, theirs) in other.weight.iter().enumerate() {
            self.weight[pixel] += theirs;
            let share = if *theirs > 0.0 { theirs / self.weight[pixel] } else { 0.0 };
            let at = pixel * channels..(pixel + 1) * channels;
            self.mean[at.clone()].iter_mut().zip(&other.mean[at]).for_each(|(mean, x)| *mean += share * (x - *mean));
        }
    }
}

impl Persistent for Half {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        state.slice(&mut self.mean)?;
        state.slice(&mut self.weight)
    }
}

impl Film {
    /// From now on, before the first batch, [`Film::half_difference`] is kept: 4 bytes more for each channel of a pixel.
    pub fn keep_half(&mut self) {
        self.half = Some(Half::new(self.pixels(), self.channels));
    }

    /// Whether [`Film::half_difference`] is known.
    pub fn keeps_half(&self) -> bool {
        self.half.is_some()
    }

    /// Half the difference of the means of two halves of the batches, scaled so that its square is an unbiased estimate of the squared error of the mean:
    /// with `w` of `W` samples in the one half, whose mean is `x`, that is `sqrt(w / (W - w)) (x - mean)`. The mean plus and minus it have independent
    /// noise, however unequal the halves are; where batches make up for each other its square is more than that error. 0 where it is not kept, or a half has no batch.
    pub fn half_difference(&self, pixel: usize, channel: usize) -> f64 {
        let Some(half) = &self.half else { return 0.0 };
        let at = pixel * self.channels + channel;
        half_difference(half.mean[at].into(), half.weight[pixel].into(), self.mean[at], self.weight[pixel])
    }
}

/// Of a half whose mean is `x` over `w` of `all` samples.
pub(super) fn half_difference(x: f64, w: f64, mean: f64, all: f64) -> f64 {
    if w > 0.0 && all > w { (w / (all - w)).sqrt() * (x - mean) } else { 0.0 }
}
