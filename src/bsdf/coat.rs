//! A clear coat: a dielectric layer, smooth or rough, so thin that light leaves it where it came in.
//!
//! Of light at cosine `mu` the interface reflects the share `1 - T(mu)`: Fresnel's if smooth, else what one facet of GGX does; the rest, `T`, enters.
//! What lies below scatters it, and what of that the interface sends down again is scattered again, and so on:
//!
//! - over a diffuse base of reflectance `rho` light forgets between bounces where it came from, and the sum is exact,
//!   `f = T(mu_i) T(mu_o) rho / (pi (n^2 - rho (n^2 - T_avg)))` with `T_avg = 2 int T mu dmu`, since from below the share `T_avg / n^2` of diffuse light
//!   gets out (Saunderson 1942; with the `T` of a rough interface it is the coupling of Kelemen & Szirmay-Kalos 2001). Where `rho` is not the paint's own
//!   colour but the one that is seen, what the interface sends down is a part of it already: `f = T(mu_i) T(mu_o) rho / (pi T_avg)`;
//! - over a mirror of reflectance `r` it is `T(mu_i) T(mu_o) r / (1 - r + r max(T(mu_i), T(mu_o)))`, exact where both angles are the same.
//!
//! Both are reciprocal and never make light: a white base and a coat together reflect `1 - T + T = 1` (a rough mirror less).
//!
//! A coat may have another shading normal than what it lies on. What it reflects goes by its own, what lies below by that of what lies below, and of that the eye sees
//! `T(mu_c) / T(mu)` of what it would through a coat of the same normal, with its cosines to the coat's normal and the other: so that again all light is
//! reflected. Camera paths define that picture, and light paths are its adjoint, as with all shading normals ([`super::facet`]).

use super::energy::EnergyTable;
use super::{fresnel, ggx};
use glam::DVec3;

/// A coat at one wavelength, seen from outside.
#[derive(Debug, Clone, Copy)]
pub struct Coat<'a> {
    /// Index of the coat over that around it.
    pub eta: f64,
    /// GGX width and its [`EnergyTable::coat`]; none for a smooth coat.
    pub rough: Option<(f64, &'a EnergyTable)>,
    /// Is the colour of paint under it the one that is seen?
    pub seen: bool,
}

impl Coat<'_> {
    /// `T(mu)`: the share of light at this cosine that enters.
    pub fn transmittance(&self, mu: f64) -> f64 {
        match self.rough {
            Some((_, energy)) => energy.missing_at(mu, self.eta),
            None => 1.0 - fresnel::dielectric(mu, self.eta),
        }
    }

    /// `T_avg`: the share of uniform light that enters.
    pub fn mean_transmittance(&self) -> f64 {
        match self.rough {
            Some((_, energy)) => energy.mean_at(self.eta),
            None => 1.0 - fresnel::average_dielectric(self.eta),
        }
    }

    /// The factor on what an eye sees of what is below at cosine `mu_coat` to the coat's normal and `mu` to that of what is below.
    pub fn seen_from(&self, mu_coat: f64, mu: f64) -> f64 {
        if mu_coat == mu { 1.0 } else { self.transmittance(mu_coat) / self.transmittance(mu).max(1e-9) }
    }

    /// What takes the place of the reflectance `rho` of a diffuse base, for light in and out at these cosines.
    pub fn over_diffuse(&self, rho: f64, mu_i: f64, mu_o: f64) -> f64 {
        let mean = self.mean_transmittance();
        let n2 = if self.seen { mean } else { self.eta * self.eta };
        self.transmittance(mu_i) * self.transmittance(mu_o) * rho / (n2 - rho * (n2 - mean))
    }

    /// What takes the place of the reflectance `r` of a mirror or facet.
    pub fn over_mirror(&self, r: f64, mu_i: f64, mu_o: f64) -> f64 {
        let (i, o) = (self.transmittance(mu_i), self.transmittance(mu_o));
        let once = i * o * r;
        // Where all is reflected from outside nothing is left to divide.
        if once > 0.0 { once / (1.0 - r + r * i.max(o)) } else { 0.0 }
    }

    /// Density of what a rough coat itself reflects, per solid angle of `wi`; 0 if it is smooth.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        let Some((alpha, _)) = self.rough.filter(|_| wo.z > 0.0 && wi.z > 0.0) else { return 0.0 };
        let m = (wo + wi).normalize();
        ggx::d(alpha, m) * ggx::g2(alpha, wo, wi) / (4.0 * wo.z) * fresnel::dielectric(wo.dot(m), self.eta)
    }

    /// Where a facet (that of the normal, if the coat is smooth) reflects light to, with the factor on its flux but for Fresnel's, and the cosine at the
    /// facet. `u` are two uniform numbers.
    pub fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<(DVec3, f64, f64)> {
        let Some((alpha, _)) = self.rough else { return Some((fresnel::reflect(wo, DVec3::Z), 1.0, wo.z)) };
        let m = ggx::sample_vndf(alpha, wo, u);
        let wi = fresnel::reflect(wo, m);
        (wi.z > 0.0).then(|| (wi, ggx::g2(alpha, wo, wi) / ggx::g1(alpha, wo), wo.dot(m)))
    }
}
