//! Scattering at a surface for all wavelengths of a path at once.

use super::rng::Rng;
use super::walk::Lane;
use crate::bsdf::coat::Coat;
use crate::bsdf::conductor::RoughConductor;
use crate::bsdf::dielectric::RoughDielectric;
use crate::bsdf::energy::EnergyTable;
use crate::bsdf::film::Stack;
use crate::bsdf::fresnel::{self, Metal};
use crate::bsdf::ggx::Width;
use crate::bsdf::sample_cosine;
use crate::bsdf::sheen::Sheen;
use crate::geometry::world::Hit;
use crate::scene::{Material, Scene};
use glam::{DMat3, DVec2, DVec3, dvec3};
use std::f64::consts::PI;

/// What the path carries: the factors at refractions and at shading normals differ (Veach 1997, sec. 5.2 and 5.3).
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Transport {
    /// Radiance, towards the light: backward.
    Radiance,
    /// Flux, towards the sensor: forward.
    Flux,
}

/// A surface's material with its parameters at the wavelengths of a path.
pub(super) enum Bsdf<'a> {
    /// Reflectance.
    Diffuse(Vec<f64>),
    /// Metal.
    Conductor { metal: Vec<Metal>, width: Width, energy: Option<&'a EnergyTable> },
    /// Far index over near index, and the film between, if there is one.
    Dielectric { eta: Vec<f64>, film: Vec<Stack>, alpha: f64, energy: Option<&'a EnergyTable> },
    /// Relative index of the pane, or if it is a film, that.
    Thin(Vec<f64>, Vec<Stack>),
}

/// What else there is to a surface.
#[derive(Default)]
pub(super) struct Over<'a> {
    /// The coat on it, for each wavelength, or nothing.
    pub coat: Vec<Coat<'a>>,
    /// The sheen over all of it, and its colour at each wavelength.
    pub sheen: Option<(&'a Sheen, Vec<f64>)>,
    /// Where its grain points.
    pub along: Option<DVec3>,
}

/// Light that leaves a surface together.
pub(super) struct Outgoing {
    pub wo: DVec3,
    pub lanes: Vec<Lane>,
    pub transmitted: bool,
}

/// A surface point with its material, as seen by a path that came from `wi`.
pub(super) struct Surface<'a> {
    pub bsdf: Bsdf<'a>,
    over: Over<'a>,
    /// To the world; the third column is the shading normal on the side of `wi`.
    frame: DMat3,
    /// Geometric normal on the side of `wi`.
    ng: DVec3,
    wi: DVec3,
    transport: Transport,
}

impl<'a> Surface<'a> {
    /// `None` where the shading normal contradicts the geometry: such light is absorbed.
    pub(super) fn new(bsdf: Bsdf<'a>, over: Over<'a>, hit: &Hit, wi: DVec3, transport: Transport) -> Option<Self> {
        let side = if wi.dot(hit.ng) < 0.0 { -1.0 } else { 1.0 };
        let (ng, ns) = (hit.ng * side, hit.ns * side);
        let x = over.along.unwrap_or_else(|| ns.any_orthonormal_vector());
        (wi.dot(ns) > 0.0).then_some(Self { bsdf, over, frame: DMat3::from_cols(x, ns.cross(x), ns), ng, wi, transport })
    }

    /// Which side of the geometry `wo` goes to, as a factor: 0 where the shading normal says otherwise, else 1 or for flux Veach's correction.
    fn correction(&self, wo: DVec3) -> f64 {
        let (ns, ng) = (self.frame.z_axis, self.ng);
        if wo.dot(ns) * wo.dot(ng) <= 0.0 {
            return 0.0;
        }
        match self.transport {
            Transport::Radiance => 1.0,
            Transport::Flux if ns == ng => 1.0,
            Transport::Flux => (self.wi.dot(ns) * wo.dot(ng) / (self.wi.dot(ng) * wo.dot(ns))).abs(),
        }
    }

    /// Whether `wo` lies beyond the surface.
    pub(super) fn is_beyond(&self, wo: DVec3) -> bool {
        wo.dot(self.ng) < 0.0
    }

    /// Density of scattered flux per solid angle of `wo` for the carried wavelength number `lane`; 0 for mirror-like surfaces.
    pub(super) fn eval(&self, wo: DVec3, lane: usize) -> f64 {
        let (wi, local) = (self.local(self.wi), self.local(wo));
        let g = match &self.bsdf {
            Bsdf::Diffuse(rho) => self.paint(rho[lane], lane, wi, local) * local.z.max(0.0) / PI,
            Bsdf::Conductor { metal, width, energy: Some(energy) } => {
                let facets = RoughConductor { alpha: *width, energy };
                facets.eval(wi, local, |lobe| self.mirror(facets.reflectance(lobe, metal[lane]), lane, wi, local))
            }
            Bsdf::Dielectric { eta, alpha, energy: Some(energy), .. } => {
                RoughDielectric { alpha: *alpha, eta: eta[lane], energy }.eval(wi, local)
            }
            _ => 0.0,
        };
        let own = self.over.coat.get(lane).map_or(0.0, |coat| coat.eval(wi, local));
        let of_sheen = self.over.sheen.as_ref().map_or(0.0, |(sheen, color)| color[lane] * sheen.eval(wi, local));
        (of_sheen + self.under_sheen(wi, local) * (own + g)) * self.correction(wo)
    }

    /// What sheen leaves of what is under it.
    fn under_sheen(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.over.sheen.as_ref().map_or(1.0, |(sheen, _)| sheen.over(wi.z, wo.z.abs()))
    }

    /// The reflectance of paint, through the coat if there is one.
    fn paint(&self, rho: f64, lane: usize, wi: DVec3, wo: DVec3) -> f64 {
        self.over.coat.get(lane).map_or(rho, |coat| coat.over_diffuse(rho, wi.z, wo.z))
    }

    /// The reflectance of a mirror or facet, likewise.
    fn mirror(&self, r: f64, lane: usize, wi: DVec3, wo: DVec3) -> f64 {
        self.over.coat.get(lane).map_or(r, |coat| coat.over_mirror(r, wi.z, wo.z))
    }

    fn local(&self, w: DVec3) -> DVec3 {
        self.frame.transpose() * w
    }

    /// Scatters the path: nothing if absorbed, several where dispersion parts its wavelengths.
    pub(super) fn sample(&self, lanes: &[Lane], rng: &mut Rng) -> Vec<Outgoing> {
        let mut out = self.sample_under_sheen(self.local(self.wi), lanes, rng);
        for o in &mut out {
            let refracted = o.transmitted && self.transport == Transport::Radiance;
            o.wo = (self.frame * o.wo).normalize();
            let correction = self.correction(o.wo);
            for lane in &mut o.lanes {
                lane.beta *= correction;
                if let (true, Bsdf::Dielectric { eta, .. }) = (refracted, &self.bsdf) {
                    let eta = eta[lanes.iter().position(|l| l.bin == lane.bin).unwrap_or(0)];
                    lane.beta /= eta * eta;
                    lane.etendue *= eta * eta;
                }
            }
        }
        out
    }

    /// The sheen's own reflection or what is under it; each weighs the more for its probability.
    fn sample_under_sheen(&self, wi: DVec3, lanes: &[Lane], rng: &mut Rng) -> Vec<Outgoing> {
        let Some((sheen, color)) = &self.over.sheen else { return self.sample_local(wi, lanes, rng) };
        let own = mean(color) * sheen.albedo(wi.z).min(1.0);
        let q = (own / (own + sheen.transmittance(wi.z)).max(1e-6)).clamp(0.05, 0.95);
        if rng.next() < q {
            let wo = sample_cosine(rng.next2());
            let weight = sheen.eval(wi, wo) * PI / (wo.z * q);
            let lanes = lanes.iter().zip(color).map(|(l, c)| l.times(c * weight)).collect();
            return vec![Outgoing { wo, lanes, transmitted: false }];
        }
        let mut out = self.sample_local(wi, lanes, rng);
        for o in &mut out {
            let weight = self.under_sheen(wi, o.wo) / (1.0 - q);
            o.lanes.iter_mut().for_each(|lane| lane.beta *= weight);
        }
        out
    }

    fn sample_local(&self, wi: DVec3, lanes: &[Lane], rng: &mut Rng) -> Vec<Outgoing> {
        let reflected: Vec<f64> = self.over.coat.iter().map(|coat| 1.0 - coat.transmittance(wi.z)).collect();
        // Probability of the coat's own reflection; the samples of what is under it weigh the more.
        let of_coat = if reflected.is_empty() { 0.0 } else { mean(&reflected) };
        let one = |wo, transmitted, weight: &dyn Fn(usize) -> f64| {
            let lanes = lanes.iter().enumerate().map(|(i, l)| l.times(weight(i) / (1.0 - of_coat))).collect();
            vec![Outgoing { wo, lanes, transmitted }]
        };
        if of_coat > 0.0 && rng.next() < of_coat {
            let Some((wo, weight, cos)) = self.over.coat[0].sample(wi, rng.next2()) else { return vec![] };
            let share = |coat: &Coat| weight * fresnel::dielectric(cos, coat.eta) / of_coat;
            let lanes = lanes.iter().zip(&self.over.coat).map(|(l, coat)| l.times(share(coat))).collect();
            return vec![Outgoing { wo, lanes, transmitted: false }];
        }
        match &self.bsdf {
            Bsdf::Diffuse(rho) => {
                let wo = sample_cosine(rng.next2());
                one(wo, false, &|i| self.paint(rho[i], i, wi, wo))
            }
            Bsdf::Conductor { metal, energy: None, .. } => {
                let wo = fresnel::reflect(wi, DVec3::Z);
                one(wo, false, &|i| self.mirror(metal[i].at(wi.z), i, wi, wo))
            }
            Bsdf::Conductor { metal, width, energy: Some(energy) } => {
                let facets = RoughConductor { alpha: *width, energy };
                let [u0, u1] = rng.next2();
                let Some(s) = facets.sample(wi, [u0, u1, rng.next()]) else { return vec![] };
                one(s.wo, false, &|i| s.weight * self.mirror(facets.reflectance(s.lobe, metal[i]), i, wi, s.wo))
            }
            Bsdf::Thin(eta, film) => {
                let r: Vec<f64> = reflectances(film, eta, wi.z, fresnel::thin_pane);
                let q = mean(&r);
                if rng.next() < q {
                    one(fresnel::reflect(wi, DVec3::Z), false, &|i| r[i] / q)
                } else {
                    one(-wi, true, &|i| (1.0 - r[i]) / (1.0 - q))
                }
            }
            Bsdf::Dielectric { eta, film, energy: None, .. } => {
                let f: Vec<f64> = reflectances(film, eta, wi.z, fresnel::dielectric);
                let q = mean(&f);
                if rng.next() < q {
                    return one(fresnel::reflect(wi, DVec3::Z), false, &|i| f[i] / q);
                }
                let through = |i: usize| fresnel::refract_flat(wi, eta[i]).unwrap_or(dvec3(wi.x, wi.y, 0.0));
                if eta.iter().all(|&n| n == eta[0]) {
                    return one(through(0), true, &|i| (1.0 - f[i]) / (1.0 - q));
                }
                let parted = lanes.iter().enumerate().map(|(i, lane)| Outgoing {
                    wo: through(i),
                    lanes: vec![lane.times((1.0 - f[i]) / (1.0 - q))],
                    transmitted: true,
                });
                parted.collect()
            }
            Bsdf::Dielectric { eta, alpha, energy: Some(energy), .. } => {
                let mut scatter = |eta: f64| {
                    let [u0, u1] = rng.next2();
                    let [u2, u3] = rng.next2();
                    RoughDielectric { alpha: *alpha, eta, energy }.sample(wi, [u0, u1, u2, u3])
                };
                if eta.iter().all(|&n| n == eta[0]) {
                    return scatter(eta[0]).map_or(vec![], |(wo, weight)| one(wo, wo.z < 0.0, &|_| weight));
                }
                let parted = lanes.iter().zip(eta).filter_map(|(lane, &eta)| {
                    let (wo, weight) = scatter(eta)?;
                    Some(Outgoing { wo, lanes: vec![lane.times(weight)], transmitted: wo.z < 0.0 })
                });
                parted.collect()
            }
        }
    }
}

/// How much of a straight ray passes a surface of material number `index` unscattered, per wavelength; dielectrics are not asked here.
pub(super) fn straight_share(scene: &Scene, index: usize, cos: f64, uv: DVec2, nm: f64) -> f64 {
    match &scene.materials[index] {
        Material::Boundary { .. } => 1.0,
        Material::ThinDielectric { ior } => match scene.films.get(&index) {
            Some(film) => 1.0 - film.between(1.0, (1.0, 0.0), nm).reflectance(cos),
            None => 1.0 - fresnel::thin_pane(cos, ior.eval(nm)),
        },
        Material::NormalMapped { base, .. } | Material::Graded { first: base, .. } => straight_share(scene, *base, cos, uv, nm),
        Material::Mix { a, b, weight } => {
            let w = weight.eval(nm, uv);
            w * straight_share(scene, *a, cos, uv, nm) + (1.0 - w) * straight_share(scene, *b, cos, uv, nm)
        }
        Material::Diffuse { .. }
        | Material::Dielectric { .. }
        | Material::Conductor { .. }
        | Material::ColoredConductor { .. }
        | Material::Coated { .. }
        | Material::Sheen { .. } => 0.0,
    }
}

/// Those of a film, if there is one, else of what lies bare.
fn reflectances(film: &[Stack], eta: &[f64], cos: f64, bare: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    if film.is_empty() { eta.iter().map(|&n| bare(cos, n)).collect() } else { film.iter().map(|s| s.reflectance(cos)).collect() }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
