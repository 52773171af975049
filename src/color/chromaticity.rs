//! What a chromaticity says of a light: its dominant wavelength, and the temperature of the blackbody that it is like.

use super::cie::{xy, xyz_of};
use super::convert::{linear_srgb_of_xyz, srgb_encode};
use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Observer};

/// Chromaticity of the equal-energy spectrum.
const EQUAL_ENERGY: [f64; 2] = [1.0 / 3.0, 1.0 / 3.0];
/// Wavelengths of the spectral locus, nm; beyond, it hardly moves.
const LOCUS_NM: (f64, f64) = (380.0, 700.0);
/// Below this share of the way to the spectral locus a hue is rounding or noise.
const LEAST_PURITY: f64 = 0.01;

/// A hue as the wavelength that, mixed with equal-energy white, gives it (CIE 15:2004, section 8.4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dominant {
    /// Wavelength, nm.
    pub nm: f64,
    /// Of a purple, which no wavelength gives: `nm` is that of the complementary colour.
    pub complementary: bool,
    /// Share of the way from white to the spectral locus or the line of purples, 0 to 1 (excitation purity).
    pub purity: f64,
}

/// The dominant wavelength of the chromaticity x, y for the CIE 1931 observer; `None` for what is nearly white.
pub fn dominant_wavelength([x, y]: [f64; 2]) -> Option<Dominant> {
    let cmf = library::observer(Observer::Cie1931);
    let visible = |nm: &f64| (LOCUS_NM.0..=LOCUS_NM.1).contains(nm);
    let locus: Vec<(f64, [f64; 2])> =
        cmf.nm.iter().zip(&cmf.xyz).filter(|(nm, _)| visible(nm)).map(|(nm, bar)| (*nm, xy(*bar))).collect();
    let toward = [x - EQUAL_ENERGY[0], y - EQUAL_ENERGY[1]];
    // The wavelength at which a ray from white leaves through the locus, and how long it is by then.
    let leaves = |sign: f64| {
        locus.windows(2).find_map(|w| {
            let (along, length) = crossing(toward.map(|v| sign * v), w[0].1, w[1].1)?;
            Some((w[0].0 + along * (w[1].0 - w[0].0), length))
        })
    };
    let found = match (leaves(1.0), locus.first(), locus.last()) {
        (Some((nm, length)), ..) => Dominant { nm, complementary: false, purity: 1.0 / length },
        (None, Some(violet), Some(red)) => {
            let (_, length) = crossing(toward, violet.1, red.1)?;
            Dominant { nm: leaves(-1.0)?.0, complementary: true, purity: 1.0 / length }
        }
        _ => return None,
    };
    (found.purity >= LEAST_PURITY).then_some(Dominant { purity: found.purity.min(1.0), ..found })
}

/// Where the ray from white along `d` crosses the segment from `a` to `b`: the share of the segment, and the way in units of `d`.
fn crossing(d: [f64; 2], a: [f64; 2], b: [f64; 2]) -> Option<(f64, f64)> {
    let (a, b) = ([a[0] - EQUAL_ENERGY[0], a[1] - EQUAL_ENERGY[1]], [b[0] - EQUAL_ENERGY[0], b[1] - EQUAL_ENERGY[1]]);
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let side = [b[0] - a[0], b[1] - a[1]];
    let (along, length) = (cross(d, a) / cross(side, d), cross(a, side) / cross(d, side));
    ((0.0..=1.0).contains(&along) && length > 0.0).then_some((along, length))
}

/// sRGB of light of one wavelength: its hue, dim towards the ends of the visible. A screen has no such light: the part of it that it can show.
pub fn color_of_wavelength(nm: f64) -> [u8; 3] {
    let bar = library::observer(Observer::Cie1931).eval(nm);
    let rgb = linear_srgb_of_xyz(bar).map(|v| v.max(0.0));
    let max = rgb.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let brightness = (bar.iter().sum::<f64>() / 0.3).min(1.0);
    rgb.map(|v| (255.0 * srgb_encode(v / max * brightness)).round() as u8)
}

/// Correlated colour temperature: the blackbody next to the chromaticity x, y (CIE 1931) in the CIE 1960 diagram, its temperature in K and the
/// distance D_uv, positive above the Planckian locus. `None` beyond |D_uv| = 0.05, where it means nothing (CIE 15:2004, section 9.5), and
/// outside 1000 to 100,000 K.
pub fn correlated_color_temperature(xy_of_light: [f64; 2]) -> Option<(f64, f64)> {
    // In mired, 1e6 / K, the locus is passed at an even pace.
    const MIRED: (f64, f64) = (10.0, 1000.0);
    const STEPS: u32 = 33;
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let light = uv(xy_of_light);
    let locus = |mired: f64| uv(xy(xyz_of(&Spectrum::Blackbody { kelvin: 1e6 / mired, scale: 1.0 }, Observer::Cie1931)));
    let distance = |mired: f64| {
        let black = locus(mired);
        (black[0] - light[0]).hypot(black[1] - light[1])
    };
    let grid = |i: u32| MIRED.0 + (MIRED.1 - MIRED.0) * f64::from(i) / f64::from(STEPS);
    let nearest = (0..=STEPS).map(|i| (distance(grid(i)), i)).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    let (mut lo, mut hi) = (grid(nearest.saturating_sub(1)), grid((nearest + 1).min(STEPS)));
    while hi - lo > 1e-6 {
        let (a, b) = (hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo));
        if distance(a) < distance(b) { hi = b } else { lo = a }
    }
    let mired = 0.5 * (lo + hi);
    let duv = distance(mired).copysign(light[1] - locus(mired)[1]);
    let inside = mired > MIRED.0 + 1e-3 && mired < MIRED.1 - 1e-3;
    (inside && duv.abs() <= 0.05).then_some((1e6 / mired, duv))
}

/// CIE 1960 u, v.
fn uv([x, y]: [f64; 2]) -> [f64; 2] {
    let d = -2.0 * x + 12.0 * y + 3.0;
    [4.0 * x / d, 6.0 * y / d]
}
