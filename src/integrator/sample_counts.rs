//! How many samples the blocks of a tile have, pass by pass, and in which work items they are taken (common/work.wgsl).

use crate::gpu::layout::{WorkGroup, WorkItem};

/// Most samples of a block, over the mean of all.
pub(super) const MOST: f64 = 4.0;
/// The number of a copy has two bits (camera_paths.wgsl).
const _: () = assert!(MOST <= 4.0);
/// Passes of a round: sample counts are whole numbers in each.
pub(super) const ROUND: u32 = 16;
/// Runs of a round: a quarter of its passes each. Wavelengths of the passes of a run are evenly spread, as those of a round are.
pub(super) const RUNS: u32 = 4;

/// Samples of the blocks of a tile in a round of passes: of each some whole runs, in a row, which go on from the last to the first. Where a block begins moves from
/// round to round so that over four rounds (16, 64, ...) of equal rates it has every run as often, and with it wavelengths spread as evenly as those of all passes.
pub(super) struct SampleCounts {
    passes: u32,
    counts: Vec<u32>,
    /// The pass of the first sample.
    starts: Vec<u32>,
}

/// A window of passes as the shaders read it.
pub(super) struct Window {
    /// How many there are.
    pub(super) passes: u32,
    /// All work.
    pub(super) items: Vec<WorkItem>,
    /// Samples of a pixel in all items together.
    pub(super) samples: u32,
}

impl Window {
    /// Samples of all pixels of a tile of this size together: blocks of 8 x 8 at its rim are not whole.
    pub(super) fn paths(&self, width: u32, height: u32) -> u64 {
        let across = width.div_ceil(8);
        let side = |size: u32, block: u32| u64::from((size - 8 * block).min(8));
        let pixels = |item: &WorkItem| side(width, item.block % across) * side(height, item.block / across);
        self.items.iter().map(|item| pixels(item) * u64::from(item.count)).sum()
    }

    /// Groups of items, each of up to `most` samples, or of one item.
    pub(super) fn groups(&self, most: u32) -> Vec<WorkGroup> {
        let mut groups: Vec<WorkGroup> = Vec::new();
        for (i, item) in self.items.iter().enumerate() {
            let (i, samples) = (i as u32, item.count);
            match groups.last_mut() {
                Some(group) if group.samples + samples <= most => {
                    group.end = i + 1;
                    group.samples += samples;
                }
                _ => groups.push(WorkGroup { first: i, end: i + 1, place: item.place, samples }),
            }
        }
        groups
    }
}

impl SampleCounts {
    /// For a batch of so many blocks.
    pub(super) fn new(blocks: usize) -> Self {
        Self { passes: 0, counts: vec![0; blocks], starts: vec![0; blocks] }
    }

    /// Chooses counts of a round of up to [`ROUND`] passes, whose means over blocks are `rates` of the passes: round `number` of all that are as long, of a tile
    /// whose random numbers have the key `key`. One that has no whole runs is even.
    pub(super) fn begin_round(&mut self, rates: &[f64], passes: u32, number: u64, key: u64) {
        if !passes.is_multiple_of(RUNS) {
            return self.begin_evenly(passes);
        }
        self.passes = passes;
        let turn = digit_sum(number);
        // What is rounded off, or is more than it should be, goes to the next block, so that the sum over blocks is right. The same in every round: sample counts
        // that change would spoil how wavelengths are spread.
        let mut left = 0.5;
        for (block, rate) in rates.iter().enumerate() {
            left += rate * f64::from(RUNS);
            let runs = left.floor().clamp(1.0, MOST * f64::from(RUNS));
            left -= runs;
            let runs = runs as u32;
            let first = splitmix(key ^ block as u64).wrapping_add(u64::from(runs) * turn) % u64::from(RUNS);
            self.counts[block] = runs * (passes / RUNS);
            self.starts[block] = if runs.is_multiple_of(RUNS) { 0 } else { first as u32 * (passes / RUNS) };
        }
    }

    /// Likewise, one in every pass.
    pub(super) fn begin_evenly(&mut self, passes: u32) {
        self.passes = passes;
        self.counts.fill(passes);
        self.starts.fill(0);
    }

    /// Passes `first` to `first + passes` of the round.
    pub(super) fn window(&self, first: u32, passes: u32) -> Window {
        let mut window = Window { passes, items: Vec::with_capacity(self.counts.len()), samples: 0 };
        for (block, &count) in self.counts.iter().enumerate() {
            // From the first pass to the last one, as often as it takes.
            let mut sample = 0;
            let mut pass = self.starts[block];
            while sample < count {
                let copy = sample / self.passes;
                let end = self.passes.min(pass + count.min((copy + 1) * self.passes) - sample);
                let (from, to) = (pass.max(first), end.min(first + passes));
                if from < to {
                    window.items.push(WorkItem {
                        place: window.samples,
                        copy,
                        count: to - from,
                        pass_index: from - first,
                        weight: self.passes as f32 / count as f32,
                        block: block as u32,
                        ..Default::default()
                    });
                    window.samples += to - from;
                }
                sample += end - pass;
                pass = end % self.passes;
            }
        }
        window
    }
}

/// Sum of the digits of base [`RUNS`]. As the first digit of a radical inverse before those of `number` it makes a point that is as evenly spread as the rest
/// (all ones in the first row of the generator matrix: Faure 1982).
fn digit_sum(mut number: u64) -> u64 {
    let mut sum = 0;
    while number > 0 {
        sum += number % u64::from(RUNS);
        number /= u64::from(RUNS);
    }
    sum
}

/// SplitMix64 (Steele et al. 2014).
pub(super) fn splitmix(key: u64) -> u64 {
    let mut h = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^ (h >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (block, which time it has the pass, pass within the window) of all samples.
    fn samples(window: &Window) -> Vec<(u32, u32, u32)> {
        let of_item =
            |&WorkItem { count, pass_index, copy, block, .. }: &WorkItem| (0..count).map(move |i| (block, copy, pass_index + i));
        window.items.iter().flat_map(of_item).collect()
    }

    #[test]
    fn every_sample_is_in_one_unit_of_its_window() {
        let rates = [0.25, 4.0, 1.0, 0.9, 2.3, 0.3, 1.7, 0.25];
        let mut counts = SampleCounts::new(rates.len());
        for (round, passes) in [16, 8, 16, 4, 5, 1].into_iter().enumerate() {
            counts.begin_round(&rates, passes, round as u64, 7);
            for size in [1, 3, 8, 16] {
                let mut all = Vec::new();
                for first in (0..passes).step_by(size as usize) {
                    let window = counts.window(first, size.min(passes - first));
                    assert!(window.items.iter().all(|u| (1..=window.passes).contains(&u.count)));
                    let places: Vec<u32> =
                        window.items.iter().scan(0, |sum, u| Some(std::mem::replace(sum, *sum + u.count))).collect();
                    assert!(window.items.iter().zip(&places).all(|(u, place)| u.place == *place));
                    let found = samples(&window);
                    assert!(found.iter().all(|(_, _, pass)| *pass < window.passes), "{found:?}");
                    assert_eq!(found.len() as u32, window.samples);
                    assert!(window.items.iter().all(|u| u.weight == passes as f32 / counts.counts[u.block as usize] as f32));
                    all.extend(found.into_iter().map(|(block, copy, pass)| (block, copy, first + pass)));
                }
                all.sort_unstable();
                // From the first one on, all passes before any again.
                let starts = &counts.starts;
                let of_block = |b: usize| (0..counts.counts[b]).map(move |i| (b as u32, i / passes, (starts[b] + i) % passes));
                let mut expected: Vec<_> = (0..8).flat_map(of_block).collect();
                expected.sort_unstable();
                assert_eq!(all, expected);
            }
        }
    }

    #[test]
    fn groups_have_all_units_in_turn_and_up_to_so_many_samples() {
        let mut counts = SampleCounts::new(8);
        counts.begin_round(&[0.25, 4.0, 1.0, 0.9, 2.3, 0.3, 1.7, 0.25], 16, 0, 0);
        let window = counts.window(0, 16);
        for most in [1, 5, 16, 40, 64, 1000] {
            let groups = window.groups(most);
            let (mut unit, mut place) = (0, 0);
            for (i, group) in groups.iter().enumerate() {
                assert_eq!((group.first, group.place), (unit, place), "group {i} of up to {most}");
                let samples: Vec<u32> = window.items[group.first as usize..group.end as usize].iter().map(|u| u.count).collect();
                assert_eq!(group.samples, samples.iter().sum::<u32>());
                assert!(group.samples <= most || samples.len() == 1);
                // As full as can be.
                let next = window.items.get(group.end as usize).map_or(u32::MAX, |u| u.count);
                assert!(group.samples.saturating_add(next) > most);
                (unit, place) = (group.end, place + group.samples);
            }
            assert_eq!((unit as usize, place), (window.items.len(), window.samples));
        }
        let most = window.items.iter().map(|u| u.count).max().unwrap();
        assert!(most == 16 && window.groups(16).len() < window.items.len(), "nothing to put together");
    }

    #[test]
    fn blocks_have_their_rates_to_a_quarter_of_a_round() {
        let rates: Vec<f64> = (0..64).map(|i| 0.25 + 1.5 * f64::from(i) / 63.0).collect();
        let mut counts = SampleCounts::new(64);
        for passes in [16, 8, 4] {
            counts.begin_round(&rates, passes, 5, 1);
            assert!(counts.counts.iter().sum::<u32>().abs_diff(64 * passes) <= passes / RUNS);
            for (count, rate) in counts.counts.iter().zip(&rates) {
                assert!((f64::from(*count) / f64::from(passes) - rate).abs() <= 0.25, "{count} of {passes} for {rate}");
            }
        }
        // One run each is the least, and then there is none left for others; a round that has none is even.
        counts.begin_round(&[0.1; 64], 16, 0, 7);
        assert_eq!(counts.counts, [4; 64]);
        counts.begin_round(&rates, 3, 0, 7);
        assert_eq!(counts.counts, [3; 64]);
    }

    #[test]
    fn wavelengths_of_every_block_are_as_evenly_spread_as_those_of_all_passes() {
        // Offsets of passes are reversed bits of their numbers.
        let rates: Vec<f64> = (1..=16).map(|runs| 0.25 * f64::from(runs)).collect();
        let mut counts = SampleCounts::new(16);
        for (passes, rounds) in [(16, 4), (16, 16), (16, 64), (8, 16), (4, 64)] {
            let strata = (passes * rounds / RUNS) as usize;
            let mut found = vec![vec![0; strata]; 16];
            for round in 0..rounds {
                counts.begin_round(&rates, passes, u64::from(round), 3);
                for (block, _, pass) in samples(&counts.window(0, passes)) {
                    let offset = f64::from((round * passes + pass).reverse_bits()) * 0.5f64.powi(32);
                    found[block as usize][(offset * strata as f64) as usize] += 1;
                }
            }
            for (block, found) in found.iter().enumerate() {
                assert!(found.iter().all(|n| *n == block + 1), "block {block}, {rounds} rounds of {passes}: {found:?}");
            }
        }
    }
}
