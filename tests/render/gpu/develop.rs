//! Pictures made on the adapter are those of double precision. Linear components: to 2e-5 of the pixel's largest, or of 1 where that is more, or they are
//! what double precision makes of XYZ that differ by at most 4 units of 2^-24 (a curve over logarithms magnifies what cancels). Whole numbers: to one
//! of 8 bits; of 16 bits 1 in 20 may differ by one, and 1 in 10,000 by two: near blue, the hue decides the colour within few of its digits.
//!
//! Seen to fail: with WGSL's own power, a ring of half as many entries, a knee of 0.89, a factor of 1.00003 on one matrix.

use super::support::*;
use crate::adapter;
use abbe::color::adapt::{Method, White};
use abbe::color::cie::xyz_of_unit;
use abbe::color::space::Space;
use abbe::develop::gamut::Gamut;
use abbe::develop::gpu;
use abbe::develop::picture::{Developer, Development, Whole};
use abbe::develop::tone::Tone;
use abbe::spectrum::library::{self, Observer};

const TONES: [Tone; 4] = [Tone::None, Tone::Reinhard, Tone::Aces, Tone::AgX];
const SPACES: [Space; 4] = [Space::Srgb, Space::DisplayP3, Space::Rec2020, Space::AcesCg];
/// Of linear components.
const TOLERANCE: f64 = 2e-5;
/// Rounding of XYZ that also explains a deviation, relative.
const UNITS: f64 = 4.0 / (1 << 24) as f64;
const GAMUTS: [Gamut; 3] = [Gamut::Map, Gamut::Clip, Gamut::Keep];

/// Every development that differs in what the shader does.
fn developments() -> Vec<Development> {
    let of_tone = |tone| SPACES.map(|space| GAMUTS.map(|gamut| Development { tone, space, gamut, ..Development::default() }));
    TONES.iter().flat_map(|&tone| of_tone(tone)).flatten().collect()
}

/// XYZ of `power` (W m^-2 sr^-1 nm^-1, by wavelength) as the 1931 observer sees it, with the luminance `y` times that of white.
fn xyz(power: impl Fn(f64) -> f64, y: f64) -> [f32; 3] {
    let cmf = library::observer(Observer::Cie1931);
    let sum = (380..=780).step_by(5).map(f64::from).fold([0.0; 3], |sum, nm| {
        let bar = cmf.eval(nm);
        std::array::from_fn(|i| sum[i] + power(nm) * bar[i])
    });
    sum.map(|v| (v / sum[1] * y * xyz_of_unit(Observer::Cie1931)[1]) as f32)
}

/// The whole spectrum, pure and paled, at many brightnesses.
fn spectrum(random: &mut Random) -> Vec<[f32; 3]> {
    let (width, height) = (256, 24);
    let line = |x: usize, y: usize, white: f64| {
        let nm = 390.0 + 330.0 * x as f64 / (width - 1) as f64;
        let level = f64::exp2(10.0 * y as f64 / (height - 1) as f64 - 8.0);
        xyz(|at| f64::from(u8::from((at - nm).abs() < 5.0)) + 0.1 * white * white, level)
    };
    (0..width * height).map(|i| line(i % width, i / width, random.next())).collect()
}

/// Spectra of random bins.
fn random_spectra(random: &mut Random) -> Vec<[f32; 3]> {
    let mut one = || {
        let bins: [f64; 20] = std::array::from_fn(|_| random.next().powi(4));
        let level = f64::exp2(12.0 * random.next() - 10.0);
        xyz(|nm| bins[((nm - 380.0) / 20.0).min(19.0) as usize], level)
    };
    (0..4096).map(|_| one()).collect()
}

/// Very dark and very bright pixels, negative ones, and what no pixel should hold.
fn extremes(random: &mut Random) -> Vec<[f32; 3]> {
    let unit = xyz_of_unit(Observer::Cie1931)[1];
    let mut one = |i: usize| {
        let scale = unit * 10f64.powf(if i.is_multiple_of(2) { 3.0 + 7.0 * random.next() } else { -12.0 * random.next() });
        let sign = |v: f64| if i.is_multiple_of(5) { 2.0 * v - 1.0 } else { v };
        std::array::from_fn(|_| (sign(random.next()) * scale) as f32)
    };
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, f32::MIN_POSITIVE / 4.0, -1.0];
    let bad = bad.iter().flat_map(|&v| [[v, 1.0, 1.0], [1.0, v, 1.0], [1.0, 1.0, v], [v; 3]]);
    (0..2048).map(&mut one).chain(bad).collect()
}

/// Greatest deviation of the adapter's linear components from those of `developer`, as the head of this file has it.
fn deviation(developer: &Developer, colours: &[[f32; 3]], ours: &[[f32; 3]]) -> f64 {
    assert_eq!(colours.len(), ours.len());
    let pixel = |(&xyz, ours): (&[f32; 3], &[f32; 3])| {
        assert!(ours.iter().all(|v| v.is_finite()), "{ours:?} for {xyz:?}");
        let exact = developer.linear(xyz);
        let size = exact.iter().fold(1.0f64, |m, v| m.max(v.abs()));
        let off = |lo: f64, hi: f64, v: f64| (lo - v).max(v - hi) / size;
        let plain = (0..3).map(|c| off(exact[c], exact[c], ours[c].into())).fold(0.0, f64::max);
        if plain <= TOLERANCE {
            return plain;
        }
        let near = |corner: usize| {
            let moved = |c: usize| f64::from(xyz[c]) * (1.0 + if corner >> c & 1 == 0 { UNITS } else { -UNITS });
            developer.linear(std::array::from_fn(|c| moved(c) as f32))
        };
        let around: Vec<[f64; 3]> = (0..8).map(near).collect();
        let least = |c: usize| around.iter().map(|v| v[c]).fold(f64::INFINITY, f64::min);
        let most = |c: usize| around.iter().map(|v| v[c]).fold(f64::NEG_INFINITY, f64::max);
        (0..3).map(|c| off(least(c), most(c), ours[c].into())).fold(0.0, f64::max)
    };
    colours.iter().zip(ours).map(pixel).fold(0.0, f64::max)
}

#[test]
fn pictures_made_on_the_adapter_are_those_of_double_precision() {
    let gpu = adapter::gpu();
    let mut random = Random(1);
    let natural = [spectrum(&mut random), random_spectra(&mut random)].concat();
    let colours = [natural.clone(), extremes(&mut random)].concat();
    for d in developments() {
        let developer = Developer::new(&d);
        let what = format!("{:?} {:?} {:?}", d.tone, d.space, d.gamut);
        let linear = deviation(&developer, &colours, &gpu::linear_image(&gpu, &developer, &colours).unwrap());
        assert!(linear <= TOLERANCE, "{what}: {linear:e}");
        for (most, dither, allowed) in [(255, false, [0.01, 0.0]), (65535, true, [0.05, 1e-4])] {
            let whole = Whole { most, dither, width: 256 };
            let exact = developer.encoded(&natural, whole);
            let ours = gpu::encoded(&gpu, &developer, &natural, whole).unwrap();
            let pairs = exact.as_flattened().iter().zip(ours.as_flattened());
            let off: Vec<u16> = pairs.map(|(a, b)| a.abs_diff(*b)).collect();
            let share = |least: u16| off.iter().filter(|d| **d >= least).count() as f64 / off.len() as f64;
            let (one, two) = (share(1), share(2));
            assert!(one <= allowed[0] && two <= allowed[1] && share(3) == 0.0, "{what} to {most}: {one} by one, {two} by two");
        }
    }
}

#[test]
fn exposure_white_and_observer_are_the_same_on_the_adapter() {
    let gpu = adapter::gpu();
    let colours = random_spectra(&mut Random(2));
    for observer in [Observer::Cie1931, Observer::Cie1964] {
        for (white, method, exposure) in
            [(White::blackbody(3200.0), Method::Bradford, -3.0), (White::Chromaticity([0.4, 0.3]), Method::Cat16, 5.5)]
        {
            let d = Development { observer, exposure, white: Some(white), method, ..Development::default() };
            let developer = Developer::new(&d);
            let ours = deviation(&developer, &colours, &gpu::linear_image(&gpu, &developer, &colours).unwrap());
            assert!(ours <= TOLERANCE, "{d:?}: {ours:e}");
            // Which would not be so for a little less light.
            let darker = Developer::new(&Development { exposure: d.exposure - 1e-4, ..d }).linear_image(&colours);
            assert!(deviation(&developer, &colours, &darker) > TOLERANCE);
        }
    }
}

#[test]
fn the_shader_of_every_development_is_core_wgsl() {
    for d in developments() {
        for encode in [false, true] {
            validate(&format!("{d:?}"), &gpu::develop_source(&Developer::new(&d), encode).unwrap());
        }
    }
}
