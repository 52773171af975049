//! The GGX distribution of facets with Smith's height-correlated shadowing (Walter et al. 2007; Heitz 2014).

use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// Width of the distribution along x and along y of the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
}

impl From<f64> for Width {
    fn from(alpha: f64) -> Self {
        Width { x: alpha, y: alpha }
    }
}

/// Density of facet normals `m` per solid angle and projected area (Heitz 2014, eq. 85), for unit `m`; 0 below the horizon.
pub fn d(alpha: impl Into<Width>, m: DVec3) -> f64 {
    if m.z <= 0.0 {
        return 0.0;
    }
    let a = alpha.into();
    // Written with the sine, which keeps its digits near the peak where 1 - cos^2 would lose them.
    let (x, y) = (m.x / a.x, m.y / a.y);
    let q = x * x + y * y + m.z * m.z;
    1.0 / (PI * a.x * a.y * q * q)
}

/// Smith's auxiliary function for a direction on either side (Heitz 2014, eqs. 72 and 80).
pub fn lambda(alpha: impl Into<Width>, w: DVec3) -> f64 {
    let a = alpha.into();
    let (across, along) = (a.x * w.x, a.y * w.y);
    let x = (across * across + along * along) / (w.z * w.z);
    // (sqrt(1 + x) - 1) / 2 without cancellation.
    0.5 * x / (1.0 + (1.0 + x).sqrt())
}

/// Share of facets seen from `w` that are not hidden.
pub fn g1(alpha: impl Into<Width>, w: DVec3) -> f64 {
    1.0 / (1.0 + lambda(alpha, w))
}

/// Share of facets seen from both directions, for reflection and for transmission.
pub fn g2(alpha: impl Into<Width>, wo: DVec3, wi: DVec3) -> f64 {
    let alpha = alpha.into();
    1.0 / (1.0 + lambda(alpha, wo) + lambda(alpha, wi))
}

/// Density of the facets that `wo` sees, per solid angle of `m` (Heitz 2014, eq. 15).
pub fn pdf_vndf(alpha: impl Into<Width>, wo: DVec3, m: DVec3) -> f64 {
    let alpha = alpha.into();
    g1(alpha, wo) * wo.dot(m).max(0.0) * d(alpha, m) / wo.z
}

/// A facet that `wo` sees (`wo.z > 0`), from two uniform numbers: a spherical cap in the stretched space (Dupuy & Benyoub 2023, listing 3).
pub fn sample_vndf(alpha: impl Into<Width>, wo: DVec3, u: [f64; 2]) -> DVec3 {
    let a = alpha.into();
    let stretched = dvec3(wo.x * a.x, wo.y * a.y, wo.z).normalize();
    let phi = 2.0 * PI * u[0];
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let h = dvec3(r * phi.cos(), r * phi.sin(), z) + stretched;
    // h.z vanishes only where u and wo lie both on the horizon; a facet on edge is never lit.
    dvec3(h.x * a.x, h.y * a.y, h.z.max(1e-300)).normalize()
}
