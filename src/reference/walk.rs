//! A path through the scene, the same for both estimators: straight flights, scattering in fog and at surfaces, and where dispersion parts
//! the wavelengths, one path for each of them. What an estimator records on the way is its [`Observer`]'s business.

use super::Stage;
use super::bsdf::straight_share;
use super::interiors::{Crossing, cross, ruling};
use super::medium::Medium;
use super::rng::Rng;
use super::surface::{Surface, Transport};
use crate::bsdf::phase;
use crate::geometry::world::{Hit, Ray};
use crate::scene::inside::MAX_STRAIGHT;
use crate::stats::BatchStats;
use glam::DVec3;

/// Scattering events after which paths play Russian roulette.
const ROULETTE_AFTER: u32 = 8;

/// One wavelength of a path.
#[derive(Clone, Copy)]
pub(super) struct WavelengthSample {
    /// Film bin.
    pub bin: usize,
    /// Wavelength, nm.
    pub nm: f64,
    /// Throughput: of radiance backward, flux forward.
    pub beta: f64,
    /// What turns the throughput of radiance into that of flux, for roulette: `(n_here / n_sensor)^2`; 1 forward.
    pub etendue: f64,
}

impl WavelengthSample {
    pub(super) fn times(self, weight: f64) -> Self {
        Self { beta: self.beta * weight, ..self }
    }
}

/// Light under way.
#[derive(Clone)]
pub(super) struct Path {
    pub ray: Ray,
    pub wavelengths: Vec<WavelengthSample>,
    /// Interiors around the ray's origin.
    pub inside: Vec<usize>,
    /// Scattering events so far.
    pub depth: u32,
    /// Surfaces passed straight since the last of them.
    pub straight: u32,
    /// The greatest `beta` at the start, against which roulette is played.
    pub start: f64,
}

impl Path {
    pub(super) fn new(ray: Ray, wavelengths: Vec<WavelengthSample>, inside: Vec<usize>) -> Self {
        let start = wavelengths.iter().map(|l| l.beta).fold(0.0, f64::max);
        Self { ray, wavelengths, inside, depth: 0, straight: 0, start }
    }

    fn weigh(&mut self, weights: &[f64]) {
        self.wavelengths.iter_mut().zip(weights).for_each(|(l, w)| l.beta *= w);
    }

    /// Kills the path or strengthens it, so that its flux stays below what it started with.
    fn survives(&mut self, rng: &mut Rng) -> bool {
        if self.depth < ROULETTE_AFTER {
            return true;
        }
        let strength = self.wavelengths.iter().map(|l| l.beta * l.etendue).fold(0.0, f64::max) / self.start;
        if strength < 1.0 {
            if rng.next() >= strength {
                return false;
            }
            self.wavelengths.iter_mut().for_each(|l| l.beta /= strength);
        }
        true
    }
}

/// Where a path scatters into many directions.
pub(super) struct Vertex<'a> {
    pub p: DVec3,
    /// Primitives that `p` lies on.
    pub on: Vec<u32>,
    pub scattering: Scattering<'a>,
    /// Interiors on the side the path came from, and on the other.
    pub inside: &'a [usize],
    pub beyond: &'a [usize],
}

pub(super) enum Scattering<'a> {
    Surface(&'a Surface<'a>),
    /// Direction of travel and asymmetry.
    Medium(DVec3, f64),
}

impl Vertex<'_> {
    /// Density of scattered flux per solid angle of `wi` for wavelength number `wavelength`.
    pub(super) fn eval(&self, wi: DVec3, wavelength: usize) -> f64 {
        match &self.scattering {
            Scattering::Surface(surface) => surface.eval(wi, wavelength),
            Scattering::Medium(dir, g) => phase::eval_hg(dir.dot(wi), *g),
        }
    }

    /// Interiors around a ray that leaves along `wi`.
    pub(super) fn inside_towards(&self, wi: DVec3) -> &[usize] {
        match &self.scattering {
            Scattering::Surface(surface) if surface.is_beyond(wi) => self.beyond,
            _ => self.inside,
        }
    }
}

/// What an estimator records along a path.
pub(super) trait Observer {
    /// The path flies `t` along its ray through `medium`; its wavelengths still weigh what they did at the origin.
    fn flight(&mut self, _path: &Path, _medium: &Medium, _t: f64) {}
    /// The path has arrived at `hits`.
    fn arrived(&mut self, _path: &Path, _hits: &[Hit]) {}
    /// The path has left the scene.
    fn escaped(&mut self, _path: &Path) {}
    /// The path is about to scatter.
    fn vertex(&mut self, _path: &Path, _vertex: &Vertex, _rng: &mut Rng, _stats: &mut BatchStats) {}
}

impl Stage {
    /// Follows a path to its end.
    pub(super) fn walk(
        &self,
        mut path: Path,
        transport: Transport,
        rng: &mut Rng,
        seen: &mut dyn Observer,
        stats: &mut BatchStats,
    ) {
        loop {
            // Not `> 0`: a NaN must go on, to be dropped and counted.
            path.wavelengths.retain(|l| l.beta != 0.0);
            if path.wavelengths.is_empty() || !path.survives(rng) {
                return;
            }
            stats.rays += 1;
            let hits = self.world.intersect(&path.ray);
            let t_hit = hits.first().map_or(f64::INFINITY, |h| h.t);
            let medium = Medium::new(&self.scene.interiors[ruling(&self.scene, &path.inside)], &path.wavelengths);
            let scattered = medium.sample_flight(t_hit, rng);
            seen.flight(&path, &medium, scattered.unwrap_or(t_hit));
            if let Some(t) = scattered {
                path.weigh(&medium.weight_scatter(t));
                if !self.may_scatter(&path, stats) {
                    return;
                }
                let (p, dir) = (path.ray.origin + path.ray.dir * t, path.ray.dir);
                let scattering = Scattering::Medium(dir, medium.g);
                seen.vertex(&path, &Vertex { p, on: vec![], scattering, inside: &path.inside, beyond: &[] }, rng, stats);
                path.ray = Ray::new(p, phase::sample_hg(dir, medium.g, rng.next2()));
                path.depth += 1;
                path.straight = 0;
                continue;
            }
            path.weigh(&medium.weight_past(t_hit));
            if hits.is_empty() {
                return seen.escaped(&path);
            }
            seen.arrived(&path, &hits);
            let on: Vec<u32> = hits.iter().map(|h| h.prim).collect();
            let (beyond, met) = self.meet(&mut path, &hits, rng);
            let Some((hit, bsdf, over)) = met else {
                path.straight += 1;
                if path.straight > MAX_STRAIGHT {
                    stats.truncated += 1;
                    return;
                }
                path.ray = Ray { origin: hits[0].p, dir: path.ray.dir, t_min: 0.0, on };
                path.inside = beyond;
                continue;
            };
            let surface = Surface::new(bsdf, over, &hit, -path.ray.dir, transport, rng);
            if !self.may_scatter(&path, stats) {
                return;
            }
            let vertex =
                Vertex { p: hit.p, on, scattering: Scattering::Surface(&surface), inside: &path.inside, beyond: &beyond };
            seen.vertex(&path, &vertex, rng, stats);
            let mut parts = surface.sample(&path.wavelengths, rng).into_iter().map(|o| {
                let inside = if o.transmitted { beyond.clone() } else { path.inside.clone() };
                let ray = Ray { origin: vertex.p, dir: o.wi, t_min: 0.0, on: vertex.on.clone() };
                Path { ray, wavelengths: o.wavelengths, inside, depth: path.depth + 1, straight: 0, start: path.start }
            });
            let mut parts: Vec<Path> = parts.by_ref().collect();
            let Some(last) = parts.pop() else { return };
            for part in parts {
                self.walk(part, transport, rng, seen, stats);
            }
            path = last;
        }
    }

    fn may_scatter(&self, path: &Path, stats: &mut BatchStats) -> bool {
        let may = path.depth < self.scene.max_depth;
        stats.truncated += u64::from(!may);
        may
    }

    /// Share of light per wavelength that goes straight from the ray's origin to `distance`: through media, and through surfaces that are
    /// not there or let a part pass undeflected. All 0 if something is in the way.
    pub(super) fn straight(
        &self,
        mut ray: Ray,
        inside: &[usize],
        wavelengths: &[WavelengthSample],
        mut distance: f64,
        stats: &mut BatchStats,
    ) -> Vec<f64> {
        let mut share = vec![1.0; wavelengths.len()];
        let mut inside = inside.to_vec();
        for _ in 0..=MAX_STRAIGHT {
            stats.rays += 1;
            let hits = self.world.intersect(&ray);
            let t = hits.first().map_or(f64::INFINITY, |h| h.t).min(distance);
            let medium = Medium::new(&self.scene.interiors[ruling(&self.scene, &inside)], wavelengths);
            share.iter_mut().zip(medium.transmittance(t)).for_each(|(s, m)| *s *= m);
            if t >= distance {
                return share;
            }
            let met: Vec<(&Hit, usize)> =
                hits.iter().map(|h| (h, self.scene.bounding_part(self.scene.shapes[h.shape].material))).collect();
            let (beyond, crossing) = cross(&self.scene, &inside, ray.dir, &met);
            if let Crossing::Interface { .. } = crossing {
                break;
            }
            for (hit, _) in &met {
                let cos = ray.dir.dot(hit.ns).abs();
                share.iter_mut().zip(wavelengths).for_each(|(s, l)| {
                    *s *= straight_share(&self.scene, self.scene.shapes[hit.shape].material, cos, hit.uv, l.nm)
                });
            }
            if share.iter().all(|&s| s == 0.0) {
                break;
            }
            inside = beyond;
            distance -= t;
            ray = Ray { origin: hits[0].p, dir: ray.dir, t_min: 0.0, on: hits.iter().map(|h| h.prim).collect() };
        }
        vec![0.0; wavelengths.len()]
    }
}
