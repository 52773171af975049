//! CIE tristimulus values of emission, by quadrature that misses no line.

use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Cmf, Observer};

/// Luminous efficacy K_m, lm W^-1 (683 lm/W at 540 THz, which is 555.017 nm in air; CIE 018:2019).
pub const K_M: f64 = 683.002;

/// The wavelengths that colours need, nm: beyond them the eye sees next to nothing.
pub const VISIBLE_NM: [f64; 2] = [380.0, 780.0];

/// Whether any of the wavelengths from `lo` to `hi` nm counts for colours.
pub fn is_visible(lo: f64, hi: f64) -> bool {
    hi > VISIBLE_NM[0] && lo < VISIBLE_NM[1]
}

/// What the wavelengths from `lo` to `hi` nm lack for colours; `None` if nothing.
pub fn lacks_for_colour(lo: f64, hi: f64) -> Option<String> {
    let [first, last] = VISIBLE_NM;
    // Channels of other programs name their centres to a thousandth of a nm.
    let shown = |nm: f64| (nm * 100.0).round() / 100.0;
    let (lo, hi) = (shown(lo), shown(hi));
    if !is_visible(lo, hi) {
        Some(format!("colours need {first} to {last} nm, of which there is nothing within {lo} to {hi} nm"))
    } else if lo > first || hi < last {
        Some(format!("colours need {first} to {last} nm, of which only {} to {} nm are there", lo.max(first), hi.min(last)))
    } else {
        None
    }
}

/// XYZ of a spectral radiance in W m^-2 sr^-1 nm^-1: `K_m` times the integral over the observer's range (360 to 830 nm). Y is the luminance
/// in cd m^-2 (for irradiance, the illuminance in lx, and so on).
pub fn xyz_of(spectrum: &Spectrum, observer: Observer) -> [f64; 3] {
    integral(library::observer(observer), spectrum, 0.0, f64::INFINITY).map(|v| K_M * v)
}

/// XYZ of the equal-energy spectrum of 1 W m^-2 sr^-1 nm^-1, cd m^-2.
pub fn xyz_of_unit(observer: Observer) -> [f64; 3] {
    xyz_of(&Spectrum::Constant(1.0), observer)
}

/// Integral of `spectrum` times the colour-matching functions over the part of `[lo, hi]` nm where they are known.
pub(super) fn integral(cmf: &Cmf, spectrum: &Spectrum, lo: f64, hi: f64) -> [f64; 3] {
    let (Some(&first), Some(&last)) = (cmf.nm.first(), cmf.nm.last()) else {
        return [0.0; 3];
    };
    let (lo, hi) = (lo.max(first), hi.min(last));
    if lo >= hi {
        return [0.0; 3];
    }
    let inner = cmf.nm.partition_point(|&nm| nm <= lo)..cmf.nm.partition_point(|&nm| nm < hi);
    let mut cuts = vec![lo, hi];
    cuts.extend(&cmf.nm[inner]);
    spectrum.breakpoints(lo, hi, &mut cuts);
    cuts.sort_by(f64::total_cmp);
    let mut sum = [0.0; 3];
    for piece in cuts.windows(2) {
        // Three-point Gauss-Legendre: exact for the product of two piecewise linear functions, and blind to what a rectangle is at its edge.
        let (mid, half) = (0.5 * (piece[0] + piece[1]), 0.5 * (piece[1] - piece[0]));
        let d = half * 0.6f64.sqrt();
        for (nm, weight) in [(mid - d, 5.0), (mid, 8.0), (mid + d, 5.0)] {
            let s = spectrum.eval(nm) * weight * half / 9.0;
            let bar = cmf.eval(nm);
            for i in 0..3 {
                sum[i] += s * bar[i];
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

/// XYZ, with Y = 1, of a chromaticity.
pub fn xyz_of_xy([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}
