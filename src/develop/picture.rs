//! From CIE XYZ to a picture: exposure, white balance, tone curve, gamut, encoding, dither. The one way for `abbe render` and `abbe develop`.

use super::gamut::{Gamut, GamutMap, shoulder};
use super::tone::{Tone, ToneCurve};
use crate::color::adapt::{self, Method, White};
use crate::color::cie::{xyz_of_unit, xyz_of_xy};
use crate::color::convert::{Matrix, apply, multiply};
use crate::color::space::{D65, Space, Transfer};
use crate::error::Error;
use crate::spectrum::library::Observer;
use rayon::prelude::*;

/// What makes a picture of XYZ.
#[derive(Debug, Clone, PartialEq)]
pub struct Development {
    /// Observer of the XYZ.
    pub observer: Observer,
    /// Exposure in stops. At 0, white is the luminance of the equal-energy spectrum of 1 W m^-2 sr^-1 nm^-1; each stop doubles.
    pub exposure: f64,
    /// The light that is to look white; `None` is D65.
    pub white: Option<White>,
    /// How it is made so.
    pub method: Method,
    /// Tone curve.
    pub tone: Tone,
    /// Colour space of the picture.
    pub space: Space,
    /// What is done about colours that it cannot show.
    pub gamut: Gamut,
}

/// How the exposure of a picture is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// As [`Development::exposure`].
    Stops(f64),
    /// By [`auto_exposure`], and so many stops more.
    Auto {
        /// Share of the pixels that are to be no brighter than 0.9.
        share: f64,
        /// Stops more.
        stops: f64,
    },
}

impl Default for Exposure {
    fn default() -> Self {
        Exposure::Auto { share: AUTO_SHARE, stops: 0.0 }
    }
}

impl Exposure {
    /// Stops up and down, at most.
    pub const MOST_STOPS: f64 = 200.0;

    /// Reads `1.5`, `auto`, `auto+1`, `auto-0.5`, `auto:95` (the 95th percentile instead of the 99th) or `auto:95+1`.
    ///
    /// # Errors
    /// What would be right.
    pub fn parse(text: &str) -> Result<Self, String> {
        let stops = |text: &str| text.parse().ok().filter(|v: &f64| v.abs() <= Self::MOST_STOPS);
        let auto = |rest: &str| {
            let (share, more) = rest.split_at(rest.find(['+', '-']).unwrap_or(rest.len()));
            let share = match share.strip_prefix(':') {
                Some(percent) => percent.parse().ok().filter(|p| (0.0..=100.0).contains(p)).map(|p: f64| p / 100.0)?,
                None if share.is_empty() => AUTO_SHARE,
                None => return None,
            };
            let stops = if more.is_empty() { 0.0 } else { stops(more)? };
            Some(Exposure::Auto { share, stops })
        };
        let parsed = match text.strip_prefix("auto") {
            Some(rest) => auto(rest),
            None => stops(text).map(Exposure::Stops),
        };
        parsed.ok_or_else(|| {
            "write stops, 'auto', or 'auto' with a percentile or with stops more, as in -1.5, auto, auto:95 or auto+1".into()
        })
    }

    /// In stops, for a picture of `xyz`.
    pub fn of(self, xyz: &[[f32; 3]], observer: Observer) -> f64 {
        match self {
            Exposure::Stops(stops) => stops,
            Exposure::Auto { share, stops } => auto_exposure(xyz, observer, share) + stops,
        }
    }
}

impl std::fmt::Display for Exposure {
    /// As [`Exposure::parse`] reads it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Exposure::Stops(stops) => write!(f, "{stops}"),
            Exposure::Auto { share, stops } => write!(f, "auto:{}{stops:+}", share * 100.0),
        }
    }
}

/// What may be chosen of a picture wherever one is made: what is left open is the maker's to decide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PictureSettings {
    /// Exposure.
    pub exposure: Option<Exposure>,
    /// Tone curve; none.
    pub tone: Option<Tone>,
    /// Colour space; sRGB.
    pub space: Option<Space>,
    /// What is done about colours that it cannot show; they are mapped.
    pub gamut: Option<Gamut>,
}

impl PictureSettings {
    /// The development at `exposure` stops, as the 1931 observer sees it.
    pub fn development(&self, exposure: f64) -> Development {
        Development {
            exposure,
            tone: self.tone.unwrap_or_default(),
            space: self.space.unwrap_or(Space::Srgb),
            gamut: self.gamut.unwrap_or_default(),
            ..Development::default()
        }
    }

    /// Refuses, before the work, what is not for pictures of 8 and 16 bits.
    ///
    /// # Errors
    /// [`Error::Usage`] for a linear space.
    pub fn check_for_screens(&self) -> crate::Result<()> {
        match self.space {
            Some(Space::AcesCg) => {
                Err(Error::usage("ACEScg is for pictures in .exr", "make one with 'abbe develop' of what is rendered"))
            }
            _ => Ok(()),
        }
    }

    /// These, and where they leave something open `others`.
    pub fn or(self, others: PictureSettings) -> PictureSettings {
        PictureSettings {
            exposure: self.exposure.or(others.exposure),
            tone: self.tone.or(others.tone),
            space: self.space.or(others.space),
            gamut: self.gamut.or(others.gamut),
        }
    }
}

impl Default for Development {
    /// sRGB as the 1931 observer sees it, at exposure 0.
    fn default() -> Self {
        Development {
            observer: Observer::Cie1931,
            exposure: 0.0,
            white: None,
            method: Method::default(),
            tone: Tone::default(),
            space: Space::Srgb,
            gamut: Gamut::default(),
        }
    }
}

/// A development made ready for many pixels.
#[derive(Debug, Clone)]
pub struct Developer {
    /// XYZ in cd m^-2 to linear RGB, exposure and white balance included.
    pub(super) to_rgb: Matrix,
    pub(super) tone: ToneCurve,
    pub(super) gamut: Gamut,
    pub(super) map: GamutMap,
    pub(super) transfer: Transfer,
}

impl Developer {
    /// Works out what all pixels share.
    pub fn new(d: &Development) -> Self {
        let from = match (&d.white, d.observer) {
            (Some(white), observer) => white.xyz(observer),
            // As the display spaces round it, so that nothing at all is done for them.
            (None, Observer::Cie1931) => xyz_of_xy(D65),
            (None, Observer::Cie1964) => White::illuminant("D65").map_or(xyz_of_xy(D65), |white| white.xyz(d.observer)),
        };
        let to = xyz_of_xy(d.space.white());
        let from_xyz = d.space.from_xyz();
        let balanced = if from == to { from_xyz } else { multiply(&from_xyz, &adapt::matrix(from, to, d.method)) };
        let gain = d.exposure.exp2() / xyz_of_unit(d.observer)[1];
        Developer {
            to_rgb: balanced.map(|row| row.map(|v| v * gain)),
            tone: ToneCurve::new(d.tone, d.space),
            gamut: d.gamut,
            map: GamutMap::new(d.space),
            transfer: d.space.transfer(),
        }
    }

    /// Whether every step of these pixels' development, the squares and cubes of tone curves and of the gamut too, is well within single precision.
    pub fn suits_single_precision(&self, xyz: &[[f32; 3]]) -> bool {
        let gain = self.to_rgb.iter().flatten().fold(0.0, |most: f64, v| most.max(v.abs()));
        let brightest = xyz.iter().flatten().filter(|v| v.is_finite()).fold(0.0, |most: f32, v| most.max(v.abs()));
        (1e-30..1e30).contains(&gain) && gain * f64::from(brightest) < 1e10
    }

    /// Linear RGB of a pixel's XYZ in cd m^-2. What is not finite, or has no luminance, is black.
    ///
    /// Where colours are mapped into the gamut and the largest component still exceeds 0.9 (1 after a tone curve that ends there itself),
    /// the pixel is scaled down so that it approaches 1, with its hue kept.
    pub fn linear(&self, xyz: [f32; 3]) -> [f64; 3] {
        if !(xyz.iter().all(|v| v.is_finite()) && xyz[1] > 0.0) {
            return [0.0; 3];
        }
        let rgb = self.tone.apply(apply(&self.to_rgb, xyz.map(f64::from)));
        match self.gamut {
            Gamut::Keep => rgb,
            Gamut::Clip => rgb.map(|v| v.clamp(0.0, 1.0)),
            Gamut::Map => {
                let rgb = self.map.without_negatives(rgb);
                let max = rgb.into_iter().fold(0.0, f64::max);
                let scale = if max > self.tone.knee() { shoulder(max, self.tone.knee()) / max } else { 1.0 };
                rgb.map(|v| v * scale)
            }
        }
    }

    /// Linear RGB of every pixel, single precision.
    pub fn linear_image(&self, xyz: &[[f32; 3]]) -> Vec<[f32; 3]> {
        xyz.par_iter().with_min_len(1024).map(|&p| self.linear(p).map(|v| v as f32)).collect()
    }

    /// Encoded components of every pixel as whole numbers.
    pub fn encoded(&self, xyz: &[[f32; 3]], whole: Whole) -> Vec<[u16; 3]> {
        let encode = |(i, &p)| whole.of(i, self.linear(p).map(|v| self.transfer.encode(v.clamp(0.0, 1.0))));
        xyz.par_iter().enumerate().with_min_len(1024).map(encode).collect()
    }
}

/// How components of 0 to 1 become whole numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Whole {
    /// What stands for 1.
    pub most: u16,
    /// Round up or down in a fixed pattern, in proportion to what a component lies between; 0 and `most` stay.
    pub dither: bool,
    /// Pixels across, for the pattern.
    pub width: usize,
}

impl Whole {
    /// Of the components of pixel `i`, counted row by row.
    pub fn of(&self, i: usize, components: [f64; 3]) -> [u16; 3] {
        let most = f64::from(self.most);
        std::array::from_fn(|c| {
            let threshold = if self.dither { gradient_noise(i % self.width, i / self.width, c) } else { 0.5 };
            (most * components[c] + threshold).floor().min(most) as u16
        })
    }
}

/// Evenly spread numbers in (0, 1) whose neighbours differ much: J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare",
/// SIGGRAPH 2014 course, slide 123; each component sees another part of the pattern.
fn gradient_noise(x: usize, y: usize, component: usize) -> f64 {
    let shift = 5.588_238 * component as f64;
    let noise = (52.982_918_9 * (0.067_110_56 * (x as f64 + shift) + 0.005_837_15 * (y as f64 + shift)).fract()).fract();
    // What is a whole number but for rounding stays that number.
    0.01 + 0.98 * noise
}

/// Share of the pixels that [`auto_exposure`] lets be no brighter than 0.9, unless told otherwise.
pub const AUTO_SHARE: f64 = 0.99;

/// The exposure, in stops, that brings the luminance which `share` of the pixels do not exceed to 0.9.
///
/// Black pixels do not count: a spectrum on a dark wall is exposed for the spectrum. A few pixels of lamp over a lit scene must not darken it:
/// at most 6 times the 90th percentile counts, unless that is next to nothing (1/500) beside the brighter.
pub fn auto_exposure(xyz: &[[f32; 3]], observer: Observer, share: f64) -> f64 {
    let mut luminance: Vec<f32> = xyz.iter().map(|p| p[1]).filter(|y| y.is_finite() && *y > 0.0).collect();
    if luminance.is_empty() {
        return 0.0;
    }
    let last = luminance.len() - 1;
    let mut percentile =
        |share: f64| f64::from(*luminance.select_nth_unstable_by((share * last as f64).round() as usize, f32::total_cmp).1);
    let (high, usual) = (percentile(share), percentile(share.min(0.90)));
    let white = if usual * 500.0 < high { high } else { high.min(6.0 * usual) };
    (0.9 * xyz_of_unit(observer)[1] / white).log2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_are_read_as_they_are_written_and_written_as_they_are_read() {
        let auto = |share, stops| Ok(Exposure::Auto { share, stops });
        assert_eq!(Exposure::parse("-1.5"), Ok(Exposure::Stops(-1.5)));
        assert_eq!(Exposure::parse("auto"), auto(0.99, 0.0));
        assert_eq!(Exposure::parse("auto:95"), auto(0.95, 0.0));
        assert_eq!(Exposure::parse("auto+1"), auto(0.99, 1.0));
        assert_eq!(Exposure::parse("auto-0.5"), auto(0.99, -0.5));
        assert_eq!(Exposure::parse("auto:90+2"), auto(0.9, 2.0));
        for text in ["-1.5", "auto", "auto:95", "auto:90-2.25", "auto+1"] {
            let exposure = Exposure::parse(text).unwrap();
            assert_eq!(Exposure::parse(&exposure.to_string()), Ok(exposure), "{text}");
        }
        let senseless = ["auto95", "auto:101", "auto:", "auto+", "auto+x", "auto+1e9", "auto:-5", "bright", "nan", "1e9", ""];
        assert!(senseless.iter().all(|text| Exposure::parse(text).is_err()));
    }

    #[test]
    fn stops_more_than_automatic_are_just_that() {
        let xyz = [[0.2, 0.5, 0.1], [3.0, 4.0, 5.0], [1.0, 1.0, 1.0]];
        let of = |text| Exposure::parse(text).unwrap().of(&xyz, Observer::Cie1931);
        assert_eq!(of("auto+1.5"), of("auto") + 1.5);
        assert_eq!(of("auto"), auto_exposure(&xyz, Observer::Cie1931, AUTO_SHARE));
        assert_ne!(of("auto:10"), of("auto"));
        assert_eq!(of("-3"), -3.0);
    }
}
