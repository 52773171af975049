//! The Henyey-Greenstein phase function (Henyey & Greenstein 1941).

use glam::DVec3;
use std::f64::consts::PI;

/// Density per solid angle for the cosine between the directions of travel before and after; `g` in (-1, 1), positive forward.
pub fn eval_hg(cos: f64, g: f64) -> f64 {
    // (1-g)^2 + 2g(1-cos) = 1 + g^2 - 2 g cos, positive for any rounding of the cosine.
    let q = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cos.clamp(-1.0, 1.0));
    (1.0 - g) * (1.0 + g) / (4.0 * PI * q * q.sqrt())
}

/// Probability density of [`sample_hg`], which samples the function exactly.
pub fn pdf_hg(cos: f64, g: f64) -> f64 {
    eval_hg(cos, g)
}

/// A new direction of travel after `dir`, from two uniform numbers.
pub fn sample_hg(dir: DVec3, g: f64, u: [f64; 2]) -> DVec3 {
    let x = 2.0 * u[0] - 1.0;
    let cos = if g.abs() < 1e-4 {
        // The limit to second order; the inversion below would divide by g.
        x + 1.5 * g * (1.0 - x * x)
    } else {
        let s = (1.0 - g) * (1.0 + g) / (1.0 + g * x);
        (1.0 + g * g - s * s) / (2.0 * g)
    };
    let cos = cos.clamp(-1.0, 1.0);
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    let phi = 2.0 * PI * u[1];
    let (a, b) = dir.any_orthonormal_pair();
    (a * (sin * phi.cos()) + b * (sin * phi.sin()) + dir * cos).normalize()
}
