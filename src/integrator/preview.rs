//! Quick looks that the film never sees: coarse, with few light paths and without a probe.

use super::GpuIntegrator;
use super::gpu_integrator::Passes;
use super::merge;
use super::params::{View, params};
use super::probe::unexpected;
use super::tiles::even_rates;
use crate::error::Result;
use crate::film::Film;
use crate::gpu::layout::Params;
use crate::scene::{FilmSettings, Scene, bounds_of_all};
use crate::state::{Persistent, State};

/// Light paths of a preview for each of its pixels.
const LIGHT_PATHS: f64 = 0.5;
/// Numbers of batches that previews take turns with, below those of probes.
const NUMBERS: u32 = 1 << 12;

/// What a look is to be.
#[derive(Debug, Clone, Copy)]
pub struct Preview {
    /// Pixels, at most about.
    pub pixels: f64,
    /// Samples of each.
    pub passes: u32,
    /// Keys its random numbers.
    pub number: u32,
    /// Whether there are light paths. Their kernel takes as long to compile as that of camera paths: without them something is seen sooner.
    pub has_light_paths: bool,
}

impl GpuIntegrator {
    /// A look at the scene by the sensor of `scene`, which is else what this integrator renders. Light paths go where `guide` sends them, which learns from
    /// it: the state of one, from [`GpuIntegrator::guide`], or nothing yet.
    ///
    /// All batches must be settled. What they have left behind stays as it is: a render goes on after it with the same bits. One that was interrupted in a
    /// batch can be looked at all the same, but not gone on with.
    ///
    /// # Errors
    /// As [`crate::render::Integrator::render_batch`].
    pub fn preview(&mut self, scene: &Scene, preview: Preview, guide: &mut Vec<u8>) -> Result<Film> {
        let (view, fitting, own) = (self.view, self.learned.fitting, self.guide()?);
        let light = if preview.has_light_paths { None } else { self.light.take() };
        let faults = self.gpu.faults.clone();
        let looked = faults.guard(|| self.look(scene, preview, guide));
        self.light = light.or(self.light.take());
        (self.view, self.learned.fitting) = (view, fitting);
        self.set_guide(&own)?;
        looked
    }

    fn look(&mut self, scene: &Scene, preview: Preview, guide: &mut Vec<u8>) -> Result<Film> {
        // What an interrupted batch has left there.
        let left = [&self.film.0].into_iter().chain(self.splats.iter().map(|(splats, _)| splats));
        left.chain(self.learned.guide.iter().map(|g| &g.guiding_samples)).for_each(|buffer| self.gpu.clear(buffer));
        let picture = self.view.params;
        let uploaded = (picture.spectra_stride, picture.heads, picture.points);
        let seen =
            params(scene, bounds_of_all(&scene.shapes), &self.scene, merge::reach(scene, &self.scene.targets), uploaded.0)?;
        let params = Params { heads: uploaded.1, points: uploaded.2, ..seen };
        let coarse = View { params, bounds: scene.film.pixel_bounds() }.coarser(preview.pixels);
        let light_paths = ((f64::from(coarse.params.light_paths) * LIGHT_PATHS).round() as u32).max(1);
        if !guide.is_empty() {
            self.set_guide(guide)?;
        }
        self.view = View { params: Params { light_paths, ..coarse.params }, ..coarse };
        let film = self.passes_of_preview(scene, preview)?;
        if preview.has_light_paths {
            *guide = self.guide()?;
        }
        Ok(film)
    }

    fn passes_of_preview(&mut self, scene: &Scene, preview: Preview) -> Result<Film> {
        let Preview { passes, number, .. } = preview;
        let sequence = u32::MAX - (NUMBERS << 1) + number % NUMBERS;
        let View { params: Params { image_width: width, image_height: height, .. }, bounds } = self.view;
        let crop = scene.film.crop.map(|_| bounds);
        let mut film = Film::new(&FilmSettings { width, height, crop, ..scene.film.clone() });
        let mut room = Vec::new();
        for tile in self.tiles() {
            let passes = Passes { sequence, first_sample: 0, number: u64::from(number) * u64::from(passes), count: passes };
            let traced = self.trace(tile, passes, &even_rates(tile))?;
            let sums = self.bring_back(tile, passes, traced.earlier)?;
            let values = sums.all(&mut room).0;
            if let Some(guide) = &mut self.learned.guide {
                guide.brightness.see((width, height), tile, &values, sums.spp);
            }
            film.add_batch(tile, &values, passes.count);
        }
        Ok(film)
    }

    /// The state of the guide of light paths; nothing where there is none.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if it cannot be copied, which is a defect.
    pub fn guide(&mut self) -> Result<Vec<u8>> {
        let mut state = Vec::new();
        self.learned.guide.iter_mut().try_for_each(|g| g.persist(&mut State::saving(&mut state))).map_err(unexpected)?;
        Ok(state)
    }

    fn set_guide(&mut self, state: &[u8]) -> Result<()> {
        let restore = |guide: &mut super::guide::Guide| guide.persist(&mut State::restoring(&mut &*state));
        self.learned.guide.iter_mut().try_for_each(restore).map_err(unexpected)
    }
}
