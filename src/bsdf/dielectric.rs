//! Rough dielectric: Walter et al. 2007 with visible normals, and a reciprocal lobe for what single scattering loses.
//!
//! Seen from side `a` (near) with `eta = n_b / n_a`, the lobe of lost light scatters a particle that arrives at cosine `mu_i` with
//! `g_aa = r_a m_a(mu_i) m_a(mu_o) / (pi M_a)` back and `g_ab = tau_ab m_a(mu_i) m_b(mu_o) / (pi M_b)` through (per projected solid angle),
//! `tau_ab = n_b^2 M_b / (n_a^2 M_a + n_b^2 M_b)`, `r_a = 1 - tau_ab`. Then `n_a^2 g_ab = n_b^2 g_ba`, and what is lost returns exactly.

use super::energy::{EnergyTable, MIN_MEAN};
use super::{fresnel, ggx, sample_cosine};
use glam::DVec3;
use std::f64::consts::PI;

/// A rough interface as seen from the side of `wi`.
#[derive(Debug, Clone, Copy)]
pub struct RoughDielectric<'a> {
    /// GGX width.
    pub alpha: f64,
    /// Far index over near index; not 1.
    pub eta: f64,
    /// The table of `alpha`.
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
    fn share_lost(&self, wi: DVec3) -> f64 {
        self.energy.missing_at(wi.z, self.eta)
    }

    /// Loss at the far or near side's cosine of `wo`, over its mean.
    fn relative_loss(&self, lost: &Lost, wo: DVec3) -> f64 {
        if wo.z > 0.0 {
            self.energy.missing_at(wo.z, self.eta) / lost.mean_near
        } else {
            self.energy.missing_at(-wo.z, 1.0 / self.eta) / lost.mean_far
        }
    }

    /// The facet that turns `wi` into `wo`, its cosines with both, and the Jacobian `d m / d wo` (Walter 2007, eqs. 13-17).
    fn facet(&self, wi: DVec3, wo: DVec3) -> Option<(DVec3, f64)> {
        if wo.z > 0.0 {
            let m = (wi + wo).normalize();
            return Some((m, 1.0 / (4.0 * wi.dot(m))));
        }
        let h = -(wi + wo * self.eta);
        let m = if h.z > 0.0 { h } else { -h }.normalize();
        let (ci, co) = (wi.dot(m), wo.dot(m));
        if ci <= 0.0 || co >= 0.0 {
            return None;
        }
        let q = ci + self.eta * co;
        Some((m, self.eta * self.eta * -co / (q * q)))
    }

    /// Density of the scattered particle per solid angle of `wo`.
    pub fn eval(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wi.z <= 0.0 || wo.z == 0.0 {
            return 0.0;
        }
        let mut g = 0.0;
        if let Some((m, jacobian)) = self.facet(wi, wo) {
            let f = fresnel::dielectric(wi.dot(m), self.eta);
            let share = if wo.z > 0.0 { f } else { 1.0 - f };
            g += share * wi.dot(m) * ggx::d(self.alpha, m) * ggx::g2(self.alpha, wi, wo) * jacobian / wi.z;
        }
        if let Some(lost) = self.lost() {
            let side = if wo.z > 0.0 { 1.0 - lost.tau } else { lost.tau };
            g += self.share_lost(wi) * side * self.relative_loss(&lost, wo) * wo.z.abs() / PI;
        }
        g
    }

    /// Density with which [`sample`](Self::sample) takes `wo`, per solid angle. It integrates to 1 less the facets whose light goes under.
    pub fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wi.z <= 0.0 || wo.z == 0.0 {
            return 0.0;
        }
        let lost = self.lost();
        let share_lost = if lost.is_some() { self.share_lost(wi) } else { 0.0 };
        let mut pdf = 0.0;
        if let Some((m, jacobian)) = self.facet(wi, wo) {
            let f = fresnel::dielectric(wi.dot(m), self.eta);
            let share = if wo.z > 0.0 { f } else { 1.0 - f };
            pdf += (1.0 - share_lost) * share * ggx::pdf_vndf(self.alpha, wi, m) * jacobian;
        }
        if let Some(lost) = lost {
            let side = if wo.z > 0.0 { 1.0 - lost.tau } else { lost.tau };
            pdf += share_lost * side * wo.z.abs() / PI;
        }
        pdf
    }

    /// Scatters a particle: its new direction and the factor on its flux, or `None` if it is absorbed. `u` are four uniform numbers.
    pub fn sample(&self, wi: DVec3, u: [f64; 4]) -> Option<(DVec3, f64)> {
        if wi.z <= 0.0 {
            return None;
        }
        let lost = self.lost();
        let share_lost = if lost.is_some() { self.share_lost(wi) } else { 0.0 };
        if let Some(lost) = lost.filter(|_| u[2] < share_lost) {
            let mut wo = sample_cosine([u[0], u[1]]);
            if u[3] < lost.tau {
                wo.z = -wo.z;
            }
            return Some((wo, self.relative_loss(&lost, wo)));
        }
        let m = ggx::sample_vndf(self.alpha, wi, [u[0], u[1]]);
        let reflected = u[3] < fresnel::dielectric(wi.dot(m), self.eta);
        let wo = if reflected { fresnel::reflect(wi, m) } else { fresnel::refract(wi, m, self.eta)? };
        if (wo.z > 0.0) != reflected || wo.z == 0.0 {
            return None;
        }
        Some((wo, ggx::g2(self.alpha, wi, wo) / (ggx::g1(self.alpha, wi) * (1.0 - share_lost))))
    }
}
