//! CIE tristimulus values of emission, by quadrature that misses no line.

use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Cmf, Observer};

/// Luminous efficacy K_m, lm W^-1 (683 lm/W at 540 THz, which is 555.017 nm in air; CIE 018:2019).
pub const K_M: f64 = 683.002;

/// XYZ of a spectral radiance in W m^-2 sr^-1 nm^-1: `K_m` times the integral over the observer's range (360 to 830 nm). Y is the luminance
/// in cd m^-2 (for irradiance, the illuminance in lx, and so on).
pub fn xyz_of(spectrum: &Spectrum, observer: Observer) -> [f64; 3] {
    let cmf = library::observer(observer);
    let (Some(&lo), Some(&hi)) = (cmf.nm.first(), cmf.nm.last()) else {
        return [0.0; 3];
    };
    let mut cuts = cmf.nm.clone();
    spectrum.breakpoints(lo, hi, &mut cuts);
    cuts.sort_by(f64::total_cmp);
    let mut xyz = [0.0; 3];
    for piece in cuts.windows(2) {
        // Three-point Gauss-Legendre: exact for the product of two piecewise linear functions, and blind to what a rectangle is at its edge.
        let (mid, half) = (0.5 * (piece[0] + piece[1]), 0.5 * (piece[1] - piece[0]));
        let d = half * 0.6f64.sqrt();
        for (nm, weight) in [(mid - d, 5.0), (mid, 8.0), (mid + d, 5.0)] {
            let s = spectrum.eval(nm) * weight * half / 9.0;
            let bar = cmf.eval(nm);
            for i in 0..3 {
                xyz[i] += K_M * s * bar[i];
            }
        }
    }
    xyz
}

/// XYZ of the equal-energy spectrum of 1 W m^-2 sr^-1 nm^-1, cd m^-2.
pub fn xyz_of_unit(observer: Observer) -> [f64; 3] {
    integral(library::observer(observer), 0.0, f64::INFINITY).map(|v| K_M * v)
}

/// Integral of the colour-matching functions over `[lo, hi]` nm, exact for their linear pieces.
pub(super) fn integral(cmf: &Cmf, lo: f64, hi: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    // The first piece that ends beyond lo.
    let first = cmf.nm.partition_point(|&x| x <= lo).saturating_sub(1);
    for k in first..cmf.nm.len().saturating_sub(1) {
        let (a, b) = (cmf.nm[k].max(lo), cmf.nm[k + 1].min(hi));
        if cmf.nm[k] >= hi {
            break;
        }
        if b > a {
            // A linear function times its width, at the middle; the last point is reached only from below.
            let bar = cmf.eval(0.5 * (a + b));
            for i in 0..3 {
                sum[i] += (b - a) * bar[i];
            }
        }
    }
    sum
}

/// Chromaticity x, y; (0, 0) for black.
pub fn xy(xyz: [f64; 3]) -> [f64; 2] {
    let sum = xyz[0] + xyz[1] + xyz[2];
    if sum == 0.0 { [0.0; 2] } else { [xyz[0] / sum, xyz[1] / sum] }
}
