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
    pub wo: DVec3,
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
    fn share_lost(&self, wi: DVec3) -> f64 {
        if self.energy.mean_at(1.0) < MIN_MEAN { 0.0 } else { self.energy.missing_towards(wi) }
    }

    /// Density of the scattered particle per solid angle of `wo`, for a metal of this [`reflectance`](Self::reflectance).
    pub fn eval(&self, wi: DVec3, wo: DVec3, reflectance: impl Fn(Lobe) -> f64) -> f64 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let m = (wi + wo).normalize();
        let single = ggx::d(self.alpha, m) * ggx::g2(self.alpha, wi, wo) / (4.0 * wi.z);
        let lost = self.share_lost(wi);
        let multiple =
            if lost > 0.0 { lost * self.energy.missing_towards(wo) / self.energy.mean_at(1.0) * wo.z / PI } else { 0.0 };
        single * reflectance(Lobe::Single(wi.dot(m))) + multiple * reflectance(Lobe::Multiple)
    }

    /// Density with which [`sample`](Self::sample) takes `wo`, per solid angle.
    pub fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return 0.0;
        }
        let m = (wi + wo).normalize();
        let lost = self.share_lost(wi);
        (1.0 - lost) * ggx::pdf_vndf(self.alpha, wi, m) / (4.0 * wi.dot(m)) + lost * wo.z / PI
    }

    /// Scatters a particle, or absorbs it. `u` are three uniform numbers.
    pub fn sample(&self, wi: DVec3, u: [f64; 3]) -> Option<ConductorSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let lost = self.share_lost(wi);
        if u[2] < lost {
            let wo = sample_cosine([u[0], u[1]]);
            let weight = self.energy.missing_towards(wo) / self.energy.mean_at(1.0);
            return Some(ConductorSample { wo, weight, lobe: Lobe::Multiple });
        }
        let m = ggx::sample_vndf(self.alpha, wi, [u[0], u[1]]);
        let wo = fresnel::reflect(wi, m);
        if wo.z <= 0.0 {
            return None;
        }
        let weight = ggx::g2(self.alpha, wi, wo) / (ggx::g1(self.alpha, wi) * (1.0 - lost));
        Some(ConductorSample { wo, weight, lobe: Lobe::Single(wi.dot(m)) })
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
