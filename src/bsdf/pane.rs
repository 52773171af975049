//! A thin pane, seen as one surface: what it reflects and lets through with all inner bounces. Of light at cosine `mu` its faces reflect the share `r` each,
//! and a way through it leaves the share `t = exp(-depth / mu_t)`, `mu_t` being the cosine inside. The bounces add up to
//! `R = r + (1 - r)^2 r t^2 / (1 - r^2 t^2)` and `T = (1 - r)^2 t / (1 - r^2 t^2)`, in clear glass `2 r / (1 + r)` and the rest. A soap film interferes instead
//! ([`super::thin_film`]), and films on both faces change their `r`.
//!
//! A rough pane spreads both around where a smooth one sends them, by facets that are mirrors ([`super::conductor`], which gives back what single scattering
//! loses): of what these reflect, the share `R` at the facet stays on its side, and `T` is thrown to the other, mirrored in the pane. (This is how
//! KHR_materials_transmission has it.) Both are reciprocal, as `R` and `T` know the angle at the facet alone, and a clear pane loses no light.

use super::conductor::RoughConductor;
use super::fresnel;
use super::thin_film::Stack;
use glam::DVec3;

/// A pane at one wavelength.
#[derive(Debug, Clone, Copy)]
pub struct Pane {
    /// Index relative to the surroundings.
    pub eta: f64,
    /// Optical depth at normal incidence.
    pub depth: f64,
    /// A film on its faces, or that it is itself.
    pub film: Option<PaneFilm>,
}

/// What interferes in a pane.
#[derive(Debug, Clone, Copy)]
pub enum PaneFilm {
    /// The pane itself.
    Whole(Stack),
    /// A layer on both its faces.
    OnFaces(Stack),
}

impl Pane {
    /// The shares reflected and let through at this cosine of incidence.
    pub fn shares(&self, cos_i: f64) -> [f64; 2] {
        if let Some(PaneFilm::Whole(film)) = self.film {
            let reflected = film.reflectance(cos_i);
            return [reflected, 1.0 - reflected];
        }
        let Some(cos_t) = fresnel::cos_transmitted(cos_i, self.eta).filter(|cos| *cos > 0.0) else { return [1.0, 0.0] };
        let r = match self.film {
            Some(PaneFilm::OnFaces(film)) => film.reflectance(cos_i),
            _ => fresnel::dielectric(cos_i, self.eta),
        };
        let t = (-self.depth / cos_t).exp();
        if r == 1.0 {
            return [1.0, 0.0];
        }
        let out = (1.0 - r) * (1.0 - r) * t / (1.0 - r * r * t * t);
        [r + out * r * t, out]
    }
}

/// A rough pane; what its facets reflect and let through is left to the caller, who may carry many wavelengths.
#[derive(Debug, Clone, Copy)]
pub struct RoughPane<'a> {
    /// Its facets.
    pub facets: RoughConductor<'a>,
}

impl RoughPane<'_> {
    /// Density of the scattered particle per solid angle of `wi`, on either side.
    pub fn eval(&self, wo: DVec3, wi: DVec3, pane: &Pane) -> f64 {
        let mirrored = wi.with_z(wi.z.abs());
        if wo.z <= 0.0 || mirrored.z == 0.0 {
            return 0.0;
        }
        let share = pane.shares(facet_cosine(wo, mirrored))[usize::from(wi.z < 0.0)];
        self.facets.eval(wo, mirrored, |_| share)
    }

    /// Density with which [`sample`](Self::sample) takes `wi`, per solid angle, for these probabilities of reflection.
    pub fn pdf(&self, wo: DVec3, wi: DVec3, reflection: impl Fn(f64) -> f64) -> f64 {
        let mirrored = wi.with_z(wi.z.abs());
        if wo.z <= 0.0 || mirrored.z == 0.0 {
            return 0.0;
        }
        let q = reflection(facet_cosine(wo, mirrored));
        self.facets.pdf(wo, mirrored) * if wi.z > 0.0 { q } else { 1.0 - q }
    }

    /// Scatters a particle: its direction, the factor on its flux but for the pane's share over the probability of that side, and the cosine at the facet.
    /// `reflection` is the probability of reflection at a cosine; `u` are four uniform numbers.
    pub fn sample(&self, wo: DVec3, reflection: impl Fn(f64) -> f64, u: [f64; 4]) -> Option<(DVec3, f64, f64)> {
        let mut wi = self.facets.sample(wo, [u[0], u[1], u[2]])?.wi;
        let (cos, pdf) = (facet_cosine(wo, wi), self.facets.pdf(wo, wi));
        let weight = self.facets.eval(wo, wi, |_| 1.0) / pdf;
        if u[3] >= reflection(cos) {
            wi.z = -wi.z;
        }
        Some((wi, weight, cos))
    }
}

/// Cosine at the facet that reflects `wo` to `wi`.
fn facet_cosine(wo: DVec3, wi: DVec3) -> f64 {
    wo.dot((wo + wi).normalize()).clamp(0.0, 1.0)
}
