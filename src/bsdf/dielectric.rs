//! Rough dielectric: Walter et al. 2007 with visible normals, and a reciprocal lobe for what single scattering loses.
//!
//! Seen from side `a` (near) with `eta = n_b / n_a`, the lobe of lost light scatters a particle that arrives at cosine `mu_i` with
//! `g_aa = r_a m_a(mu_i) m_a(mu_o) / (pi M_a)` back and `g_ab = tau_ab m_a(mu_i) m_b(mu_o) / (pi M_b)` through (per projected solid angle),
//! `tau_ab = n_b^2 M_b / (n_a^2 M_a + n_b^2 M_b)`, `r_a = 1 - tau_ab`. Then `n_a^2 g_ab = n_b^2 g_ba`, and what is lost returns exactly.

use super::energy::{EnergyTable, MIN_MEAN};
use super::{fresnel, ggx, sample_cosine};
use glam::DVec3;
use std::f64::consts::PI;

/// A rough interface as seen from the side of `wo`.
#[derive(Debug, Clone, Copy)]
pub struct RoughDielectric<'a> {
    /// GGX width.
    pub alpha: f64,
    /// Far index over near index; not 1.
    pub eta: f64,
    /// Reflectance of a facet at a cosine and this relative index: [`fresnel::dielectric`] or [`fresnel::antireflective`].
    pub reflectance: fn(f64, f64) -> f64,
    /// The table of `alpha` and that reflectance.
    pub energy: &'a EnergyTable,
}

/// The lobe of lost light for one side.
struct Lost {
    mean_near: f64,
    mean_far: f64,
    /// Share that goes through.
    tau: f64,
}

impl RoughDielectric<'_> {
    fn lost(&self) -> Option<Lost> {
        let (mean_near, mean_far) = (self.energy.mean_at(self.eta), self.energy.mean_at(1.0 / self.eta));
        if mean_near < MIN_MEAN || mean_far < MIN_MEAN {
            return None;
        }
        let far = self.eta * self.eta * mean_far;
        Some(Lost { mean_near, mean_far, tau: far / (mean_near + far) })
    }

    /// Probability of taking the lobe of lost light.
    fn share_lost(&self, wo: DVec3) -> f64 {
        self.energy.missing_at(wo.z, self.eta)
    }

    /// Loss at the far or near side's cosine of `wi`, over its mean.
    fn relative_loss(&self, lost: &Lost, wi: DVec3) -> f64 {
        if wi.z > 0.0 {
            self.energy.missing_at(wi.z, self.eta) / lost.mean_near
        } else {
            self.energy.missing_at(-wi.z, 1.0 / self.eta) / lost.mean_far
        }
    }

    /// The facet that turns `wo` into `wi`, its cosines with both, and the Jacobian `d m / d wi` (Walter 2007, eqs. 13-17).
    fn facet(&self, wo: DVec3, wi: DVec3) -> Option<(DVec3, f64)> {
        if wi.z > 0.0 {
            let m = (wo + wi).normalize();
            return Some((m, 1.0 / (4.0 * wo.dot(m))));
        }
        let h = -(wo + wi * self.eta);
        let m = if h.z > 0.0 { h } else { -h }.normalize();
        let (ci, co) = (wo.dot(m), wi.dot(m));
        if ci <= 0.0 || co >= 0.0 {
            return None;
        }
        let q = ci + self.eta * co;
        Some((m, self.eta * self.eta * -co / (q * q)))
    }

    /// Density of the scattered particle per solid angle of `wi`.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z == 0.0 {
            return 0.0;
        }
        let mut g = 0.0;
        if let Some((m, jacobian)) = self.facet(wo, wi) {
            let f = (self.reflectance)(wo.dot(m), self.eta);
            let share = if wi.z > 0.0 { f } else { 1.0 - f };
            g += share * wo.dot(m) * ggx::d(self.alpha, m) * ggx::g2(self.alpha, wo, wi) * jacobian / wo.z;
        }
        if let Some(lost) = self.lost() {
            let side = if wi.z > 0.0 { 1.0 - lost.tau } else { lost.tau };
            g += self.share_lost(wo) * side * self.relative_loss(&lost, wi) * wi.z.abs() / PI;
        }
        g
    }

    /// Density with which [`sample`](Self::sample) takes `wi`, per solid angle. It integrates to 1 less the facets whose light goes under.
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z == 0.0 {
            return 0.0;
        }
        let lost = self.lost();
        let share_lost = if lost.is_some() { self.share_lost(wo) } else { 0.0 };
        let mut pdf = 0.0;
        if let Some((m, jacobian)) = self.facet(wo, wi) {
            let f = (self.reflectance)(wo.dot(m), self.eta);
            let share = if wi.z > 0.0 { f } else { 1.0 - f };
            pdf += (1.0 - share_lost) * share * ggx::pdf_vndf(self.alpha, wo, m) * jacobian;
        }
        if let Some(lost) = lost {
            let side = if wi.z > 0.0 { 1.0 - lost.tau } else { lost.tau };
            pdf += share_lost * side * wi.z.abs() / PI;
        }
        pdf
    }

    /// Scatters a particle: its new direction and the factor on its flux, or `None` if it is absorbed. `u` are four uniform numbers.
    pub fn sample(&self, wo: DVec3, u: [f64; 4]) -> Option<(DVec3, f64)> {
        if wo.z <= 0.0 {
            return None;
        }
        let lost = self.lost();
        let share_lost = if lost.is_some() { self.share_lost(wo) } else { 0.0 };
        if let Some(lost) = lost.filter(|_| u[2] < share_lost) {
            let mut wi = sample_cosine([u[0], u[1]]);
            if u[3] < lost.tau {
                wi.z = -wi.z;
            }
            return Some((wi, self.relative_loss(&lost, wi)));
        }
        let m = ggx::sample_vndf(self.alpha, wo, [u[0], u[1]]);
        let reflected = u[3] < (self.reflectance)(wo.dot(m), self.eta);
        let wi = if reflected { fresnel::reflect(wo, m) } else { fresnel::refract(wo, m, self.eta)? };
        if (wi.z > 0.0) != reflected || wi.z == 0.0 {
            return None;
        }
        Some((wi, ggx::g2(self.alpha, wo, wi) / (ggx::g1(self.alpha, wo) * (1.0 - share_lost))))
    }
}
