//! Smooth spectra of RGB colours: sigmoids of a quadratic in wavelength (Jakob & Hanika, "A Low-Dimensional Function Space for Efficient
//! Spectral Upsampling", Computer Graphics Forum 38(2), 2019, equations 4 and 5).
//!
//! "Colour of a reflectance" means its linear sRGB under CIE D65 for the 2 degree observer, scaled so that a perfect reflector is (1, 1, 1).
//! The coefficients solve three equations by Newton's method (theirs is Gauss-Newton on the same function); components are kept
//! `INSET` away from 0 and 1, which only an infinitely steep sigmoid would reach.

use super::{cie, convert};
use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Observer};
use rayon::prelude::*;
use std::sync::LazyLock;

pub use super::convert::srgb_decode;

/// How near to 0 and 1 a component may come.
const INSET: f64 = 2e-4;
/// Step of the quadrature, nm; coarser ones miss the steep flanks of saturated colours (at 3 nm by 3e-4).
const STEP_NM: f64 = 3.0;
const STEPS: usize = 140;

/// Reflectance, within [0, 1] at every wavelength, of a colour in linear sRGB; the round trip is good to 1e-3. Grey is exactly constant.
///
/// Errors if a component is not within [0, 1].
pub fn reflectance_from_linear_srgb(rgb: [f64; 3]) -> Result<Spectrum, String> {
    if let Some(v) = rgb.iter().find(|v| !(0.0..=1.0).contains(*v)) {
        return Err(format!("the colour component {v} is not within 0 to 1, as a reflectance must be"));
    }
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return Ok(Spectrum::Constant(rgb[0]));
    }
    Ok(Spectrum::Sigmoid { c: coefficients(rgb), scale: 1.0 })
}

/// Radiance of a light whose colour is `rgb` in linear sRGB: a sigmoid times [`white`], so that (v, v, v) is D65 with the luminance of the
/// constant radiance of v W m^-2 sr^-1 nm^-1, and other colours have theirs in proportion.
///
/// Errors if a component is negative, not finite or beyond 1e100.
pub fn emission_from_linear_srgb(rgb: [f64; 3]) -> Result<Spectrum, String> {
    if let Some(v) = rgb.iter().find(|v| !(0.0..=1e100).contains(*v)) {
        return Err(format!("the colour component {v} is not a number from 0 to 1e100"));
    }
    let (c, scale) = emission_coefficients(rgb, coefficients);
    if scale == 0.0 {
        return Ok(Spectrum::Constant(0.0));
    }
    Ok(Spectrum::Product(Box::new((Spectrum::Sigmoid { c, scale }, white()))))
}

/// D65 with the luminance of the constant 1.
pub fn white() -> Spectrum {
    static WHITE: LazyLock<Spectrum> = LazyLock::new(|| {
        let d65 = match library::illuminant("D65") {
            Some(Spectrum::Table { nm, values, .. }) => Spectrum::Table { nm, values, extend: true },
            other => other.unwrap_or(Spectrum::Constant(1.0)),
        };
        let unit = cie::xyz_of_unit(Observer::Cie1931)[1];
        let factor = unit / cie::xyz_of(&d65, Observer::Cie1931)[1];
        d65.scaled(factor)
    });
    WHITE.clone()
}

/// Sigmoid coefficients and factor of one texel of a picture of light, to be multiplied by [`white`]: as
/// [`emission_from_linear_srgb`], in about two microseconds. Negative components are those of colours outside the gamut, of which the nearest on the way
/// from grey is taken that light can have; a colour without a positive component is black.
pub fn emission_texel(rgb: [f64; 3]) -> ([f64; 3], f64) {
    emission_coefficients(rgb.map(|v| if v.is_finite() { v } else { 0.0 }), texel_coefficients)
}

/// Sigmoid coefficients and factor of one texel of a picture of reflectances: as [`reflectance_from_linear_srgb`], in about two microseconds.
/// Components outside [0, 1] are those of colours outside the gamut; grey is exact, and within it.
pub fn reflectance_texel(rgb: [f64; 3]) -> ([f64; 3], f64) {
    let is_grey = rgb[0] == rgb[1] && rgb[1] == rgb[2];
    if is_grey { ([0.0; 3], 2.0 * rgb[0].clamp(0.0, 1.0)) } else { (texel_coefficients(rgb), 1.0) }
}

/// Twice the largest component is factored out, which keeps the sigmoid where it is smoothest.
fn emission_coefficients(rgb: [f64; 3], solve: fn([f64; 3]) -> [f64; 3]) -> ([f64; 3], f64) {
    let max = rgb.into_iter().fold(0.0, f64::max);
    if !(f64::MIN_POSITIVE..=f64::MAX / 4.0).contains(&max) {
        return ([0.0; 3], 0.0);
    }
    (solve(rgb.map(|v| 0.5 * v / max)), 2.0 * max)
}

/// `INSET` away from 0 and 1; components beyond are those of colours outside the gamut, which a sigmoid may well have.
fn target(rgb: [f64; 3]) -> [f64; 3] {
    rgb.map(|v| if (0.0..=1.0).contains(&v) { v.clamp(INSET, 1.0 - INSET) } else { v })
}

/// Sigmoid coefficients of a reflectance of colour `rgb`, or of one near it on the way from grey that a reflectance can have, by following the solution from
/// there.
pub fn coefficients(rgb: [f64; 3]) -> [f64; 3] {
    let target = target(rgb);
    let mut c = [0.0; 3];
    // Each stage starts near its solution; the last ones are close together because coefficients grow without bound towards 0 and 1.
    for share in [0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.999, 1.0] {
        c = newton(c, target.map(|v| 0.5 + (v - 0.5) * share), 1e-10, 40).0;
    }
    c
}

/// [`coefficients`] for many colours: Newton steps from a table's value, good to 1e-4.
pub fn texel_coefficients(rgb: [f64; 3]) -> [f64; 3] {
    const GOOD: f64 = 1e-4;
    let target = target(rgb);
    let (c, error) = newton(START.interpolate(target), target, GOOD, 12);
    if error <= GOOD { c } else { coefficients(rgb) }
}

/// Nodes summed side by side, which lets the compiler use vector registers.
const LANES: usize = 4;

/// Nodes of the quadrature, the last ones of weight 0.
const PADDED: usize = (STEPS + 1).next_multiple_of(LANES);

/// What turns a reflectance at the nodes into its linear sRGB: a row per component.
static SENSOR: LazyLock<[[f64; PADDED]; 3]> = LazyLock::new(|| {
    let mut rgb = [[0.0; PADDED]; 3];
    // Each value shared between the nodes beside it: exact for reflectances linear between nodes.
    for (i, (_, add)) in color_by_nm().enumerate() {
        let at = i as f64 / STEP_NM;
        let node = (at as usize).min(STEPS - 1);
        let t = at - node as f64;
        for k in 0..3 {
            rgb[k][node] += (1.0 - t) * add[k];
            rgb[k][node + 1] += t * add[k];
        }
    }
    rgb.map(|row| row.map(|v| v / row.iter().sum::<f64>()))
});

/// Wavelengths on a 1 nm grid over those of the nodes, and what each adds to the linear sRGB of a white under D65, unscaled.
fn color_by_nm() -> impl Iterator<Item = (f64, [f64; 3])> {
    let (cmf, d65) = (library::observer(Observer::Cie1931), white());
    (0..=STEPS * STEP_NM as usize).map(move |i| {
        let nm = 360.0 + i as f64;
        (nm, convert::linear_srgb_of_xyz(cmf.eval(nm).map(|bar| bar * d65.eval(nm))))
    })
}

/// Colour of the reflectance that is `rho(nm)` at nm: the inverse of [`reflectance_from_linear_srgb`]. Components lie outside [0, 1] for colours
/// outside the gamut.
pub fn color_of_reflectance(rho: impl Fn(f64) -> f64) -> [f64; 3] {
    let (mut color, mut white) = ([0.0; 3], [0.0; 3]);
    for (nm, add) in color_by_nm() {
        let rho = rho(nm);
        for k in 0..3 {
            color[k] += rho * add[k];
            white[k] += add[k];
        }
    }
    std::array::from_fn(|k| color[k] / white[k])
}

/// Colour of a sigmoid minus `target`, and its derivatives by c0, c1, c2 (rows are R, G, B).
fn residual(sensor: &[[f64; PADDED]; 3], c: &[f64; 3], target: &[f64; 3]) -> ([f64; 3], convert::Matrix) {
    let mut value = [[0.0; LANES]; 3];
    let mut derivative = [[[0.0; LANES]; 3]; 3];
    for first in (0..PADDED).step_by(LANES) {
        for lane in 0..LANES {
            let i = first + lane;
            let x = i as f64 * (STEP_NM / 470.0);
            let t = (c[0] * x + c[1]) * x + c[2];
            let inv = 1.0 / (1.0 + t * t).sqrt();
            let s = 0.5 + 0.5 * t * inv;
            let ds = 0.5 * inv * inv * inv;
            for k in 0..3 {
                let d = sensor[k][i] * ds;
                value[k][lane] += sensor[k][i] * s;
                derivative[k][0][lane] += d * x * x;
                derivative[k][1][lane] += d * x;
                derivative[k][2][lane] += d;
            }
        }
    }
    let total = |lanes: [f64; LANES]| lanes.iter().sum::<f64>();
    (std::array::from_fn(|k| total(value[k]) - target[k]), derivative.map(|row| row.map(total)))
}

fn max_abs(v: &[f64; 3]) -> f64 {
    v.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Newton's method with step halving, until the largest component is off by `good` or less; the coefficients and that error.
fn newton(mut c: [f64; 3], target: [f64; 3], good: f64, steps: usize) -> ([f64; 3], f64) {
    let sensor = &*SENSOR;
    let (mut r, mut jacobian) = residual(sensor, &c, &target);
    for _ in 0..steps {
        if max_abs(&r) <= good {
            break;
        }
        let Some(inverse) = convert::inverse(&jacobian) else { break };
        let step = convert::apply(&inverse, r);
        let mut length = 1.0;
        let improved = loop {
            let next = std::array::from_fn(|k| c[k] - length * step[k]);
            let (r_next, jacobian_next) = residual(sensor, &next, &target);
            // A NaN fails this comparison, as it must.
            if max_abs(&r_next) < max_abs(&r) {
                (c, r, jacobian) = (next, r_next, jacobian_next);
                break true;
            }
            length *= 0.5;
            if length < 1e-6 {
                break false;
            }
        };
        if !improved {
            break;
        }
    }
    (c, max_abs(&r))
}

/// Coefficients on a grid over the colour cube, the starting points of [`texel_coefficients`].
struct StartTable {
    c: Vec<[f64; 3]>,
}

/// Nodes per axis of the table.
const NODES: usize = 17;

static START: LazyLock<StartTable> = LazyLock::new(|| {
    let node = |i: usize| {
        // Denser towards 0 and 1, where coefficients change fast.
        let u = i as f64 / (NODES - 1) as f64;
        u * u * (3.0 - 2.0 * u)
    };
    let colour = |i: usize| [node(i / (NODES * NODES)), node(i / NODES % NODES), node(i % NODES)];
    StartTable { c: (0..NODES.pow(3)).into_par_iter().map(|i| coefficients(colour(i))).collect() }
});

impl StartTable {
    /// Trilinear.
    fn interpolate(&self, rgb: [f64; 3]) -> [f64; 3] {
        // The inverse of the smoothstep that spaces the nodes.
        let at = rgb.map(|v| (0.5 - ((1.0 - 2.0 * v).clamp(-1.0, 1.0).asin() / 3.0).sin()) * (NODES - 1) as f64);
        let low = at.map(|v| (v as usize).min(NODES - 2));
        let t: [f64; 3] = std::array::from_fn(|k| at[k] - low[k] as f64);
        let mut c = [0.0; 3];
        for corner in 0..8 {
            let up: [usize; 3] = std::array::from_fn(|k| corner >> k & 1);
            let weight: f64 = (0..3).map(|k| if up[k] == 1 { t[k] } else { 1.0 - t[k] }).product();
            let entry = self.c[((low[0] + up[0]) * NODES + low[1] + up[1]) * NODES + low[2] + up[2]];
            for k in 0..3 {
                c[k] += weight * entry[k];
            }
        }
        c
    }
}
