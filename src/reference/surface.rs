//! Scattering at a surface for all wavelengths of a path at once: where light goes from there.

use super::rng::Rng;
use super::walk::WavelengthSample;
use crate::bsdf::coat::Coat;
use crate::bsdf::conductor::RoughConductor;
use crate::bsdf::dielectric::RoughDielectric;
use crate::bsdf::energy::EnergyTable;
use crate::bsdf::facet;
use crate::bsdf::fresnel::{self, Metal};
use crate::bsdf::ggx::Width;
use crate::bsdf::pane::{Pane, RoughPane};
use crate::bsdf::sample_cosine;
use crate::bsdf::sheen::Sheen;
use crate::bsdf::thin_film::Stack;
use crate::geometry::world::Hit;
use glam::{DMat3, DVec3, dvec3};
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
    /// Transmittance.
    DiffuseTransmission(Vec<f64>),
    /// A pane, and the facets of a rough one.
    Thin { panes: Vec<Pane>, facets: Option<RoughConductor<'a>> },
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
    /// The factor on what gets through it, for each wavelength, or nothing.
    pub tint: Vec<f64>,
}

/// Light that leaves a surface together.
pub(super) struct Outgoing {
    pub wi: DVec3,
    pub wavelengths: Vec<WavelengthSample>,
    pub transmitted: bool,
}

/// A surface point with its material, as seen by a path that came from `wo`.
pub(super) struct Surface<'a> {
    pub bsdf: Bsdf<'a>,
    over: Over<'a>,
    /// To the world; the third column is the shading normal on the side of `wo`.
    frame: DMat3,
    /// Geometric normal on the side of `wo`.
    ng: DVec3,
    /// Where the path came from, and that as the facet has it, which was chosen from as many (0 if it is behind the facet).
    came_from: DVec3,
    wo: DVec3,
    weight: f64,
    transport: Transport,
}

impl<'a> Surface<'a> {
    /// What the path sees, or lights, there ([`facet`]).
    pub(super) fn new(bsdf: Bsdf<'a>, over: Over<'a>, hit: &Hit, came_from: DVec3, transport: Transport, rng: &mut Rng) -> Self {
        let side = if came_from.dot(hit.ng) < 0.0 { -1.0 } else { 1.0 };
        let (ng, ns) = (hit.ng * side, hit.ns * side);
        let x = over.along.unwrap_or_else(|| ns.any_orthonormal_vector());
        let (wo, weight) = match transport {
            Transport::Radiance => (facet::raise(came_from, ns, 1.0), 1.0),
            Transport::Flux => facet::choose(came_from, ng, ns, 1.0, || rng.next()),
        };
        Self { bsdf, over, frame: frame(x, ns), ng, came_from, wo, weight, transport }
    }

    /// Veach's correction of flux (1997, eq. 5.19).
    fn correction(&self, wi: DVec3) -> f64 {
        let (ns, ng) = (self.frame.z_axis, self.ng);
        if ns == ng || self.transport == Transport::Radiance {
            return 1.0;
        }
        (self.wo.dot(ns) * wi.dot(ng) / (self.wo.dot(ng) * wi.dot(ns))).abs()
    }

    /// Where light goes on to that leaves the facet along `w`, and the factor on it.
    fn leave(&self, w: DVec3, transmitted: bool, rng: &mut Rng) -> (DVec3, f64) {
        let (ns, ng) = (self.frame.z_axis, self.ng);
        if transmitted && matches!(self.bsdf, Bsdf::Thin { facets: None, .. }) {
            // Straight on, past the facets; so light that the mirror threw on them has not come through. Light from behind them has.
            let thrown = self.wo.dot(ng) < 0.0;
            return (-self.came_from, if thrown { 0.0 } else { self.weight.max(1.0) });
        }
        let side = if transmitted { -1.0 } else { 1.0 };
        let (wi, choices) = match self.transport {
            Transport::Radiance => (facet::raise(w, ng, side), 1.0),
            Transport::Flux => facet::choose(w, ns, ng, side, || rng.next()),
        };
        (wi, self.weight * choices * self.correction(wi))
    }

    /// Whether `wi` lies beyond the surface.
    pub(super) fn is_beyond(&self, wi: DVec3) -> bool {
        wi.dot(self.ng) < 0.0
    }

    /// Density of scattered flux per solid angle of `wi` for the carried wavelength number `wavelength`; 0 for mirror-like surfaces.
    pub(super) fn eval(&self, wi: DVec3, wavelength: usize) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        let facing = facet::raise(wi, self.frame.z_axis, wi.dot(self.ng).signum());
        let (wo, local) = (self.local(self.wo), self.local(facing));
        let g = match &self.bsdf {
            Bsdf::Diffuse(rho) => self.paint(rho[wavelength], wavelength, wo, local) * local.z.max(0.0) / PI,
            Bsdf::DiffuseTransmission(tau) => self.paint(tau[wavelength], wavelength, wo, local) * (-local.z).max(0.0) / PI,
            Bsdf::Thin { panes, facets: Some(facets) } => RoughPane { facets: *facets }.eval(wo, local, &panes[wavelength]),
            Bsdf::Conductor { metal, width, energy: Some(energy) } => {
                let facets = RoughConductor { alpha: *width, energy };
                facets.eval(wo, local, |lobe| self.mirror(facets.reflectance(lobe, metal[wavelength]), wavelength, wo, local))
            }
            Bsdf::Dielectric { eta, alpha, energy: Some(energy), .. } => {
                RoughDielectric { alpha: *alpha, eta: eta[wavelength], energy }.eval(wo, local)
            }
            _ => 0.0,
        };
        let own = self.over.coat.get(wavelength).map_or(0.0, |coat| coat.eval(wo, local));
        let of_sheen = self.over.sheen.as_ref().map_or(0.0, |(sheen, color)| color[wavelength] * sheen.eval(wo, local));
        let tint = if local.z < 0.0 { self.tint(wavelength) } else { 1.0 };
        (of_sheen + self.under_sheen(wo, local) * (own + g * tint)) * self.weight * self.correction(wi)
    }

    /// The factor on what gets through.
    fn tint(&self, wavelength: usize) -> f64 {
        self.over.tint.get(wavelength).copied().unwrap_or(1.0)
    }

    /// What sheen leaves of what is under it.
    fn under_sheen(&self, wo: DVec3, wi: DVec3) -> f64 {
        self.over.sheen.as_ref().map_or(1.0, |(sheen, _)| sheen.over(wo.z, wi.z.abs()))
    }

    /// The reflectance of paint, through the coat if there is one.
    fn paint(&self, rho: f64, wavelength: usize, wo: DVec3, wi: DVec3) -> f64 {
        self.over.coat.get(wavelength).map_or(rho, |coat| coat.over_diffuse(rho, wo.z, wi.z.abs()))
    }

    /// The reflectance of a mirror or facet, likewise.
    fn mirror(&self, r: f64, wavelength: usize, wo: DVec3, wi: DVec3) -> f64 {
        self.over.coat.get(wavelength).map_or(r, |coat| coat.over_mirror(r, wo.z, wi.z))
    }

    fn local(&self, w: DVec3) -> DVec3 {
        self.frame.transpose() * w
    }

    /// Scatters the path: nothing if absorbed, several where dispersion parts its wavelengths.
    pub(super) fn sample(&self, wavelengths: &[WavelengthSample], rng: &mut Rng) -> Vec<Outgoing> {
        // A pane that is lit from behind its facets lets through what it would from before them.
        let local = self.local(self.wo);
        let mut out = self.sample_under_sheen(local.with_z(local.z.abs()), wavelengths, rng);
        for o in &mut out {
            let (wi, factor) = self.leave((self.frame * o.wi).normalize(), o.transmitted, rng);
            o.wi = wi;
            o.wavelengths.iter_mut().for_each(|wavelength| wavelength.beta *= factor);
        }
        for outgoing in out.iter_mut().filter(|o| o.transmitted) {
            for wavelength in &mut outgoing.wavelengths {
                wavelength.beta *= self.tint(number_of(wavelength, wavelengths));
            }
        }
        if let Bsdf::Dielectric { eta, energy, .. } = &self.bsdf {
            if energy.is_none() && self.ng != self.frame.z_axis {
                self.go_by_geometry(&mut out, wavelengths, eta, rng);
            }
            for o in out.iter_mut().filter(|o| o.transmitted && self.transport == Transport::Radiance) {
                for wavelength in &mut o.wavelengths {
                    let eta = eta[number_of(wavelength, wavelengths)];
                    wavelength.beta /= eta * eta;
                    wavelength.etendue *= eta * eta;
                }
            }
        }
        out
    }

    /// Smooth glass: lets the wavelengths that [`facet::is_let_out`] names go by the geometric normal, not as in `out`.
    fn go_by_geometry(&self, out: &mut Vec<Outgoing>, wavelengths: &[WavelengthSample], eta: &[f64], rng: &mut Rng) {
        let frame = frame(self.ng.any_orthonormal_vector(), self.ng);
        let mut by_geometry = self.sample_local(frame.transpose() * self.came_from, wavelengths, rng);
        by_geometry.iter_mut().for_each(|o| o.wi = (frame * o.wi).normalize());
        for (outgoing, by_geometry) in out.iter_mut().map(|o| (o, false)).chain(by_geometry.iter_mut().map(|o| (o, true))) {
            let (eye, inverse) = match self.transport {
                Transport::Radiance => (self.came_from, false),
                Transport::Flux => (outgoing.wi, outgoing.transmitted),
            };
            for wavelength in &mut outgoing.wavelengths {
                let eta = eta[number_of(wavelength, wavelengths)];
                let eta = if inverse { 1.0 / eta } else { eta };
                if facet::is_let_out(eye, self.frame.z_axis, self.ng, eta) != by_geometry {
                    wavelength.beta = 0.0;
                }
            }
        }
        out.append(&mut by_geometry);
    }

    /// The sheen's own reflection or what is under it; each weighs the more for its probability.
    fn sample_under_sheen(&self, wo: DVec3, wavelengths: &[WavelengthSample], rng: &mut Rng) -> Vec<Outgoing> {
        let Some((sheen, color)) = &self.over.sheen else { return self.sample_local(wo, wavelengths, rng) };
        let own = mean(color) * sheen.albedo(wo.z).min(1.0);
        let q = (own / (own + sheen.transmittance(wo.z)).max(1e-6)).clamp(0.05, 0.95);
        if rng.next() < q {
            let wi = sample_cosine(rng.next2());
            let weight = sheen.eval(wo, wi) * PI / (wi.z * q);
            let wavelengths = wavelengths.iter().zip(color).map(|(l, c)| l.times(c * weight)).collect();
            return vec![Outgoing { wi, wavelengths, transmitted: false }];
        }
        let mut out = self.sample_local(wo, wavelengths, rng);
        for o in &mut out {
            let weight = self.under_sheen(wo, o.wi) / (1.0 - q);
            o.wavelengths.iter_mut().for_each(|wavelength| wavelength.beta *= weight);
        }
        out
    }

    fn sample_local(&self, wo: DVec3, wavelengths: &[WavelengthSample], rng: &mut Rng) -> Vec<Outgoing> {
        let reflected: Vec<f64> = self.over.coat.iter().map(|coat| 1.0 - coat.transmittance(wo.z)).collect();
        // Probability of the coat's own reflection; the samples of what is under it weigh the more.
        let of_coat = if reflected.is_empty() { 0.0 } else { mean(&reflected) };
        let one = |wi, transmitted, weight: &dyn Fn(usize) -> f64| {
            let wavelengths = wavelengths.iter().enumerate().map(|(i, l)| l.times(weight(i) / (1.0 - of_coat))).collect();
            vec![Outgoing { wi, wavelengths, transmitted }]
        };
        if of_coat > 0.0 && rng.next() < of_coat {
            let Some((wi, weight, cos)) = self.over.coat[0].sample(wo, rng.next2()) else { return vec![] };
            let share = |coat: &Coat| weight * fresnel::dielectric(cos, coat.eta) / of_coat;
            let wavelengths = wavelengths.iter().zip(&self.over.coat).map(|(l, coat)| l.times(share(coat))).collect();
            return vec![Outgoing { wi, wavelengths, transmitted: false }];
        }
        match &self.bsdf {
            Bsdf::Diffuse(rho) => {
                let wi = sample_cosine(rng.next2());
                one(wi, false, &|i| self.paint(rho[i], i, wo, wi))
            }
            Bsdf::DiffuseTransmission(tau) => {
                let mut wi = sample_cosine(rng.next2());
                wi.z = -wi.z;
                one(wi, true, &|i| self.paint(tau[i], i, wo, wi))
            }
            Bsdf::Conductor { metal, energy: None, .. } => {
                let wi = fresnel::reflect(wo, DVec3::Z);
                one(wi, false, &|i| self.mirror(metal[i].at(wo.z), i, wo, wi))
            }
            Bsdf::Conductor { metal, width, energy: Some(energy) } => {
                let facets = RoughConductor { alpha: *width, energy };
                let [u0, u1] = rng.next2();
                let Some(s) = facets.sample(wo, [u0, u1, rng.next()]) else { return vec![] };
                one(s.wi, false, &|i| s.weight * self.mirror(facets.reflectance(s.lobe, metal[i]), i, wo, s.wi))
            }
            Bsdf::Thin { panes, facets } => {
                let q = |cos: f64| panes.iter().map(|pane| pane.shares(cos)[0]).sum::<f64>() / panes.len() as f64;
                let side = |cos: f64, reflects: bool, i: usize| {
                    if reflects { panes[i].shares(cos)[0] / q(cos) } else { panes[i].shares(cos)[1] / (1.0 - q(cos)) }
                };
                if let Some(facets) = facets {
                    let ([u0, u1], [u2, u3]) = (rng.next2(), rng.next2());
                    let sampled = RoughPane { facets: *facets }.sample(wo, q, [u0, u1, u2, u3]);
                    return sampled
                        .map_or(vec![], |(wi, weight, cos)| one(wi, wi.z < 0.0, &|i| weight * side(cos, wi.z > 0.0, i)));
                }
                let reflects = rng.next() < q(wo.z);
                let wi = if reflects { fresnel::reflect(wo, DVec3::Z) } else { -wo };
                one(wi, !reflects, &|i| side(wo.z, reflects, i))
            }
            Bsdf::Dielectric { eta, film, energy: None, .. } => {
                let f: Vec<f64> = match film.is_empty() {
                    true => eta.iter().map(|&n| fresnel::dielectric(wo.z, n)).collect(),
                    false => film.iter().map(|s| s.reflectance(wo.z)).collect(),
                };
                let q = mean(&f);
                if rng.next() < q {
                    return one(fresnel::reflect(wo, DVec3::Z), false, &|i| f[i] / q);
                }
                let through = |i: usize| fresnel::refract_flat(wo, eta[i]).unwrap_or(dvec3(wo.x, wo.y, 0.0));
                if eta.iter().all(|&n| n == eta[0]) {
                    return one(through(0), true, &|i| (1.0 - f[i]) / (1.0 - q));
                }
                let parted = wavelengths.iter().enumerate().map(|(i, wavelength)| Outgoing {
                    wi: through(i),
                    wavelengths: vec![wavelength.times((1.0 - f[i]) / (1.0 - q))],
                    transmitted: true,
                });
                parted.collect()
            }
            Bsdf::Dielectric { eta, alpha, energy: Some(energy), .. } => {
                let mut scatter = |eta: f64| {
                    let [u0, u1] = rng.next2();
                    let [u2, u3] = rng.next2();
                    RoughDielectric { alpha: *alpha, eta, energy }.sample(wo, [u0, u1, u2, u3])
                };
                if eta.iter().all(|&n| n == eta[0]) {
                    return scatter(eta[0]).map_or(vec![], |(wi, weight)| one(wi, wi.z < 0.0, &|_| weight));
                }
                let parted = wavelengths.iter().zip(eta).filter_map(|(wavelength, &eta)| {
                    let (wi, weight) = scatter(eta)?;
                    Some(Outgoing { wi, wavelengths: vec![wavelength.times(weight)], transmitted: wi.z < 0.0 })
                });
                parted.collect()
            }
        }
    }
}

/// From local directions to the world: `x` and `n` are its first and third axes.
fn frame(x: DVec3, n: DVec3) -> DMat3 {
    DMat3::from_cols(x, n.cross(x), n)
}

/// Which of `wavelengths` this one came from.
fn number_of(wavelength: &WavelengthSample, wavelengths: &[WavelengthSample]) -> usize {
    wavelengths.iter().position(|l| l.bin == wavelength.bin).unwrap_or(0)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
