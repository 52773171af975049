//! Quick looks that the film never sees: coarse, with few light paths and without a probe.

use super::GpuIntegrator;
use super::gpu_integrator::Passes;
use super::merge;
use super::params::{coarser, params};
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

impl GpuIntegrator {
    /// A look at the scene by the sensor of `scene`, which is else what this integrator renders: a film of at most about so many `pixels` and `passes`
    /// samples of each, with other random numbers for every `number`. Light paths go where `guide` sends them, which learns from it: the state of one,
    /// from [`GpuIntegrator::guide`], or nothing yet.
    ///
    /// All batches must be settled. What they have left behind stays as it is: a render goes on after it with the same bits. One that was interrupted in a
    /// batch can be looked at all the same, but not gone on with.
    ///
    /// # Errors
    /// As [`crate::render::Integrator::render_batch`].
    pub fn preview(&mut self, scene: &Scene, pixels: f64, passes: u32, number: u32, guide: &mut Vec<u8>) -> Result<Film> {
        let faults = self.gpu.faults.clone();
        faults.guard(|| self.look(scene, pixels, passes, number, guide))
    }

    fn look(&mut self, scene: &Scene, pixels: f64, passes: u32, number: u32, guide: &mut Vec<u8>) -> Result<Film> {
        // What an interrupted batch has left there.
        self.gpu.clear(&self.film.0);
        self.splats.iter().for_each(|(splats, _)| self.gpu.clear(splats));
        let (picture, fitting, own) = (self.params, self.learned.fitting, self.guide()?);
        let collapse_wavelengths = self.collapse_wavelengths;
        let uploaded = (picture.spectra_stride, picture.heads, picture.points);
        let seen = params(scene, bounds_of_all(&scene.shapes), &self.scene, merge::reach(scene), uploaded.0)?;
        let coarse = coarser(&Params { heads: uploaded.1, points: uploaded.2, ..seen }, pixels);
        let light_paths = ((f64::from(coarse.light_paths) * LIGHT_PATHS).round() as u32).max(1);
        if !guide.is_empty() {
            self.set_guide(guide)?;
        }
        self.params = Params { light_paths, ..coarse };
        // Of one wavelength alone glass would have its colour. Fewer photons meet points of theirs, but no less is expected of them.
        self.collapse_wavelengths = 4;
        let looked = self.passes_of_preview(scene, passes, u32::MAX - (NUMBERS << 1) + number % NUMBERS, number);
        *guide = self.guide()?;
        (self.params, self.learned.fitting, self.collapse_wavelengths) = (picture, fitting, collapse_wavelengths);
        self.set_guide(&own)?;
        looked
    }

    fn passes_of_preview(&mut self, scene: &Scene, passes: u32, batch: u32, number: u32) -> Result<Film> {
        let (width, height) = (self.params.image_width, self.params.image_height);
        let mut film = Film::new(&FilmSettings { width, height, ..scene.film.clone() });
        let mut room = Vec::new();
        for tile in self.tiles() {
            let passes = Passes { batch, number: u64::from(number) * u64::from(passes), count: passes };
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
