//! The forward estimator: paths from the lights, connected to the camera wherever they scatter, or counted where they cross the sensor.

use super::medium::Medium;
use super::rng::Rng;
use super::sensor::{connect, crossing, disperses, sample_view, splat};
use super::surface::Transport;
use super::walk::{Observer, Path, Vertex, WavelengthSample};
use super::{Stage, finite};
use crate::geometry::world::Ray;
use crate::scene::Sensor;
use crate::stats::BatchStats;
use glam::DVec3;
use std::f64::consts::PI;

/// Light that arrived at a pixel.
pub(super) struct Splat {
    pub pixel: usize,
    pub bin: usize,
    pub nm: f64,
    pub value: f64,
}

/// What one light path leaves on the film.
struct Arrived<'a> {
    stage: &'a Stage,
    splats: &'a mut Vec<Splat>,
    dropped: BatchStats,
}

impl Arrived<'_> {
    fn add(&mut self, pixel: usize, wavelength: &WavelengthSample, value: f64) {
        if finite(value, &mut self.dropped) && value > 0.0 {
            self.splats.push(Splat { pixel, bin: wavelength.bin, nm: wavelength.nm, value });
        }
    }

    /// Joins a point to the camera; `eval` is the density of flux that leaves it, per wavelength.
    fn join(
        &mut self,
        path: &Path,
        from: Ray,
        inside: &dyn Fn(DVec3) -> Vec<usize>,
        eval: &dyn Fn(DVec3, usize) -> f64,
        rng: &mut Rng,
    ) {
        let (stage, film) = (self.stage, &self.stage.scene.film);
        let nm: Vec<f64> = path.wavelengths.iter().map(|w| w.nm).collect();
        let Some(link) = connect(&stage.scene.sensor, film, from.origin, &nm, rng) else { return };
        let density: Vec<f64> = (0..path.wavelengths.len()).map(|i| eval(link.dir, i)).collect();
        let pixels_at = |&(at, weight): &([f64; 2], f64)| {
            let mut pixels = Vec::new();
            splat(film, at, |pixel, share| pixels.push((pixel, weight * share)));
            pixels
        };
        let pixels: Vec<Vec<(usize, f64)>> = link.landings.iter().map(pixels_at).collect();
        if pixels.iter().all(Vec::is_empty) || density.iter().all(|&g| g == 0.0) {
            return;
        }
        let ray = Ray { dir: link.dir, ..from };
        let share = stage.straight(ray, &inside(link.dir), &path.wavelengths, link.distance, &mut self.dropped);
        for (i, (wavelength, (g, share))) in path.wavelengths.iter().zip(density.iter().zip(share)).enumerate() {
            for &(pixel, weight) in &pixels[i.min(pixels.len() - 1)] {
                self.add(pixel, wavelength, wavelength.beta * g * share * weight);
            }
        }
    }
}

impl Observer for Arrived<'_> {
    fn flight(&mut self, path: &Path, medium: &Medium, t: f64) {
        let stage = self.stage;
        let Some((at, pixel, per_area)) = crossing(&stage.scene.sensor, &stage.scene.film, &path.ray) else { return };
        if at <= t {
            for (wavelength, weight) in path.wavelengths.iter().zip(medium.weight_past(at)) {
                self.add(pixel, wavelength, wavelength.beta * weight * per_area);
            }
        }
    }

    fn vertex(&mut self, path: &Path, vertex: &Vertex, rng: &mut Rng, _: &mut BatchStats) {
        let from = Ray { on: vertex.on.clone(), ..Ray::new(vertex.p, DVec3::Z) };
        self.join(path, from, &|wi| vertex.inside_towards(wi).to_vec(), &|wi, wavelength| vertex.eval(wi, wavelength), rng);
    }
}

impl Stage {
    /// Follows light path number `index` of `batch`; appends what it leaves, in units of the sum over all paths.
    pub(super) fn render_light_path(&self, batch: u32, index: u64, splats: &mut Vec<Splat>) -> BatchStats {
        let mut stats = BatchStats { paths: 1, ..BatchStats::default() };
        let mut rng = Rng::new(self.seed, batch, index);
        let nm = self.wavelengths(&mut rng);
        let mut arrived = Arrived { stage: self, splats, dropped: BatchStats::default() };
        self.see_environment((index % self.pixels() as u64) as usize, &nm, &mut arrived, &mut rng);
        if let Some(light) = self.emit(&nm, &mut rng) {
            if let Some(n) = light.normal {
                let path = &light.path;
                let eval = |wi: DVec3, _| wi.dot(n).max(0.0) / PI;
                arrived.join(path, path.ray.clone(), &|_| path.inside.clone(), &eval, &mut rng);
            }
            self.walk(light.path, Transport::Flux, &mut rng, &mut arrived, &mut stats);
            // However many wavelengths of it were cut.
            stats.truncated = stats.truncated.min(1);
        }
        stats += arrived.dropped;
        stats
    }

    /// Light from infinity that a camera sees directly arrives from no point that could be connected to it: one straight look per path instead.
    fn see_environment(&self, pixel: usize, nm: &[f64], arrived: &mut Arrived, rng: &mut Rng) {
        if !self.has_environment || !matches!(self.scene.sensor, Sensor::Perspective { .. } | Sensor::Orthographic { .. }) {
            return;
        }
        let all: Vec<WavelengthSample> =
            nm.iter().enumerate().map(|(bin, &nm)| WavelengthSample { bin, nm, beta: 1.0, etendue: 1.0 }).collect();
        // Through a lens each goes its own way.
        let together = if disperses(&self.scene.sensor) { 1 } else { all.len() };
        for looked_at in all.chunks(together) {
            let view = sample_view(&self.scene.sensor, &self.scene.film, pixel, looked_at[0].nm, rng);
            let Some(view) = view else { continue };
            let light = |w: &WavelengthSample| WavelengthSample { beta: self.environment(view.ray.dir, w.nm), ..*w };
            let wavelengths: Vec<WavelengthSample> = looked_at.iter().map(light).collect();
            let inside = self.interiors_at(view.ray.origin);
            let share = self.straight(view.ray, &inside, &wavelengths, f64::INFINITY, &mut arrived.dropped);
            for (wavelength, share) in wavelengths.iter().zip(share) {
                arrived.add(pixel, wavelength, wavelength.beta * share * view.weight * self.pixels() as f64);
            }
        }
    }
}
