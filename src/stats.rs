//! What batches of samples came to.

use crate::gpu::layout::COUNTED_DEPTHS;
use crate::state::{Persistent, State, invalid};
use std::io;
use std::time::Duration;

/// Counts over one or more batches.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BatchStats {
    /// Sensor samples (or emitted light paths, for a forward estimator).
    pub paths: u64,
    /// Light paths beside them.
    pub light_paths: u64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Samples dropped because a value was NaN or infinite.
    pub dropped_not_finite: u64,
    /// Samples dropped because a value was negative.
    pub dropped_negative: u64,
    /// Samples and splats dropped, or sums cut, because they are too large for the film.
    pub dropped_saturated: u64,
    /// Paths and shadow rays that ended on the GPU where more than eight different volumes overlap, or 65,535 bodies of one.
    pub dropped_crowded: u64,
    /// Of `paths` and `light_paths`, those cut at the greatest depth.
    pub truncated: u64,
    /// Samples lost because a driver ended the shader's loops: software drivers bound their turns.
    pub unfinished: u64,
    /// Most rays of one invocation on the GPU.
    pub most_rays: u64,
    /// Of `rays`, those of the GPU's camera pass.
    pub camera_rays: u64,
    /// Time that the GPU's camera pass took, from each submission to its completion.
    pub camera_time: Duration,
    /// Likewise, its light pass.
    pub light_time: Duration,
    /// Time by the adapter's own clock, of each of [`BatchStats::KERNELS`]; 0 unless asked for.
    pub kernel_times: [Duration; 3],
    /// The longest dispatch of either: drivers end those that take too long.
    pub longest_dispatch: Duration,
    /// What the GPU's camera pass did, where it was asked to count.
    pub camera_counts: Counts,
    /// Likewise, its light pass.
    pub light_counts: Counts,
}

/// What a pass of the GPU did; all 0 but where the plan has it counted ([`crate::integrator::Plan::counted`]).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// BVH nodes tested.
    pub nodes: u64,
    /// Primitives tested.
    pub primitives: u64,
    /// Paths that ended after 0, 1, 2, ... scattering events; the last counts all longer ones, too.
    pub ended: [u64; COUNTED_DEPTHS as usize],
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, b: Self) {
        self.nodes += b.nodes;
        self.primitives += b.primitives;
        self.ended.iter_mut().zip(b.ended).for_each(|(a, b)| *a += b);
    }
}

/// A thousand years, s: no render took longer.
const LONGEST: u64 = 31_557_600_000;

/// A duration, to the nanosecond.
pub(crate) fn persist_time(time: &mut Duration, state: &mut State<'_>) -> io::Result<()> {
    let (mut seconds, mut nanoseconds) = (time.as_secs(), time.subsec_nanos());
    state.value(&mut seconds)?;
    state.value(&mut nanoseconds)?;
    if seconds > LONGEST {
        return Err(invalid(format!("a time of {seconds} s")));
    }
    *time = Duration::from_secs(seconds).saturating_add(Duration::from_nanos(u64::from(nanoseconds)));
    Ok(())
}

impl Persistent for Counts {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Counts { nodes, primitives, ended } = self;
        state.value(nodes)?;
        state.value(primitives)?;
        state.slice(ended)
    }
}

impl Persistent for BatchStats {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let BatchStats {
            paths,
            light_paths,
            rays,
            dropped_not_finite,
            dropped_negative,
            dropped_saturated,
            dropped_crowded,
            truncated,
            unfinished,
            most_rays,
            camera_rays,
            camera_time,
            light_time,
            kernel_times,
            longest_dispatch,
            camera_counts,
            light_counts,
        } = self;
        let counts = [
            paths,
            light_paths,
            rays,
            dropped_not_finite,
            dropped_negative,
            dropped_saturated,
            dropped_crowded,
            truncated,
            unfinished,
            most_rays,
            camera_rays,
        ];
        for count in counts {
            state.value(count)?;
            if *count > u64::MAX >> 8 {
                return Err(invalid(format!("a count of {count}")));
            }
        }
        let times = [camera_time, light_time, longest_dispatch].into_iter().chain(kernel_times);
        times.into_iter().try_for_each(|time| persist_time(time, state))?;
        camera_counts.persist(state)?;
        light_counts.persist(state)
    }
}

impl BatchStats {
    /// The kernels of the GPU's passes: two of the camera's, one of the light's.
    pub const KERNELS: [&'static str; 3] = ["camera paths", "film", "light paths"];

    /// Whether more than one path in a million was lost in too many volumes.
    pub fn is_crowded(&self) -> bool {
        self.dropped_crowded.saturating_mul(1_000_000) > self.paths + self.light_paths
    }

    /// Samples and splats that are missing from the film, whatever the cause.
    pub fn dropped(&self) -> u64 {
        self.dropped_not_finite + self.dropped_negative + self.dropped_saturated + self.dropped_crowded + self.unfinished
    }
}

impl std::ops::AddAssign for BatchStats {
    fn add_assign(&mut self, b: Self) {
        self.paths += b.paths;
        self.light_paths += b.light_paths;
        self.rays += b.rays;
        self.dropped_not_finite += b.dropped_not_finite;
        self.dropped_negative += b.dropped_negative;
        self.dropped_saturated += b.dropped_saturated;
        self.dropped_crowded += b.dropped_crowded;
        self.truncated += b.truncated;
        self.unfinished += b.unfinished;
        self.most_rays = self.most_rays.max(b.most_rays);
        self.camera_rays += b.camera_rays;
        self.camera_time += b.camera_time;
        self.light_time += b.light_time;
        self.kernel_times.iter_mut().zip(b.kernel_times).for_each(|(a, b)| *a += b);
        self.longest_dispatch = self.longest_dispatch.max(b.longest_dispatch);
        self.camera_counts += b.camera_counts;
        self.light_counts += b.light_counts;
    }
}
