//! A path through the scene, the same for both estimators: straight flights, scattering in fog and at surfaces, and where dispersion parts
//! the wavelengths, one path for each of them. What an estimator records on the way is its [`Observer`]'s business.

use super::Stage;
use super::interiors::{Crossing, bare, cross, ruling};
use super::material::{Bsdf, Over, Surface, Transport, straight_share};
use super::medium::Medium;
use super::rng::Rng;
use crate::bsdf::coat::Coat;
use crate::bsdf::fresnel::Metal;
use crate::bsdf::phase;
use crate::bsdf::sheen::Sheen;
use crate::geometry::world::{Hit, Ray};
use crate::scene::inside::MAX_STRAIGHT;
use crate::scene::roughness::level_at;
use crate::scene::{Film, Geometry, Grain, Material, direction_of_grain};
use crate::spectrum::{Ior, Spectrum};
use crate::stats::BatchStats;
use glam::{DVec3, DVec4};

/// Scattering events after which paths play Russian roulette.
const ROULETTE_AFTER: u32 = 8;

/// One wavelength of a path.
#[derive(Clone, Copy)]
pub(super) struct Lane {
    /// Film bin.
    pub bin: usize,
    /// Wavelength, nm.
    pub nm: f64,
    /// Throughput: of radiance backward, flux forward.
    pub beta: f64,
    /// What turns the throughput of radiance into that of flux, for roulette: `(n_here / n_sensor)^2`; 1 forward.
    pub etendue: f64,
}

impl Lane {
    pub(super) fn times(self, weight: f64) -> Self {
        Self { beta: self.beta * weight, ..self }
    }
}

/// Light under way.
#[derive(Clone)]
pub(super) struct Path {
    pub ray: Ray,
    pub lanes: Vec<Lane>,
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
    pub(super) fn new(ray: Ray, lanes: Vec<Lane>, inside: Vec<usize>) -> Self {
        let start = lanes.iter().map(|l| l.beta).fold(0.0, f64::max);
        Self { ray, lanes, inside, depth: 0, straight: 0, start }
    }

    fn weigh(&mut self, weights: &[f64]) {
        self.lanes.iter_mut().zip(weights).for_each(|(l, w)| l.beta *= w);
    }

    /// Kills the path or strengthens it, so that its flux stays below what it started with.
    fn survives(&mut self, rng: &mut Rng) -> bool {
        if self.depth < ROULETTE_AFTER {
            return true;
        }
        let strength = self.lanes.iter().map(|l| l.beta * l.etendue).fold(0.0, f64::max) / self.start;
        if strength < 1.0 {
            if rng.next() >= strength {
                return false;
            }
            self.lanes.iter_mut().for_each(|l| l.beta /= strength);
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

/// A surface that a path meets, mixtures decided.
struct Met<'a> {
    hit: Hit,
    /// The index of its material.
    index: usize,
    material: &'a Material,
    /// Index and GGX width of the coat on it.
    coat: Option<(&'a Ior, f64)>,
    sheen: Option<(&'a Sheen, &'a Spectrum)>,
    film: Option<&'a Film>,
    grain: Option<Grain>,
}

/// What scatters light there: where, how, and through what.
type Scatterer<'a> = (Hit, Bsdf<'a>, Over<'a>);

pub(super) enum Scattering<'a> {
    Surface(&'a Surface<'a>),
    /// Direction of travel and asymmetry.
    Medium(DVec3, f64),
}

impl Vertex<'_> {
    /// Density of scattered flux per solid angle of `wo` for wavelength number `lane`.
    pub(super) fn eval(&self, wo: DVec3, lane: usize) -> f64 {
        match &self.scattering {
            Scattering::Surface(surface) => surface.eval(wo, lane),
            Scattering::Medium(dir, g) => phase::eval_hg(dir.dot(wo), *g),
        }
    }

    /// Interiors around a ray that leaves along `wo`.
    pub(super) fn inside_towards(&self, wo: DVec3) -> &[usize] {
        match &self.scattering {
            Scattering::Surface(surface) if surface.is_beyond(wo) => self.beyond,
            _ => self.inside,
        }
    }
}

/// What an estimator records along a path.
pub(super) trait Observer {
    /// The path flies `t` along its ray through `medium`; its lanes still weigh what they did at the origin.
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
            path.lanes.retain(|l| l.beta != 0.0);
            if path.lanes.is_empty() || !path.survives(rng) {
                return;
            }
            stats.rays += 1;
            let hits = self.world.intersect(&path.ray);
            let t_hit = hits.first().map_or(f64::INFINITY, |h| h.t);
            let medium = Medium::new(&self.scene.interiors[ruling(&self.scene, &path.inside)], &path.lanes);
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
            let Some(surface) = Surface::new(bsdf, over, &hit, -path.ray.dir, transport) else { return };
            if !self.may_scatter(&path, stats) {
                return;
            }
            let vertex =
                Vertex { p: hit.p, on, scattering: Scattering::Surface(&surface), inside: &path.inside, beyond: &beyond };
            seen.vertex(&path, &vertex, rng, stats);
            let mut parts = surface.sample(&path.lanes, rng).into_iter().map(|o| {
                let inside = if o.transmitted { beyond.clone() } else { path.inside.clone() };
                let ray = Ray { origin: vertex.p, dir: o.wo, t_min: 0.0, on: vertex.on.clone() };
                Path { ray, lanes: o.lanes, inside, depth: path.depth + 1, straight: 0, start: path.start }
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

    /// What the path meets at `hits`: the interiors beyond, and the scattering surface unless it goes straight through. Mixes are decided by
    /// chance; of surfaces that coincide an opaque one counts before dielectrics.
    fn meet<'a>(&'a self, path: &mut Path, hits: &[Hit], rng: &mut Rng) -> (Vec<usize>, Option<Scatterer<'a>>) {
        let met: Vec<Met> = hits.iter().map(|h| self.choose(*h, path, rng)).collect();
        let values = |f: &dyn Fn(f64) -> f64| path.lanes.iter().map(|l| f(l.nm)).collect::<Vec<f64>>();
        let outside = values(&|nm| self.scene.interiors[ruling(&self.scene, &path.inside)].ior.eval(nm));
        for &Met { hit, material, coat, sheen, film, grain, .. } in &met {
            let bsdf = match material {
                Material::Diffuse { reflectance } => Bsdf::Diffuse(values(&|nm| reflectance.eval(nm, hit.uv))),
                Material::ThinDielectric { ior } => {
                    let stacks = film.map_or(vec![], |film| {
                        let around = |(l, &n): (&Lane, &f64)| film.between(n, (n, 0.0), l.nm);
                        path.lanes.iter().zip(&outside).map(around).collect()
                    });
                    Bsdf::Thin(values(&|nm| ior.eval(nm)), stacks)
                }
                Material::Conductor { eta, k, alpha } => {
                    let around = coat.map_or(outside.clone(), |(ior, _)| values(&|nm| ior.eval(nm)));
                    let of = |(l, n): (&Lane, &f64)| match film {
                        Some(film) => Metal::Filmed(film.between(*n, (eta.eval(l.nm), k.eval(l.nm)), l.nm)),
                        None => Metal::Index(eta.eval(l.nm) / n, k.eval(l.nm) / n),
                    };
                    self.metal(path.lanes.iter().zip(&around).map(of).collect(), *alpha, grain)
                }
                Material::ColoredConductor { reflectance, alpha } => {
                    let of = |l: &Lane| Metal::Reflectance(reflectance.eval(l.nm, hit.uv));
                    self.metal(path.lanes.iter().map(of).collect(), *alpha, grain)
                }
                _ => continue,
            };
            let of_lane = |(ior, alpha): (&Ior, f64), nm: f64, outside: f64| Coat {
                eta: ior.eval(nm) / outside,
                rough: self.energy(alpha, None).map(|e| (alpha, &e.coat)),
            };
            let coats = |coat| path.lanes.iter().zip(&outside).map(|(l, &n)| of_lane(coat, l.nm, n)).collect();
            let over = Over {
                coat: coat.map_or(vec![], coats),
                sheen: sheen.map(|(sheen, color)| (sheen, values(&|nm| color.eval(nm)))),
                along: grain.map(|grain| self.along(&grain, &hit)),
            };
            return (path.inside.clone(), Some((hit, bsdf, over)));
        }
        let crossed: Vec<(&Hit, usize)> = met.iter().map(|m| (&m.hit, m.index)).collect();
        match cross(&self.scene, &path.inside, path.ray.dir, &crossed) {
            (beyond, Crossing::Interface { hit, near, far, alpha }) => {
                let interiors = &self.scene.interiors;
                let eta = values(&|nm| interiors[far].ior.eval(nm) / interiors[near].ior.eval(nm));
                let film = met.iter().find(|m| std::ptr::eq(&m.hit, hit)).and_then(|m| m.film);
                let index = |i: usize, nm: f64| interiors[i].ior.eval(nm);
                let stack = |l: &Lane, film: &Film| film.between(index(near, l.nm), (index(far, l.nm), 0.0), l.nm);
                let film = film.map_or(vec![], |film| path.lanes.iter().map(|l| stack(l, film)).collect());
                let energy = self.energy(alpha, None).map(|e| &e.dielectric);
                (beyond, Some((*hit, Bsdf::Dielectric { eta, film, alpha, energy }, Over::default())))
            }
            (beyond, Crossing::Straight) => (beyond, None),
        }
    }

    fn metal(&self, metal: Vec<Metal>, alpha: f64, grain: Option<Grain>) -> Bsdf<'_> {
        let width = grain.map_or(alpha.into(), |grain| grain.width(alpha));
        Bsdf::Conductor { metal, width, energy: self.energy(alpha, grain).map(|e| &e.conductor) }
    }

    /// Where this grain points at a hit.
    fn along(&self, grain: &Grain, hit: &Hit) -> DVec3 {
        let tangent = match &self.scene.shapes[hit.shape].geometry {
            Geometry::Mesh(mesh) => mesh.tangent((hit.prim - self.world.first_prim(hit.shape)) as usize, hit.p),
            _ => DVec4::W,
        };
        direction_of_grain(grain, hit.ns, tangent)
    }

    /// The material of a hit, the coat on it, and the hit with its normal as maps turn it; mixes decided with the mean of their weight over the carried
    /// wavelengths.
    fn choose(&self, mut hit: Hit, path: &mut Path, rng: &mut Rng) -> Met<'_> {
        let (mut coat, mut sheen) = (None, None);
        let shape = &self.scene.shapes[hit.shape];
        let mut index = shape.material;
        loop {
            let material = &self.scene.materials[index];
            let (a, b, weight) = match material {
                Material::Mix { a, b, weight } => (a, b, weight),
                Material::Graded { first, levels, roughness } => {
                    let (level, share) = level_at(roughness.eval(path.lanes[0].nm, hit.uv), levels);
                    index = first + level - levels.start + usize::from(rng.next() < share);
                    continue;
                }
                Material::NormalMapped { base, normals } => {
                    if let Geometry::Mesh(mesh) = &shape.geometry {
                        let triangle = (hit.prim - self.world.first_prim(hit.shape)) as usize;
                        hit.ns = mesh.mapped_normal(triangle, hit.uv, hit.ng, hit.ns, normals);
                    }
                    index = *base;
                    continue;
                }
                Material::Sheen { base, color, .. } => {
                    sheen = Some((&self.sheens[&index], color));
                    index = *base;
                    continue;
                }
                Material::Coated { base, ior, alpha } => {
                    coat = Some((ior, *alpha));
                    index = *base;
                    continue;
                }
                _ => {
                    let (film, grain) = (self.scene.films.get(&index), self.scene.grains.get(&index).copied());
                    return Met { hit, index, material, coat, sheen, film, grain };
                }
            };
            let w: Vec<f64> = path.lanes.iter().map(|l| weight.eval(l.nm, hit.uv)).collect();
            let q = w.iter().sum::<f64>() / w.len() as f64;
            let first = rng.next() < q;
            for (lane, w) in path.lanes.iter_mut().zip(w) {
                lane.beta *= if first { w / q } else { (1.0 - w) / (1.0 - q) };
            }
            index = if first { *a } else { *b };
        }
    }

    /// Share of light per wavelength that goes straight from the ray's origin to `distance`: through media, and through surfaces that are
    /// not there or let a part pass undeflected. All 0 if something is in the way.
    pub(super) fn straight(
        &self,
        mut ray: Ray,
        inside: &[usize],
        lanes: &[Lane],
        mut distance: f64,
        stats: &mut BatchStats,
    ) -> Vec<f64> {
        let mut share = vec![1.0; lanes.len()];
        let mut inside = inside.to_vec();
        for _ in 0..=MAX_STRAIGHT {
            stats.rays += 1;
            let hits = self.world.intersect(&ray);
            let t = hits.first().map_or(f64::INFINITY, |h| h.t).min(distance);
            let medium = Medium::new(&self.scene.interiors[ruling(&self.scene, &inside)], lanes);
            share.iter_mut().zip(medium.transmittance(t)).for_each(|(s, m)| *s *= m);
            if t >= distance {
                return share;
            }
            let met: Vec<(&Hit, usize)> =
                hits.iter().map(|h| (h, bare(&self.scene, self.scene.shapes[h.shape].material))).collect();
            for (hit, _) in met.iter().filter(|(_, m)| !matches!(self.scene.materials[*m], Material::Dielectric { .. })) {
                let cos = ray.dir.dot(hit.ns).abs();
                share.iter_mut().zip(lanes).for_each(|(s, l)| {
                    *s *= straight_share(&self.scene, self.scene.shapes[hit.shape].material, cos, hit.uv, l.nm)
                });
            }
            let (beyond, crossing) = cross(&self.scene, &inside, ray.dir, &met);
            if let Crossing::Interface { .. } = crossing {
                break;
            }
            if share.iter().all(|&s| s == 0.0) {
                break;
            }
            inside = beyond;
            distance -= t;
            ray = Ray { origin: hits[0].p, dir: ray.dir, t_min: 0.0, on: hits.iter().map(|h| h.prim).collect() };
        }
        vec![0.0; lanes.len()]
    }
}
