//! The plain 8-bit sRGB picture of an XYZ image.

use super::cie::xyz_of_unit;
use super::convert::{linear_srgb_of_xyz, srgb_encode, xyz_of_linear_srgb};
use crate::spectrum::library::Observer;

/// Up to here the picture is proportional to light; above, highlights approach 1 smoothly.
const KNEE: f64 = 0.9;

/// Turns XYZ in cd m^-2 into sRGB, three bytes per pixel.
///
/// At `exposure` 0 stops white (1, 1, 1) is the luminance of the equal-energy spectrum of 1 W m^-2 sr^-1 nm^-1; each stop doubles. `None`
/// chooses it by [`auto_exposure`]. There is no chromatic adaptation: the picture's white is D65. Of colours outside the gamut the
/// negative components are cut off and the others scaled to keep the luminance: drawn towards grey instead, deep red would turn pink, and a
/// spectrum would show dark lines at the primaries. Where the largest component exceeds 0.9 the pixel is scaled down
/// so that it approaches 1, with its hue kept. What is not finite is black.
pub fn develop(xyz: &[[f32; 3]], exposure: Option<f64>) -> Vec<u8> {
    let stops = exposure.unwrap_or_else(|| auto_exposure(xyz));
    let gain = stops.exp2() / xyz_of_unit(Observer::Cie1931)[1];
    xyz.iter().flat_map(|p| encode(p.map(|v| f64::from(v) * gain))).collect()
}

/// The exposure, in stops, that brings the 99th percentile of luminance to 0.9.
///
/// Black pixels do not count: a spectrum on a dark wall is exposed for the spectrum. A few pixels of lamp over a lit scene must not darken it:
/// at most 6 times the 90th percentile counts, unless that is next to nothing (1/500) beside the 99th.
pub fn auto_exposure(xyz: &[[f32; 3]]) -> f64 {
    let mut luminance: Vec<f32> = xyz.iter().map(|p| p[1]).filter(|y| y.is_finite() && *y > 0.0).collect();
    if luminance.is_empty() {
        return 0.0;
    }
    let last = luminance.len() - 1;
    let mut percentile =
        |share: f64| f64::from(*luminance.select_nth_unstable_by((share * last as f64).round() as usize, f32::total_cmp).1);
    let (high, usual) = (percentile(0.99), percentile(0.90));
    let white = if usual * 500.0 < high { high } else { high.min(6.0 * usual) };
    (0.9 * xyz_of_unit(Observer::Cie1931)[1] / white).log2()
}

/// One pixel, XYZ with Y = 1 at white.
fn encode(xyz: [f64; 3]) -> [u8; 3] {
    let y = xyz[1];
    if !(xyz.iter().all(|v| v.is_finite()) && y > 0.0) {
        return [0; 3];
    }
    let rgb = linear_srgb_of_xyz(xyz);
    let cut = rgb.map(|v| v.max(0.0));
    let keep = if cut == rgb { 1.0 } else { y / xyz_of_linear_srgb(cut)[1] };
    let rgb = cut.map(|v| keep * v);
    let max = rgb.into_iter().fold(0.0, f64::max);
    let scale = if max > KNEE { (1.0 - (1.0 - KNEE) * (-(max - KNEE) / (1.0 - KNEE)).exp()) / max } else { 1.0 };
    rgb.map(|v| (255.0 * srgb_encode((v * scale).clamp(0.0, 1.0))).round() as u8)
}
