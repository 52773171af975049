//! What batches leave behind in the integrator: all of it, so that a render can be gone on with bit by bit.

use super::adaptive::Adaptive;
use super::brightness::Brightness;
use super::budget::{Budget, Probe};
use super::guide::Guide;
use crate::state::{Persistent, State, invalid};
use crate::stats::BatchStats;
use std::io;

/// Tiles are halved so often at most, for want of memory.
pub const MOST_HALVINGS: u32 = 6;

/// The state between two tiles.
#[derive(Debug)]
pub(super) struct Learned {
    pub guide: Option<Guide>,
    /// What the guide has yet to take in of the picture, which it does after the next tile: the adapter need not wait until this one is summed up.
    pub seen: Option<Brightness>,
    pub adaptive: Option<Adaptive>,
    pub budget: Option<Budget>,
    /// How often the tiles were halved, for want of memory.
    pub halvings: u32,
    /// Probes done.
    pub probes: usize,
    /// Most samples that an invocation takes, of one pixel or several.
    pub most_samples: u32,
    /// How many may be, by what is known from this batch.
    pub fitting: u32,
    /// Tiles of the batch under way that are in the film or on their way there, and what was counted in them.
    pub tiles_done: usize,
    pub stats: BatchStats,
}

impl Learned {
    /// Before the first batch.
    pub fn new(guide: Option<Guide>, adaptive: Option<Adaptive>, most_samples: u32, halvings: u32) -> Self {
        let (budget, probes, fitting, tiles_done, stats) = (None, 0, u32::MAX, 0, BatchStats::default());
        let seen = guide.is_some().then(Brightness::new);
        Learned { guide, seen, adaptive, budget, halvings, probes, most_samples, fitting, tiles_done, stats }
    }

    /// All tiles of a batch are done; what was counted.
    pub fn finish_batch(&mut self, (least, most): (u32, u32)) -> BatchStats {
        self.most_samples = std::mem::replace(&mut self.fitting, u32::MAX).clamp(least, most.max(least));
        self.tiles_done = 0;
        self.adaptive.iter_mut().for_each(Adaptive::finish_batch);
        std::mem::take(&mut self.stats)
    }
}

impl Persistent for Learned {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Learned { guide, seen, adaptive, budget, halvings, probes, most_samples, fitting, tiles_done, stats } = self;
        part(guide, state, "a guide")?;
        part(seen, state, "brightness")?;
        part(adaptive, state, "rates of samples")?;
        let mut has_budget = budget.is_some();
        state.flag(&mut has_budget)?;
        if has_budget {
            budget.get_or_insert(Budget { light_paths: 1.0, probe: None }).persist(state)?;
        }
        state.value(halvings)?;
        if *halvings > MOST_HALVINGS {
            return Err(invalid(format!("{halvings} halvings of tiles")));
        }
        state.size(probes)?;
        state.value(most_samples)?;
        state.value(fitting)?;
        state.size(tiles_done)?;
        stats.persist(state)
    }
}

/// A part that the plan decides on.
fn part<T: Persistent>(part: &mut Option<T>, state: &mut State<'_>, what: &str) -> io::Result<()> {
    let mut is_there = part.is_some();
    state.flag(&mut is_there)?;
    match part {
        Some(part) if is_there => part.persist(state),
        None if !is_there => Ok(()),
        _ => Err(invalid(format!("it has {what}, or this render has, but not both"))),
    }
}

impl Persistent for Budget {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Budget { light_paths, probe } = self;
        state.value(light_paths)?;
        let mut is_probed = probe.is_some();
        state.flag(&mut is_probed)?;
        if is_probed {
            let none = Probe { camera_variance: 0.0, light_variance: 0.0, camera_rays: 0.0, light_rays: 0.0 };
            let Probe { camera_variance, light_variance, camera_rays, light_rays } = probe.get_or_insert(none);
            [camera_variance, light_variance, camera_rays, light_rays].into_iter().try_for_each(|v| state.value(v))?;
        }
        Ok(())
    }
}
