//! A pass in dispatches that are short enough for any driver.

use crate::error::Result;
use crate::gpu::layout::{
    COUNTER_CROWDED, COUNTER_ENDED, COUNTER_MOST_RAYS, COUNTER_NEGATIVE, COUNTER_NODES, COUNTER_NOT_FINITE, COUNTER_PRIMITIVES,
    COUNTER_RAYS, COUNTER_SATURATED, COUNTER_TRUNCATED, COUNTER_UNFINISHED, COUNTERS, Params,
};
use crate::gpu::{Gpu, Kernel, Resource, Staging, Timer};
use crate::render::Halt;
use crate::stats::{BatchStats, Counts};
use std::time::{Duration, Instant};

/// How long a dispatch should take: well below the watchdogs of desktop drivers.
const DISPATCH_TIME: Duration = Duration::from_millis(50);
/// On a CPU, of which cores wait for each other at the end of every dispatch.
const DISPATCH_TIME_CPU: Duration = Duration::from_millis(100);

/// Workgroups of the first dispatch, of which nobody knows how long it takes: few, and the next ones twice as many each, up to that time.
pub(super) const FIRST_GROUPS: u32 = 2;
const BYTES_OF_COUNTERS: u64 = 4 * COUNTERS as u64;

/// Fewest workgroups that a pass is split into: they keep all cores busy, on a GPU with some 100,000 paths at a time. The fewer, the more samples does an invocation take, and the less do lanes
/// wait for the last one of others: 8 for each of two cores took .90 of the CPU time of 32 (`compare/cornell_spheres`, `compare/bunny_light`, 128x128, 64 samples).
const LEAST_GROUPS_OF_CORE: u32 = 8;
const LEAST_GROUPS_GPU: u32 = 4096;

/// Fewest workgroups that a pass is to be split into on `gpu`.
pub(super) fn least_groups(gpu: &Gpu) -> u32 {
    if gpu.info.is_cpu() { LEAST_GROUPS_OF_CORE * rayon::current_num_threads() as u32 } else { LEAST_GROUPS_GPU }
}

/// Kernels that run one after the other on the same workgroups.
#[derive(Debug)]
pub(super) struct Pass {
    pub(super) kernels: Vec<Kernel>,
    /// Most workgroups of a dispatch.
    pub(super) limit: u32,
    /// Place of the first kernel's time in [`BatchStats::kernel_times`].
    pub(super) first_time: usize,
    /// Workgroups of the next dispatch: adapted to the time that it should take.
    pub(super) groups: u32,
}

/// What the dispatches of a pass over one tile share.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(super) gpu: &'a Gpu,
    /// Looked at between dispatches.
    pub(super) halt: &'a Halt,
    pub(super) timer: Option<&'a Timer>,
    pub(super) uniforms: &'a Resource,
    pub(super) counters: &'a (Resource, Staging),
    pub(super) resources: &'a [(&'a str, &'a Resource)],
    pub(super) params: Params,
}

impl Job<'_> {
    /// Runs so many workgroups of `pass`, up to `limit` of them in a dispatch, in dispatches of about the time that one should take. Returns the counts
    /// and the time spent in dispatches.
    pub(super) fn run(&self, pass: &mut Pass, groups: u32, limit: u32) -> Result<(BatchStats, Counts, Duration)> {
        let limit = pass.limit.min(limit).max(1);
        let is_cpu = self.gpu.info.is_cpu();
        let time_of_one = if is_cpu { DISPATCH_TIME_CPU } else { DISPATCH_TIME };
        let bindings = pass.kernels.iter().map(|k| k.bind(self.gpu, self.resources)).collect::<Result<Vec<_>>>()?;
        let (mut stats, mut counts, mut time) = (BatchStats::default(), Counts::default(), Duration::ZERO);
        let mut first = 0;
        while first < groups {
            self.halt.check()?;
            let asked = pass.groups.min(limit);
            let now = asked.min(groups - first);
            self.gpu.write(
                self.uniforms,
                &[Params { first_group: first, group_step: if is_cpu { step(now) } else { 1 }, ..self.params }],
            );
            let (counters, counted) = self.counters;
            self.gpu.write(counters, &[0u32; COUNTERS]);
            let start = Instant::now();
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            for (i, (kernel, bindings)) in pass.kernels.iter().zip(&bindings).enumerate() {
                kernel.dispatch_timed(&mut encoder, bindings, now, self.timer.map(|timer| (timer, i as u32)));
            }
            let kernels = pass.kernels.len() as u32;
            self.timer.iter().for_each(|timer| timer.resolve(&mut encoder, kernels));
            counted.copy(&mut encoder, counters, BYTES_OF_COUNTERS);
            self.gpu.queue.submit([encoder.finish()]);
            counted.map(BYTES_OF_COUNTERS);
            self.gpu.wait()?;
            let elapsed = start.elapsed();
            time += elapsed;
            first += now;
            pass.groups = next_groups(asked, now, elapsed, time_of_one);
            if let Some(timer) = self.timer {
                for (i, time) in timer.times(self.gpu, kernels)?.into_iter().enumerate() {
                    stats.kernel_times[pass.first_time + i] += time;
                }
            }
            let counts_of_it = counted.mapped(self.gpu, BYTES_OF_COUNTERS)?;
            let at = |i: u32| u64::from(bytemuck::cast_slice::<u8, u32>(&counts_of_it)[i as usize]);
            stats += BatchStats {
                rays: at(COUNTER_RAYS),
                dropped_not_finite: at(COUNTER_NOT_FINITE),
                dropped_negative: at(COUNTER_NEGATIVE),
                dropped_saturated: at(COUNTER_SATURATED),
                dropped_crowded: at(COUNTER_CROWDED),
                truncated: at(COUNTER_TRUNCATED),
                unfinished: at(COUNTER_UNFINISHED),
                most_rays: at(COUNTER_MOST_RAYS),
                longest_dispatch: elapsed,
                ..Default::default()
            };
            let ended = std::array::from_fn(|depth| at(COUNTER_ENDED + depth as u32));
            counts += Counts { nodes: at(COUNTER_NODES), primitives: at(COUNTER_PRIMITIVES), ended };
        }
        Ok((stats, counts, time))
    }
}

/// A number near the golden section of `groups` that has no factor in common with it: steps of so many go through all of them, and a few in a row are
/// well spread (common/groups.wgsl).
fn step(groups: u32) -> u32 {
    let gcd = |mut a: u32, mut b: u32| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    ((0.618 * f64::from(groups)) as u32..).find(|&step| gcd(step, groups) == 1).unwrap_or(1)
}

/// Workgroups of the dispatch after one that was to have `groups`, had `now` and took `elapsed`, if it should take `time`.
fn next_groups(groups: u32, now: u32, elapsed: Duration, time: Duration) -> u32 {
    let ratio = time.as_secs_f64() / elapsed.as_secs_f64().max(1e-4);
    // What is left over at the end says little about a full dispatch.
    if now == groups || ratio < 1.0 { ((f64::from(now) * ratio.clamp(0.25, 2.0)) as u32).max(1) } else { groups }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of dispatches, s, over groups that take so long each.
    fn dispatches(costs: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut costs = costs.peekable();
        let (mut groups, mut times) = (FIRST_GROUPS, Vec::new());
        while costs.peek().is_some() {
            let taken: Vec<f64> = costs.by_ref().take(groups as usize).collect();
            times.push(taken.iter().sum());
            groups = next_groups(groups, taken.len() as u32, Duration::from_secs_f64(*times.last().unwrap()), DISPATCH_TIME);
        }
        times
    }

    #[test]
    fn steps_go_through_all_workgroups_and_spread_any_few_in_a_row() {
        for groups in 1..300u32 {
            let order: Vec<u32> = (0..groups).map(|i| i * step(groups) % groups).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..groups), "{groups} in steps of {}", step(groups));
            // Either half of the order has about half of any half of the picture.
            let low = order[..groups as usize / 2].iter().filter(|&&group| group < groups / 2).count();
            assert!(
                low.abs_diff(groups as usize / 4) <= 1 + groups as usize / 16,
                "{groups}: {low} in steps of {}",
                step(groups)
            );
        }
    }

    #[test]
    fn dispatches_stay_below_100_ms_however_long_a_workgroup_takes() {
        for cost in [1e-6, 1e-5, 1e-4, 1e-3, 4e-3] {
            let times = dispatches((0..(2.0 / cost) as u32).map(|_| cost));
            assert!(times.iter().all(|t| *t < 0.1), "{cost} s each: {:?}", times.iter().copied().fold(0.0, f64::max));
            // The first one takes 5 ms at most, or two workgroups, and each next one twice as long.
            assert!(times[0] <= (2.0 * cost).max(5e-3) && times.windows(2).all(|t| t[1] < 2.01 * t[0]), "{cost} s each");
            // And are not so short that starting them is what takes the time.
            let late = &times[times.len() / 2..times.len() - 1];
            assert!(late.iter().all(|t| *t > 0.03), "{cost} s each: {:?}", late.iter().copied().fold(1.0, f64::min));
        }
    }

    #[test]
    fn dispatches_recover_where_workgroups_suddenly_take_longer() {
        // From dark walls to a gem: 30 times as long from one group to the next.
        let times = dispatches((0..20_000).map(|i| if i < 10_000 { 1e-4 } else { 3e-3 }));
        let long = times.iter().filter(|t| **t > 0.1).count();
        assert!(long <= 3, "{long} dispatches took more than 100 ms");
        assert!(times.iter().rev().skip(1).take(100).all(|t| *t < 0.1 && *t > 0.03));
    }
}
