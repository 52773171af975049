//! The mean over the image and its error. Wavelengths of successive passes complement each other, so that single batches differ by colour more than
//! renders do; batches are therefore taken together in groups, ever larger ones, which hold more and more whole turns of the wavelengths.

use super::update;
use crate::state::{Persistent, State, invalid};
use std::io;

/// Groups are merged in pairs when there are so many; half of them still make a good error.
const GROUPS: usize = 32;

/// The mean over the image of each channel.
#[derive(Debug, Clone, Default)]
pub(super) struct Whole {
    /// Sums over the pixels of the batch under way of their means, and how many pixels these are.
    pub(super) sums: Vec<f64>,
    pub(super) pixels: usize,
    /// Successive batches of `size` each, but for the last.
    groups: Vec<Group>,
    size: u32,
}

#[derive(Debug, Clone, Default)]
struct Group {
    batches: u32,
    /// Samples per pixel.
    weight: f64,
    mean: Vec<f64>,
}

impl Group {
    fn add(&mut self, mean: &[f64], weight: f64, batches: u32) {
        self.batches += batches;
        self.weight += weight;
        self.mean.iter_mut().zip(mean).for_each(|(mean, x)| *mean += weight / self.weight * (x - *mean));
    }
}

impl Whole {
    pub(super) fn new(channels: usize) -> Self {
        Whole { sums: vec![0.0; channels], size: 1, ..Whole::default() }
    }

    /// Takes in the means of a batch of `w` samples per pixel that every pixel has had.
    pub(super) fn finish_batch(&mut self, w: f64) {
        let is_full = self.groups.last().is_none_or(|group| group.batches == self.size);
        if is_full && self.groups.len() == GROUPS {
            self.halve();
        }
        if is_full {
            self.groups.push(Group { mean: vec![0.0; self.sums.len()], ..Group::default() });
        }
        let pixels = self.pixels as f64;
        let means: Vec<f64> = self.sums.iter().map(|sum| sum / pixels).collect();
        if let Some(group) = self.groups.last_mut() {
            group.add(&means, w, 1);
        }
        self.sums.fill(0.0);
        self.pixels = 0;
    }

    /// Makes one group of every two in a row.
    fn halve(&mut self) {
        for pair in 0..self.groups.len() / 2 {
            let second = self.groups.remove(pair + 1);
            self.groups[pair].add(&second.mean, second.weight, second.batches);
        }
        self.size *= 2;
    }

    /// Takes over the groups of other batches.
    pub(super) fn append(&mut self, other: &Whole) {
        self.groups.extend(other.groups.iter().cloned());
        self.size = self.size.max(other.size);
        while self.groups.len() > GROUPS {
            self.halve();
        }
    }

    /// Groups of batches that errors come from.
    pub(super) fn groups(&self) -> usize {
        self.groups.len()
    }

    /// Standard error of a channel's mean; infinite before the second batch.
    pub(super) fn standard_error(&self, channel: usize) -> f64 {
        if self.groups.len() < 2 {
            return f64::INFINITY;
        }
        let (mut weight, mut mean, mut deviation) = (0.0, 0.0, 0.0);
        for group in &self.groups {
            weight += group.weight;
            deviation += update(&mut mean, group.mean[channel], group.weight, group.weight / weight);
        }
        (deviation / ((self.groups.len() - 1) as f64 * weight)).sqrt()
    }
}

impl Persistent for Group {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Group { batches, weight, mean } = self;
        state.value(batches)?;
        state.value(weight)?;
        state.slice(mean)
    }
}

impl Persistent for Whole {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Whole { sums, pixels, groups, size } = self;
        state.slice(sums)?;
        state.size(pixels)?;
        state.value(size)?;
        let mut count = groups.len();
        state.size(&mut count)?;
        if count > GROUPS {
            return Err(invalid(format!("{count} groups of batches")));
        }
        if *size == 0 || *size > u32::MAX >> 1 {
            return Err(invalid(format!("groups of {size} batches")));
        }
        groups.resize(count, Group { mean: vec![0.0; sums.len()], ..Group::default() });
        groups.iter_mut().try_for_each(|group| group.persist(state))
    }
}
