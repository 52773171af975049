//! A few passes that the film never sees: they tell where light paths are of use, and how many are best.

use super::GpuIntegrator;
use super::budget::{Budget, Probe};
use super::gpu_integrator::{Passes, even_rates};
use super::params::coarser;
use crate::error::Result;
use crate::gpu::layout::Params;
use crate::stats::BatchStats;

/// Samples of all pixels together that a probe takes, and in how many rounds; the picture has fewer pixels for it, if it has to.
const SAMPLES: f64 = (1 << 19) as f64;
const ROUNDS: (f64, f64) = (4.0, 12.0);

/// What a probe renders of the picture.
pub(super) fn probed(picture: &Params) -> Params {
    coarser(picture, SAMPLES / ROUNDS.0)
}

impl GpuIntegrator {
    /// Learns where light paths are of use, and how many are best, from a few passes that the film never sees: what they find before that is mostly noise.
    pub(super) fn probe(&mut self) -> Result<()> {
        if self.learned.guide.is_none() {
            return Ok(());
        }
        let picture = self.params;
        self.params = probed(&picture);
        let probe = self.probe_rounds();
        self.params = picture;
        let mut probe = probe?;
        // Light paths are traced for every tile.
        probe.light_rays *= self.tile_count() as f64;
        if self.budget().is_none() {
            self.set_budget(Budget::from_probe(probe, self.plan.has(super::Feature::Merging)));
        }
        Ok(())
    }

    fn probe_rounds(&mut self) -> Result<Probe> {
        let rounds = (SAMPLES / self.pixels()).clamp(ROUNDS.0, ROUNDS.1) as u32;
        let mut last: Vec<f32> = Vec::new();
        let mut sum = Probe { camera_variance: 0.0, light_variance: 0.0, camera_rays: 0.0, light_rays: 0.0 };
        for round in 0..rounds {
            let mut picture = vec![0.0; self.pixels() as usize];
            let (mut squares, mut stats) = (0.0, BatchStats::default());
            for tile in self.tiles() {
                let passes = Passes { batch: u32::MAX - round, number: u64::from(round), count: 1 };
                let traced = self.trace(tile, passes, &even_rates(tile))?;
                for (i, [radiance, _]) in traced.by_camera.iter().enumerate() {
                    let (x, y) = (tile.x + i as u32 % tile.width, tile.y + i as u32 / tile.width);
                    picture[(y * self.params.image_width + x) as usize] = *radiance;
                }
                squares += self.learned.guide.as_ref().map_or(0.0, |g| g.squares);
                stats += traced.stats;
            }
            // The tree is of some use from the second half on.
            if 2 * round >= rounds
                && let Some(guide) = &self.learned.guide
            {
                sum.camera_variance += guide.relative_variance(self.params.image_width, &picture, &last);
                sum.light_variance += squares;
                sum.camera_rays += stats.camera_rays as f64 / self.pixels();
                sum.light_rays += (stats.rays - stats.camera_rays) as f64 / f64::from(self.params.light_paths);
            }
            last = picture;
        }
        let n = f64::from(rounds.div_ceil(2)).floor().max(1.0);
        Ok(Probe {
            camera_variance: sum.camera_variance / n,
            light_variance: sum.light_variance / n,
            camera_rays: sum.camera_rays / n,
            light_rays: sum.light_rays / n,
        })
    }
}
