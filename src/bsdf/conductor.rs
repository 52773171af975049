//! Rough metal: GGX with visible normals, and a lobe for what single scattering loses (Kulla & Conty 2017; Hill 2018 for the colour):
//! `f_ms = F_ms (1 - E(mu_i)) (1 - E(mu_o)) / (pi (1 - E_avg))`, `F_ms = F_avg^2 E_avg / (1 - F_avg (1 - E_avg))`.

use super::energy::{EnergyTable, MIN_MEAN};
use super::fresnel::{self, Metal};
use super::ggx::{self, Width};
use super::sample_cosine;
use glam::DVec3;
use std::f64::consts::PI;

/// A rough metal surface; the Fresnel reflectance is left to the caller, who may carry many wavelengths.
#[derive(Debug, Clone, Copy)]
pub struct RoughConductor<'a> {
    /// GGX width.
    pub alpha: Width,
    /// The mirror's table of `alpha`.
    pub energy: &'a EnergyTable,
}

/// A direction with the factor common to all wavelengths; each multiplies it by its own `reflectance`.
#[derive(Debug, Clone, Copy)]
pub struct ConductorSample {
    /// Where the particle goes.
    pub wi: DVec3,
    /// Factor on its flux, without the reflectance.
    pub weight: f64,
    /// Which reflectance applies.
    pub lobe: Lobe,
}

/// How the light left the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe {
    /// After one facet, at this cosine of incidence.
    Single(f64),
    /// After several.
    Multiple,
}

impl RoughConductor<'_> {
    fn share_lost(&self, wo: DVec3) -> f64 {
        if self.energy.mean_at(1.0) < MIN_MEAN { 0.0 } else { self.energy.missing_towards(wo) }
    }

    /// Density of the scattered particle per solid angle of `wi`, for a metal of this [`reflectance`](Self::reflectance).
    pub fn eval(&self, wo: DVec3, wi: DVec3, reflectance: impl Fn(Lobe) -> f64) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let m = (wo + wi).normalize();
        let single = ggx::d(self.alpha, m) * ggx::g2(self.alpha, wo, wi) / (4.0 * wo.z);
        let lost = self.share_lost(wo);
        let multiple =
            if lost > 0.0 { lost * self.energy.missing_towards(wi) / self.energy.mean_at(1.0) * wi.z / PI } else { 0.0 };
        single * reflectance(Lobe::Single(wo.dot(m))) + multiple * reflectance(Lobe::Multiple)
    }

    /// Density with which [`sample`](Self::sample) takes `wi`, per solid angle.
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let m = (wo + wi).normalize();
        let lost = self.share_lost(wo);
        (1.0 - lost) * ggx::pdf_vndf(self.alpha, wo, m) / (4.0 * wo.dot(m)) + lost * wi.z / PI
    }

    /// Scatters a particle, or absorbs it. `u` are three uniform numbers.
    pub fn sample(&self, wo: DVec3, u: [f64; 3]) -> Option<ConductorSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let lost = self.share_lost(wo);
        if u[2] < lost {
            let wi = sample_cosine([u[0], u[1]]);
            let weight = self.energy.missing_towards(wi) / self.energy.mean_at(1.0);
            return Some(ConductorSample { wi, weight, lobe: Lobe::Multiple });
        }
        let m = ggx::sample_vndf(self.alpha, wo, [u[0], u[1]]);
        let wi = fresnel::reflect(wo, m);
        if wi.z <= 0.0 {
            return None;
        }
        let weight = ggx::g2(self.alpha, wo, wi) / (ggx::g1(self.alpha, wo) * (1.0 - lost));
        Some(ConductorSample { wi, weight, lobe: Lobe::Single(wo.dot(m)) })
    }

    /// The reflectance of a lobe for this metal.
    pub fn reflectance(&self, lobe: Lobe, metal: Metal) -> f64 {
        match lobe {
            Lobe::Single(cos) => metal.at(cos),
            Lobe::Multiple => {
                let (f, lost) = (metal.average(), self.energy.mean_at(1.0));
                f * f * (1.0 - lost) / (1.0 - f * lost)
            }
        }
    }
}
