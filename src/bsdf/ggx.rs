//! The isotropic GGX distribution of facets with Smith's height-correlated shadowing (Walter et al. 2007; Heitz 2014).

use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// Density of facet normals `m` per solid angle and projected area (Walter 2007, eq. 33), for unit `m`; 0 below the horizon.
pub fn d(alpha: f64, m: DVec3) -> f64 {
    if m.z <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    // Written with the sine, which keeps its digits near the peak where 1 - cos^2 would lose them.
    let s2 = m.x * m.x + m.y * m.y;
    let q = s2 + a2 * m.z * m.z;
    a2 / (PI * q * q)
}

/// Smith's auxiliary function for a direction on either side (Heitz 2014, eq. 72).
pub fn lambda(alpha: f64, w: DVec3) -> f64 {
    let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    let x = alpha * alpha * tan2;
    // (sqrt(1 + x) - 1) / 2 without cancellation.
    0.5 * x / (1.0 + (1.0 + x).sqrt())
}

/// Share of facets seen from `w` that are not hidden.
pub fn g1(alpha: f64, w: DVec3) -> f64 {
    1.0 / (1.0 + lambda(alpha, w))
}

/// Share of facets seen from both directions, for reflection and for transmission.
pub fn g2(alpha: f64, wi: DVec3, wo: DVec3) -> f64 {
    1.0 / (1.0 + lambda(alpha, wi) + lambda(alpha, wo))
}

/// Density of the facets that `wi` sees, per solid angle of `m` (Heitz 2014, eq. 15).
pub fn pdf_vndf(alpha: f64, wi: DVec3, m: DVec3) -> f64 {
    g1(alpha, wi) * wi.dot(m).max(0.0) * d(alpha, m) / wi.z
}

/// A facet that `wi` sees (`wi.z > 0`), from two uniform numbers: a spherical cap in the stretched space (Dupuy & Benyoub 2023, listing 3).
pub fn sample_vndf(alpha: f64, wi: DVec3, u: [f64; 2]) -> DVec3 {
    let stretched = dvec3(wi.x * alpha, wi.y * alpha, wi.z).normalize();
    let phi = 2.0 * PI * u[0];
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let h = dvec3(r * phi.cos(), r * phi.sin(), z) + stretched;
    // h.z vanishes only where u and wi lie both on the horizon; a facet on edge is never lit.
    dvec3(h.x * alpha, h.y * alpha, h.z.max(1e-300)).normalize()
}
