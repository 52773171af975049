//! Spectra of lamps of which only a colour is known: daylight and white LEDs by colour temperature, any light by chromaticity.

use super::upsample::{coefficients, white};
use super::{cie, convert};
use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Observer};

/// Temperatures of daylight, K: those of the CIE's formula.
pub const DAYLIGHT_K: [f64; 2] = [4000.0, 25_000.0];
/// Temperatures of white LEDs, K: those that peak and band can have the colour of.
pub const WHITE_LED_K: [f64; 2] = [1800.0, 10_000.0];

/// A phase of daylight, 1 at 560 nm (CIE 15:2004, section 3.1): correlated colour temperature in K, within [`DAYLIGHT_K`]. D65 is 6504 K, since a
/// constant of Planck's law was measured better after it was named.
pub fn daylight(kelvin: f64) -> Spectrum {
    let t = 1e3 / kelvin;
    let x = match kelvin <= 7000.0 {
        true => 0.244_063 + t * (0.099_11 + t * (2.967_8 - t * 4.607_0)),
        false => 0.237_040 + t * (0.247_48 + t * (1.901_8 - t * 2.006_4)),
    };
    let y = -3.0 * x * x + 2.870 * x - 0.275;
    let m = 0.0241 + 0.2562 * x - 0.7341 * y;
    let [m1, m2] = [(-1.3515 - 1.7703 * x + 5.9114 * y) / m, (0.0300 - 31.4424 * x + 30.0717 * y) / m];
    let rows = library::daylight_components();
    let values: Vec<f64> = rows.iter().map(|[_, s0, s1, s2]| s0 + m1 * s1 + m2 * s2).collect();
    let spectrum = Spectrum::Table { nm: rows.iter().map(|row| row[0]).collect(), values, extend: false };
    let at_560 = spectrum.eval(560.0);
    spectrum.scaled(1.0 / at_560)
}

/// A white LED of a blue peak and a band of phosphor (Gaussians of 21 and 113 nm full width at half maximum, the first at 450 nm), whose chromaticity
/// is that of the blackbody of `kelvin`, within [`WHITE_LED_K`]; luminance of the constant 1. Real ones differ in peak and band: take a measured file where
/// colours matter.
pub fn white_led(kelvin: f64) -> Spectrum {
    const PEAK_NM: f64 = 450.0;
    const SIGMA_NM: [f64; 2] = [9.0, 48.0];
    let nm: Vec<f64> = (0..=400).map(|i| 300.0 + 2.0 * f64::from(i)).collect();
    let gauss = |nm: f64, center: f64, sigma: f64| (-0.5 * ((nm - center) / sigma).powi(2)).exp();
    let of = |[center, share]: [f64; 2]| {
        let value = |&nm: &f64| gauss(nm, PEAK_NM, SIGMA_NM[0]) + share.exp() * gauss(nm, center, SIGMA_NM[1]);
        Spectrum::Table { nm: nm.clone(), values: nm.iter().map(value).collect(), extend: false }
    };
    let xy = |spectrum: &Spectrum| cie::xy(cie::xyz_of(spectrum, Observer::Cie1931));
    // Newton's method for the band's centre and the logarithm of its height, from 5000 K on in small steps of the reciprocal temperature.
    let (mut at, mut mired) = ([571.3, -0.45], 200.0);
    let wanted = 1e6 / kelvin;
    loop {
        mired += (wanted - mired).clamp(-10.0, 10.0);
        let target = xy(&Spectrum::Blackbody { kelvin: 1e6 / mired, scale: 1.0 });
        for _ in 0..6 {
            let now = xy(&of(at));
            let slope = |i: usize, step: f64| {
                let mut there = at;
                there[i] += step;
                let there = xy(&of(there));
                [0, 1].map(|k| (there[k] - now[k]) / step)
            };
            let (a, b) = (slope(0, 1e-3), slope(1, 1e-5));
            let off = [target[0] - now[0], target[1] - now[1]];
            let det = a[0] * b[1] - a[1] * b[0];
            at[0] += (off[0] * b[1] - off[1] * b[0]) / det;
            at[1] += (a[0] * off[1] - a[1] * off[0]) / det;
        }
        if mired == wanted {
            break;
        }
    }
    let spectrum = of(at);
    let luminance = |spectrum: &Spectrum| cie::xyz_of(spectrum, Observer::Cie1931)[1];
    let factor = luminance(&Spectrum::Constant(1.0)) / luminance(&spectrum);
    spectrum.scaled(factor)
}

/// A smooth spectrum of the chromaticity x, y (CIE 1931, 2 degrees) and the luminance of the constant 1: [`white`] times a sigmoid.
///
/// Errors where no light or no such spectrum has that colour.
pub fn of_chromaticity([x, y]: [f64; 2]) -> Result<Spectrum, String> {
    if !(x >= 0.0 && y > 0.0 && x + y <= 1.0) {
        return Err(format!("no light has the chromaticity {x}, {y}"));
    }
    let rgb = convert::linear_srgb_of_xyz(cie::xyz_of_xy([x, y]));
    let greatest = rgb.into_iter().fold(0.0, f64::max);
    let wanted = rgb.map(|v| 0.5 * v / greatest);
    let c = coefficients(wanted);
    let sigmoid = Spectrum::Sigmoid { c, scale: 1.0 };
    let spectrum = Spectrum::Product(Box::new((sigmoid, white())));
    let xyz = cie::xyz_of(&spectrum, Observer::Cie1931);
    let found = cie::xy(xyz);
    let off = (found[0] - x).hypot(found[1] - y);
    if off.is_nan() || off > 1e-3 {
        return Err(format!("no smooth spectrum has the chromaticity {x}, {y}: the nearest is {:.3}, {:.3}", found[0], found[1]));
    }
    Ok(spectrum.scaled(cie::xyz_of_unit(Observer::Cie1931)[1] / xyz[1]))
}
