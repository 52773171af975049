//! A pass in dispatches that are short enough for any driver.

use crate::error::Result;
use crate::gpu::layout::{
    COUNTER_ENDED, COUNTER_NEGATIVE, COUNTER_NODES, COUNTER_NOT_FINITE, COUNTER_PRIMITIVES, COUNTER_RAYS, COUNTER_SATURATED,
    COUNTER_TRUNCATED, COUNTER_UNFINISHED, COUNTERS, Params,
};
use crate::gpu::{Gpu, Kernel, Resource};
use crate::render::{BatchStats, Counts};
use std::time::{Duration, Instant};

/// How long a dispatch should take: well below the watchdogs of desktop drivers.
const DISPATCH_TIME: Duration = Duration::from_millis(50);

/// Kernels that run one after the other on the same workgroups.
#[derive(Debug)]
pub(super) struct Pass {
    pub(super) kernels: Vec<Kernel>,
    /// Most workgroups of a dispatch.
    pub(super) limit: u32,
    /// Workgroups of the next dispatch: adapted so that it takes [`DISPATCH_TIME`].
    pub(super) groups: u32,
}

/// What the dispatches of a pass over one tile share.
pub(super) struct Job<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) uniforms: &'a Resource,
    pub(super) counters: &'a Resource,
    pub(super) resources: &'a [(&'a str, &'a Resource)],
    pub(super) params: Params,
}

impl Job<'_> {
    /// Runs `groups` workgroups of `pass`, in dispatches of about [`DISPATCH_TIME`]. Returns the counts and the time spent in dispatches.
    pub(super) fn run(&self, pass: &mut Pass, groups: u32) -> Result<(BatchStats, Counts, Duration)> {
        let bindings = pass.kernels.iter().map(|k| k.bind(self.gpu, self.resources)).collect::<Result<Vec<_>>>()?;
        let (mut stats, mut counts, mut time) = (BatchStats::default(), Counts::default(), Duration::ZERO);
        let mut first = 0;
        while first < groups {
            let now = pass.groups.min(groups - first);
            self.gpu.write(self.uniforms, &[Params { first_block: first, ..self.params }]);
            self.gpu.write(self.counters, &[0u32; COUNTERS]);
            let start = Instant::now();
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            for (kernel, bindings) in pass.kernels.iter().zip(&bindings) {
                kernel.dispatch(&mut encoder, bindings, now);
            }
            self.gpu.queue.submit([encoder.finish()]);
            self.gpu.wait()?;
            let elapsed = start.elapsed();
            time += elapsed;
            let ratio = DISPATCH_TIME.as_secs_f64() / elapsed.as_secs_f64().max(1e-4);
            first += now;
            // What is left over at the end says little about a full dispatch.
            if now == pass.groups || ratio < 1.0 {
                pass.groups = ((f64::from(now) * ratio.clamp(0.25, 2.0)) as u32).clamp(1, pass.limit);
            }
            let c: Vec<u32> = self.gpu.read(self.counters, (COUNTERS * 4) as u64)?;
            let at = |i: u32| u64::from(c[i as usize]);
            stats += BatchStats {
                rays: at(COUNTER_RAYS),
                dropped_not_finite: at(COUNTER_NOT_FINITE),
                dropped_negative: at(COUNTER_NEGATIVE),
                dropped_saturated: at(COUNTER_SATURATED),
                truncated: at(COUNTER_TRUNCATED),
                unfinished: at(COUNTER_UNFINISHED),
                ..Default::default()
            };
            let ended = std::array::from_fn(|depth| at(COUNTER_ENDED + depth as u32));
            counts += Counts { nodes: at(COUNTER_NODES), primitives: at(COUNTER_PRIMITIVES), ended };
        }
        Ok((stats, counts, time))
    }
}
