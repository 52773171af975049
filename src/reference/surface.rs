//! Scattering at a surface for all wavelengths of a path at once: where light goes from there.

use super::bsdf::Bsdf;
use super::rng::Rng;
use super::walk::WavelengthSample;
use crate::bsdf::coat::Coat;
use crate::bsdf::facet;
use crate::bsdf::sample_cosine;
use crate::bsdf::sheen::Sheen;
use crate::geometry::world::Hit;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// What the path carries: the factors at refractions and at shading normals differ (Veach 1997, sec. 5.2 and 5.3).
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Transport {
    /// Radiance, towards the light: backward.
    Radiance,
    /// Flux, towards the sensor: forward.
    Flux,
}

/// What else there is to a surface.
#[derive(Default)]
pub(super) struct Over<'a> {
    /// The coat on it, for each wavelength, or nothing.
    pub coat: Vec<Coat<'a>>,
    /// The shading normal of that.
    pub coat_normal: DVec3,
    /// The sheen over all of it, and its colour at each wavelength.
    pub sheen: Option<(&'a Sheen, Vec<f64>)>,
    /// Where its grain points.
    pub along: Option<DVec3>,
    /// The factor on what gets through it, for each wavelength, or nothing.
    pub tint: Vec<f64>,
}

impl Over<'_> {
    /// The reflectance of paint, through the coat if there is one.
    pub(super) fn paint(&self, rho: f64, wavelength: usize, wo: DVec3, wi: DVec3) -> f64 {
        self.coat.get(wavelength).map_or(rho, |coat| coat.over_diffuse(rho, wo.z, wi.z.abs()))
    }

    /// The reflectance of a mirror or facet, likewise.
    pub(super) fn mirror(&self, r: f64, wavelength: usize, wo: DVec3, wi: DVec3) -> f64 {
        self.coat.get(wavelength).map_or(r, |coat| coat.over_mirror(r, wo.z, wi.z))
    }
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
    /// The factor on all but sheen, for the probability of what was chosen of a coat and what it lies on.
    of_part: f64,
}

impl<'a> Surface<'a> {
    /// What the path sees, or lights, there ([`facet`]): of what is coated by chance what the coat itself reflects or what is under it.
    pub(super) fn new(
        mut bsdf: Bsdf<'a>,
        mut over: Over<'a>,
        hit: &Hit,
        came_from: DVec3,
        transport: Transport,
        rng: &mut Rng,
    ) -> Self {
        let side = if came_from.dot(hit.ng) < 0.0 { -1.0 } else { 1.0 };
        let (ng, mut ns) = (hit.ng * side, hit.ns * side);
        over.coat_normal *= side;
        let mut of_part = 1.0;
        if !over.coat.is_empty() {
            let cos = came_from.dot(over.coat_normal).abs().min(1.0);
            let q = 1.0 - mean(&over.coat.iter().map(|coat| coat.transmittance(cos)).collect::<Vec<_>>());
            if rng.next() < q {
                (bsdf, ns, of_part) = (Bsdf::Coat(std::mem::take(&mut over.coat)), over.coat_normal, 1.0 / q);
            } else {
                of_part = 1.0 / (1.0 - q);
            }
        }
        let x = over.along.unwrap_or_else(|| ns.any_orthonormal_vector());
        let (wo, weight) = match transport {
            Transport::Radiance => (facet::raise(came_from, ns, 1.0), 1.0),
            Transport::Flux => facet::choose(came_from, ng, ns, 1.0, || rng.next()),
        };
        Self { bsdf, over, frame: frame(x, ns), ng, came_from, wo, weight, transport, of_part }
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
        let g = self.bsdf.eval(&self.over, wo, local, wavelength);
        let of_sheen = self.over.sheen.as_ref().map_or(0.0, |(sheen, color)| color[wavelength] * sheen.eval(wo, local));
        let tint = if local.z < 0.0 { self.tint(wavelength) } else { 1.0 };
        let under = self.under_sheen(wo, local) * self.of_part * self.through_coat(wi, wavelength);
        (of_sheen + under * g * tint) * self.weight * self.correction(wi)
    }

    /// What the eye sees through a coat of another normal than that of what it lies on, over what it would if it were the same ([`crate::bsdf::coat`]).
    fn through_coat(&self, wi: DVec3, wavelength: usize) -> f64 {
        let eye = match self.transport {
            Transport::Radiance => self.came_from,
            Transport::Flux => wi,
        };
        let at = |normal: DVec3| eye.dot(normal).abs().min(1.0);
        self.over.coat.get(wavelength).map_or(1.0, |coat| coat.seen_from(at(self.over.coat_normal), at(self.frame.z_axis)))
    }

    /// The factor on what gets through.
    fn tint(&self, wavelength: usize) -> f64 {
        self.over.tint.get(wavelength).copied().unwrap_or(1.0)
    }

    /// What sheen leaves of what is under it.
    fn under_sheen(&self, wo: DVec3, wi: DVec3) -> f64 {
        self.over.sheen.as_ref().map_or(1.0, |(sheen, _)| sheen.over(wo.z, wi.z.abs()))
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
            for wavelength in &mut o.wavelengths {
                wavelength.beta *= factor * self.through_coat(wi, number_of(wavelength, wavelengths));
            }
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
        let mut by_geometry = self.bsdf.sample(&self.over, frame.transpose() * self.came_from, wavelengths, rng);
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
        let Some((sheen, color)) = &self.over.sheen else {
            let mut out = self.bsdf.sample(&self.over, wo, wavelengths, rng);
            out.iter_mut().flat_map(|o| &mut o.wavelengths).for_each(|wavelength| wavelength.beta *= self.of_part);
            return out;
        };
        let own = mean(color) * sheen.albedo(wo.z).min(1.0);
        let q = (own / (own + sheen.transmittance(wo.z)).max(1e-6)).clamp(0.05, 0.95);
        if rng.next() < q {
            let wi = sample_cosine(rng.next2());
            let weight = sheen.eval(wo, wi) * PI / (wi.z * q);
            let wavelengths = wavelengths.iter().zip(color).map(|(l, c)| l.times(c * weight)).collect();
            return vec![Outgoing { wi, wavelengths, transmitted: false }];
        }
        let mut out = self.bsdf.sample(&self.over, wo, wavelengths, rng);
        for o in &mut out {
            let weight = self.under_sheen(wo, o.wi) * self.of_part / (1.0 - q);
            o.wavelengths.iter_mut().for_each(|wavelength| wavelength.beta *= weight);
        }
        out
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

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
