//! Sheen: the soft rim of light on cloth, by fibres that stand away from the surface (Estevez & Kulla, "Production Friendly Microfacet Sheen BRDF", 2017, the
//! model of KHR_materials_sheen). Facets are spread by a power of the sine of their slope, and shadow each other by a fit of theirs.
//!
//! With `E(mu)` the albedo for light at cosine `mu`, the published formula makes light at grazing angles if the sheen is narrow: below a roughness of 0.3
//! `E` passes 1. Divided by `max(1, E(mu_i), E(mu_o))` it stays reciprocal and never does; where `E` keeps below 1 it is as published.
//!
//! What lies below is scaled by `min(T(mu_i), T(mu_o))`, `T(mu) = 1 - c min(1, E(mu))` (KHR_materials_sheen's albedo scaling): reciprocal, and no more than
//! what is left. `c` is the greatest value of the sheen's colour at any wavelength, so that what lies below keeps its hue.

use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Nodes of the albedo, at `((j + 1/2) / NODES)^2` in the cosine: near grazing incidence it changes fast. Between them it is off by 7e-4 at most, at normal
/// incidence, where the fit is steep, too large by up to 5e-3.
pub const NODES: usize = 64;
/// Least width of sheen, a roughness of 0.07: narrower ones are grains of single precision.
pub const LEAST: f64 = 0.005;
/// Steps of the albedo's quadrature, in the root of the cosine and in the azimuth.
const STEPS: usize = 128;

/// The sheen of a surface, but for its colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheen {
    /// Width, the square of a roughness, in [`LEAST`] to 1.
    alpha: f64,
    /// `c`.
    most: f64,
    /// a, b, c, d, e of the fit for this width.
    fit: [f64; 5],
    /// `E` at the nodes.
    albedo: Vec<f64>,
}

impl Sheen {
    /// Sheen of this width and greatest colour.
    pub fn new(alpha: f64, most: f64) -> Self {
        // Their table 1, for widths 0 and 1; between them by the square of 1 - alpha.
        const NARROW: [f64; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
        const WIDE: [f64; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
        let t = (1.0 - alpha) * (1.0 - alpha);
        let fit = std::array::from_fn(|i| t * NARROW[i] + (1.0 - t) * WIDE[i]);
        let mut sheen = Sheen { alpha, most, fit, albedo: vec![0.0; NODES] };
        sheen.albedo = (0..NODES).into_par_iter().map(|j| sheen.integrate(((j as f64 + 0.5) / NODES as f64).powi(2))).collect();
        sheen
    }

    /// The published formula for a colour of 1, per solid angle of `wi`, its cosine included.
    fn published(&self, wo: DVec3, wi: DVec3) -> f64 {
        let m = (wo + wi).normalize();
        let sine = m.x.hypot(m.y).min(1.0);
        let d = (2.0 + 1.0 / self.alpha) * sine.powf(1.0 / self.alpha) / (2.0 * PI);
        d / (4.0 * wo.z * (1.0 + self.lambda(wo.z) + self.lambda(wi.z)))
    }

    /// Smith's auxiliary function (their eq. 3).
    fn lambda(&self, mu: f64) -> f64 {
        let [a, b, c, d, e] = self.fit;
        let l = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
        if mu < 0.5 { l(mu).exp() } else { (2.0 * l(0.5) - l(1.0 - mu)).exp() }
    }

    /// `E`, by the midpoint rule.
    fn integrate(&self, mu: f64) -> f64 {
        let wo = DVec3::new(((1.0 - mu) * (1.0 + mu)).sqrt(), 0.0, mu);
        let mut sum = 0.0;
        for i in 0..STEPS {
            // The cosine is x^2, so that steps are fine where the shadows end.
            let x = (i as f64 + 0.5) / STEPS as f64;
            let z = x * x;
            let r = ((1.0 - z) * (1.0 + z)).sqrt();
            for k in 0..STEPS {
                let phi = PI * (k as f64 + 0.5) / STEPS as f64;
                sum += 2.0 * x * self.published(wo, DVec3::new(r * phi.cos(), r * phi.sin(), z));
            }
        }
        sum * 2.0 * PI / (STEPS * STEPS) as f64
    }

    /// `E(mu)`: linear in the root of the cosine, constant beyond the first and last node.
    pub fn albedo(&self, mu: f64) -> f64 {
        let x = (mu.max(0.0).sqrt() * NODES as f64 - 0.5).clamp(0.0, (NODES - 1) as f64);
        let j = (x as usize).min(NODES - 2);
        self.albedo[j] + (self.albedo[j + 1] - self.albedo[j]) * (x - j as f64)
    }

    /// Density of what it scatters for a colour of 1, per solid angle of `wi`.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        self.published(wo, wi) / self.albedo(wo.z).max(self.albedo(wi.z)).max(1.0)
    }

    /// `T(mu)`.
    pub fn transmittance(&self, mu: f64) -> f64 {
        1.0 - self.most * self.albedo(mu).min(1.0)
    }

    /// What is left of light in and out at these cosines for what lies below.
    pub fn over(&self, mu_i: f64, mu_o: f64) -> f64 {
        self.transmittance(mu_i).min(self.transmittance(mu_o))
    }

    /// What the shaders read: the albedo, and then what sheen.wgsl calls the numbers after it.
    pub fn entries(&self) -> Vec<f64> {
        let numbers = [0.5 / self.alpha, (2.0 + 1.0 / self.alpha) / (8.0 * PI), self.most];
        [self.albedo.as_slice(), &numbers, &self.fit].concat()
    }
}
