//! A few passes that the film never sees: they tell where light paths are of use, and how many are best.

use super::GpuIntegrator;
use super::budget::{Budget, Probe};
use super::gpu_integrator::Passes;
use super::params::View;
use super::tiles::even_rates;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::render::Batch;
use crate::state::{Persistent, State};
use crate::stats::BatchStats;
use std::io;
use std::ops::Range;

/// Probes: before the first batch that goes on beyond so many samples of a pixel, and samples of all pixels together. A short one, so that the first picture comes soon, and a
/// long one when it is known that it pays.
const PROBES: [(u64, f64); 2] = [(0, (1 << 16) as f64), (4, (1 << 19) as f64)];
/// In how many rounds; the picture has fewer pixels for it, if it has to.
const ROUNDS: (f64, f64) = (4.0, 12.0);
/// Probes have the last sequences of random numbers, each so many.
const NUMBERS: u32 = 16;

/// What the largest probe renders.
pub(super) fn probed(view: &View) -> View {
    extent(view, PROBES[1].1).0
}

/// What a probe of so many samples renders, and in how many rounds.
fn extent(view: &View, samples: f64) -> (View, u32) {
    let part = view.coarser(samples / ROUNDS.0);
    (part, (samples / part.pixels()).clamp(ROUNDS.0, ROUNDS.1) as u32)
}

pub(super) fn unexpected(e: io::Error) -> Error {
    Error::device(format!("the guide of light paths cannot be copied: {e}"), "report this")
}

impl GpuIntegrator {
    /// Learns where light paths are of use, and how many are best, from a few passes that the film never sees: what they find before that is mostly noise.
    pub(super) fn probe(&mut self, batch: Batch, film: &mut Film) -> Result<()> {
        let due = PROBES.iter().take_while(|(beyond, _)| batch.first_pass + u64::from(batch.spp) > *beyond).count();
        let extent_of = |probes: usize| extent(&self.view, PROBES[probes - 1].1);
        // Of a small picture the first one has told as much, or has done some rounds of the second.
        let done = match self.learned.probes {
            0 => 0,
            before if due > before && extent_of(before).0.pixels() == extent_of(due).0.pixels() => extent_of(before).1,
            _ => 0,
        };
        let is_due = due > self.learned.probes && done < extent_of(due).1;
        if is_due && self.learned.guide.is_some() {
            // There is one place for what comes back.
            self.land(film);
        }
        if is_due && let Some(guide) = &mut self.learned.guide {
            let mut before = Vec::new();
            guide.persist(&mut State::saving(&mut before)).map_err(unexpected)?;
            let view = self.view;
            let (part, rounds) = extent(&view, PROBES[due - 1].1);
            self.view = part;
            let probe = self.probe_rounds(done..rounds, u32::MAX - due as u32 * NUMBERS);
            self.view = view;
            let mut probe = match (probe, &mut self.learned.guide) {
                (Err(error), Some(guide)) => {
                    // The state changes as a whole or not at all.
                    guide.persist(&mut State::restoring(&mut before.as_slice())).map_err(unexpected)?;
                    return Err(error);
                }
                (probe, _) => probe?,
            };
            // Light paths are traced for every tile.
            probe.light_rays *= self.tile_count() as f64;
            // One that was told stays.
            if self.budget().is_none_or(|budget| budget.probe.is_some()) {
                self.set_budget(Budget::from_probe(probe, self.plan.has(super::Feature::Merging)));
            }
        }
        self.learned.probes = due;
        Ok(())
    }

    fn probe_rounds(&mut self, rounds: Range<u32>, first_sequence: u32) -> Result<Probe> {
        let (mut last, mut room): (Vec<f32>, Vec<f32>) = Default::default();
        let mut sum = Probe { camera_variance: 0.0, light_variance: 0.0, camera_rays: 0.0, light_rays: 0.0 };
        let View { params, bounds } = self.view;
        let size = (params.image_width, params.image_height);
        let mut measured = 0.0;
        for round in rounds.clone() {
            let mut picture = vec![0.0; bounds.pixels()];
            let (mut squares, mut stats) = (0.0, BatchStats::default());
            for tile in self.tiles() {
                let passes = Passes { sequence: first_sequence + round, first_sample: 0, number: u64::from(round), count: 1 };
                let traced = self.trace(tile, passes, &even_rates(tile))?;
                let sums = self.bring_back(tile, passes, traced.earlier)?;
                let (values, by_camera, _) = sums.all(&mut room);
                if let Some(guide) = &mut self.learned.guide {
                    guide.brightness.see(size, tile, &values, sums.spp);
                }
                for (pixel, [radiance, _]) in tile.within(bounds).numbers(bounds.width).zip(&by_camera) {
                    picture[pixel] = *radiance;
                }
                squares += self.learned.guide.as_ref().map_or(0.0, |g| g.squares);
                stats += traced.stats;
            }
            // The tree is of some use from the second half on. A variance takes two pictures.
            if 2 * round >= rounds.end
                && !last.is_empty()
                && let Some(guide) = &self.learned.guide
            {
                measured += 1.0;
                sum.camera_variance += guide.relative_variance(size, bounds, &picture, &last);
                sum.light_variance += squares;
                sum.camera_rays += stats.camera_rays as f64 / self.view.pixels();
                sum.light_rays += (stats.rays - stats.camera_rays) as f64 / f64::from(params.light_paths);
            }
            last = picture;
        }
        let n = f64::max(measured, 1.0);
        Ok(Probe {
            camera_variance: sum.camera_variance / n,
            light_variance: sum.light_variance / n,
            camera_rays: sum.camera_rays / n,
            light_rays: sum.light_rays / n,
        })
    }
}
