//! The backward estimator: paths from the sensor that count what light they happen to meet.

use super::rng::Rng;
use super::sensor::{disperses, sample_view};
use super::surface::Transport;
use super::walk::{Observer, Path, WavelengthSample};
use super::{Stage, finite};
use crate::geometry::world::Hit;
use crate::stats::BatchStats;

/// Light met by one path.
struct Met<'a> {
    stage: &'a Stage,
    /// Per bin.
    radiance: Vec<f64>,
}

impl Observer for Met<'_> {
    fn arrived(&mut self, path: &Path, hits: &[Hit]) {
        for hit in hits {
            let Some(emission) = &self.stage.scene.shapes[hit.shape].emission else { continue };
            if emission.two_sided || path.ray.dir.dot(hit.ng) < 0.0 {
                for wavelength in &path.wavelengths {
                    self.radiance[wavelength.bin] += wavelength.beta * emission.radiance.eval(wavelength.nm, hit.uv);
                }
            }
        }
    }

    fn escaped(&mut self, path: &Path) {
        for wavelength in &path.wavelengths {
            self.radiance[wavelength.bin] += wavelength.beta * self.stage.environment(path.ray.dir, wavelength.nm);
        }
    }
}

impl Stage {
    /// Adds `spp` samples of one pixel to its `sums` (bins, then XYZ).
    pub(super) fn render_pixel(&self, batch: u32, pixel: usize, spp: u32, sums: &mut [f64]) -> BatchStats {
        let mut stats = BatchStats::default();
        for sample in (0..spp).take_while(|_| !self.halt.is_requested()) {
            let mut rng = Rng::new(self.seed, batch, pixel as u64 * u64::from(spp) + u64::from(sample));
            let nm = self.wavelengths(&mut rng);
            stats.paths += 1;
            let all: Vec<WavelengthSample> =
                nm.iter().enumerate().map(|(bin, &nm)| WavelengthSample { bin, nm, beta: 1.0, etendue: 1.0 }).collect();
            // Through a lens each goes its own way.
            let together = if disperses(&self.scene.sensor) { 1 } else { all.len() };
            let mut walked = BatchStats::default();
            for wavelengths in all.chunks(together) {
                self.look(pixel, wavelengths.to_vec(), &nm, sums, &mut rng, &mut walked);
            }
            // However many wavelengths of it were cut.
            stats += BatchStats { truncated: walked.truncated.min(1), ..walked };
        }
        stats
    }

    /// Follows a path of some wavelengths, out of those of the film.
    fn look(
        &self,
        pixel: usize,
        wavelengths: Vec<WavelengthSample>,
        nm: &[f64],
        sums: &mut [f64],
        rng: &mut Rng,
        stats: &mut BatchStats,
    ) {
        let Some(view) = sample_view(&self.scene.sensor, &self.scene.film, pixel, wavelengths[0].nm, rng) else { return };
        let inside = self.interiors_at(view.ray.origin);
        let mut met = Met { stage: self, radiance: vec![0.0; nm.len()] };
        self.walk(Path::new(view.ray, wavelengths, inside), Transport::Radiance, rng, &mut met, stats);
        let negative = met.radiance.iter().copied().find(|l| *l < 0.0);
        if finite(negative.unwrap_or(met.radiance.iter().sum()), stats) {
            for (bin, l) in met.radiance.iter().enumerate() {
                self.record(sums, bin, nm[bin], l * view.weight);
            }
        }
    }
}
