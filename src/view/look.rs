//! How a page wants to see a picture, and the pixels of that: by develop's own code, or as numbers in colours.

use super::picture::Picture;
use crate::color::adapt::{Method, White};
use crate::color::chromaticity::color_of_wavelength;
use crate::color::cie::{K_M, is_visible, xyz_of_unit};
use crate::color::convert::{srgb_decode, srgb_encode, xyz_of_linear_srgb};
use crate::color::space::D65;
use crate::compare::lab::{delta_e_2000, lab_of_xyz};
use crate::develop::gamut::Gamut;
use crate::develop::picture::{Developer, Development, Exposure, Whole};
use crate::develop::tone::Tone;
use crate::spectrum::library::Observer;
use rayon::prelude::*;
use serde_json::{Value, json};

/// What of a picture is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum View {
    /// Its colours.
    Colors,
    /// One bin.
    Bin,
    /// Luminance in false colours.
    Luminance,
    /// Standard error of luminance over luminance.
    Error,
    /// Distance of what is seen first.
    Depth,
    /// Its normal.
    Normal,
    /// Its albedo.
    Albedo,
    /// Samples of a render.
    Samples,
    /// Relative difference in luminance of the first picture from the second.
    Difference,
    /// Delta E2000 between the two.
    DeltaE,
}

const VIEWS: [(&str, View); 10] = [
    ("colors", View::Colors),
    ("bin", View::Bin),
    ("luminance", View::Luminance),
    ("error", View::Error),
    ("depth", View::Depth),
    ("normal", View::Normal),
    ("albedo", View::Albedo),
    ("samples", View::Samples),
    ("difference", View::Difference),
    ("delta-e", View::DeltaE),
];

/// Names of all that a page may choose.
pub fn choices() -> Value {
    fn names<T>(table: &[(&'static str, T)]) -> Vec<&'static str> {
        table.iter().map(|(name, _)| *name).collect()
    }
    json!({
        "views": names(&VIEWS),
        "tones": names(&Tone::NAMED),
        // What is out of range does not get through 8 bits.
        "gamuts": names(&Gamut::NAMED.into_iter().filter(|(_, gamut)| *gamut != Gamut::Keep).collect::<Vec<_>>()),
        "observers": names(&Observer::NAMED),
    })
}

/// How a page wants to see a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// What of it.
    pub view: View,
    /// The bin next to this wavelength, nm, where one is shown.
    pub nm: f64,
    /// How its exposure is found; `None`: as the picture's scene or file says ([`Picture::exposure`]), or else automatically.
    pub exposure: Option<Exposure>,
    /// Develop's settings but for that.
    pub development: Development,
    /// Whether its colours are to be without noise, where that is known.
    pub denoise: bool,
}

impl Default for Look {
    fn default() -> Self {
        Look { view: View::Colors, nm: 550.0, exposure: None, development: Development::default(), denoise: false }
    }
}

impl Look {
    /// As a page writes it; what it leaves out, or is none, is as it is by default.
    pub fn of_json(value: &Value) -> Self {
        fn choice<T: Copy>(value: &Value, table: &[(&str, T)], usual: T) -> T {
            table.iter().find(|(name, _)| value.as_str() == Some(name)).map_or(usual, |(_, choice)| *choice)
        }
        let number = |key: &str, usual: f64| value[key].as_f64().filter(|v| v.abs() <= 1e5).unwrap_or(usual);
        let white = match &value["white"] {
            Value::Number(kelvin) => kelvin.as_f64().filter(|k| (1000.0..=1e5).contains(k)).map(White::blackbody),
            Value::String(name) => White::illuminant(name),
            _ => None,
        };
        Look {
            view: choice(&value["view"], &VIEWS, View::Colors),
            nm: number("nm", 550.0),
            exposure: value["exposure"].as_str().and_then(|text| Exposure::parse(text).ok()),
            development: Development {
                observer: choice(&value["observer"], &Observer::NAMED, Observer::Cie1931),
                white,
                method: Method::default(),
                tone: choice(&value["tone"], &Tone::NAMED, Tone::None),
                gamut: choice(&value["gamut"], &Gamut::NAMED, Gamut::Map),
                ..Development::default()
            },
            denoise: value["denoise"].as_bool().unwrap_or(false),
        }
    }

    /// Exposure in stops of a picture whose XYZ are these.
    fn exposure(&self, picture: &Picture, xyz: &[[f32; 3]]) -> f64 {
        self.exposure.or_else(|| picture.exposure().map(Exposure::Stops)).unwrap_or_default().of(xyz, self.development.observer)
    }
}

/// Pixels ready for a screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// sRGB of 8 bits, rows from the top.
    pub rgb: Vec<u8>,
    /// What goes with it: the exposure, or what the false colours mean.
    pub about: Value,
}

/// Draws a picture, or what it has over another; both as one exposure shows them.
///
/// # Errors
/// Says what is missing.
pub fn draw(look: &Look, picture: &Picture, other: Option<&Picture>) -> Result<Drawn, String> {
    let size = picture.size();
    let observer = look.development.observer;
    match look.view {
        View::Colors => {
            let xyz = picture.xyz(observer)?;
            // Two pictures are compared at one exposure, that of the first.
            let exposure = match other {
                Some(first) => look.exposure(first, &first.xyz(observer)?),
                None => look.exposure(picture, &xyz),
            };
            let denoised = picture.denoised.get().filter(|_| look.denoises());
            let mut drawn = developed(look, size, denoised.unwrap_or(&xyz), exposure);
            drawn.about["denoised"] = json!(denoised.is_some());
            Ok(drawn)
        }
        View::Bin => {
            let centres = picture.centres_nm();
            let nearest = |a: &usize, b: &usize| (centres[*a] - look.nm).abs().total_cmp(&(centres[*b] - look.nm).abs());
            let bin = (0..centres.len()).min_by(nearest).ok_or("there is no bin")?;
            // In the hue of its wavelength, as bright as a screen has it; what nobody sees is grey.
            let tint = match color_of_wavelength(centres[bin]) {
                _ if !is_visible(centres[bin] - 1.0, centres[bin] + 1.0) => [1.0; 3],
                rgb => {
                    let linear = rgb.map(|v| srgb_decode(f64::from(v) / 255.0));
                    let most = linear.into_iter().fold(1e-6, f64::max);
                    linear.map(|v| v / most)
                }
            };
            let tint = xyz_of_linear_srgb(tint).map(|v| (v * K_M) as f32);
            let xyz: Vec<[f32; 3]> = picture.bin(bin).into_iter().map(|v| tint.map(|t| t * v)).collect();
            let exposure = look.exposure(picture, &xyz);
            let plain = Look { development: Development { white: None, ..look.development.clone() }, ..look.clone() };
            let mut drawn = developed(&plain, size, &xyz, exposure);
            drawn.about["nm"] = json!(centres[bin]);
            Ok(drawn)
        }
        View::Luminance => {
            let values: Vec<f32> = picture.xyz(observer)?.into_iter().map(|xyz| xyz[1]).collect();
            Ok(in_false_colors(size, &values, &Scale::logarithmic(&values, picture.quantity()[2])))
        }
        View::Error => {
            let values =
                picture.relative_errors().ok_or("errors are known from the second batch on, and of files that have them")?;
            Ok(in_false_colors(size, &values, &Scale::logarithmic(&values, "relative error")))
        }
        View::Samples => {
            let values = picture.samples().ok_or("a file does not say how many samples a pixel has")?;
            let most = values.iter().copied().fold(1.0, f32::max);
            Ok(in_false_colors(
                size,
                &values,
                &Scale { lo: 0.0, hi: f64::from(most), is_log: false, unit: "samples", map: VIRIDIS },
            ))
        }
        View::Depth => {
            let values = picture.depth().ok_or("depth is not known yet")?;
            let least = values.iter().copied().filter(|v| *v > 0.0).fold(f32::INFINITY, f32::min);
            let most = values.iter().copied().fold(0.0, f32::max).max(least.min(1e30));
            let scale = Scale { lo: f64::from(least.min(most)), hi: f64::from(most), is_log: false, unit: "m", map: VIRIDIS };
            Ok(in_false_colors(size, &values, &scale))
        }
        View::Normal | View::Albedo => {
            let is_normal = look.view == View::Normal;
            let vectors = picture.vectors(is_normal).ok_or("this is not known yet")?;
            let component = |v: f32| {
                let v = f64::from(v);
                let shown = if is_normal { 0.5 + 0.5 * v } else { srgb_encode(v.clamp(0.0, 1.0)) };
                (255.0 * shown.clamp(0.0, 1.0)).round() as u8
            };
            Ok(Drawn { size, rgb: vectors.iter().flatten().map(|&v| component(v)).collect(), about: json!({}) })
        }
        View::Difference | View::DeltaE => {
            let other = other.ok_or("there is no second picture")?;
            if other.size() != size {
                return Err(format!(
                    "one picture has {}x{} pixels, the other {}x{}",
                    size[0],
                    size[1],
                    other.size()[0],
                    other.size()[1]
                ));
            }
            let (a, b) = (picture.xyz(observer)?, other.xyz(observer)?);
            if look.view == View::Difference {
                let mean = b.iter().map(|xyz| f64::from(xyz[1])).sum::<f64>() / b.len().max(1) as f64;
                let relative = |(a, b): (&[f32; 3], &[f32; 3])| {
                    // As relMSE has it: dark pixels must not rule.
                    let (a, b) = (f64::from(a[1]), f64::from(b[1]));
                    ((a - b) / (b * b + 0.01 * mean * mean).sqrt().max(f64::MIN_POSITIVE)) as f32
                };
                let values: Vec<f32> = a.iter().zip(&b).map(relative).collect();
                let most = percentile(values.iter().map(|v| v.abs()).collect(), 0.99).max(1e-6);
                let scale =
                    Scale { lo: -most, hi: most, is_log: false, unit: "relative difference in luminance", map: DIVERGING };
                return Ok(in_false_colors(size, &values, &scale));
            }
            let exposure = look.exposure(picture, &a);
            let luminance = xyz_of_unit(observer)[1] / exposure.exp2();
            let white = crate::color::cie::xyz_of_xy(D65).map(|v| v * luminance);
            let lab = |xyz: &[f32; 3]| lab_of_xyz(xyz.map(|v| f64::from(v).max(0.0)), white);
            let values: Vec<f32> = a.par_iter().zip(&b).map(|(a, b)| delta_e_2000(lab(a), lab(b)) as f32).collect();
            let most = percentile(values.clone(), 0.99).max(1.0);
            Ok(in_false_colors(size, &values, &Scale { lo: 0.0, hi: most, is_log: false, unit: "Delta E2000", map: INFERNO }))
        }
    }
}

fn developed(look: &Look, size: [usize; 2], xyz: &[[f32; 3]], exposure: f64) -> Drawn {
    let developer = Developer::new(&Development { exposure, ..look.development.clone() });
    let whole = Whole { most: 255, dither: true, width: size[0] };
    let rgb = developer.encoded(xyz, whole).into_iter().flatten().map(|v| v as u8).collect();
    Drawn { size, rgb, about: json!({"exposure": exposure}) }
}

/// What false colours stand for.
struct Scale {
    lo: f64,
    hi: f64,
    is_log: bool,
    unit: &'static str,
    map: Map,
}

impl Scale {
    /// From the 1st to the 99.9th percentile of what is above 0, over six decades at most.
    fn logarithmic(values: &[f32], unit: &'static str) -> Self {
        let positive: Vec<f32> = values.iter().copied().filter(|v| v.is_finite() && *v > 0.0).collect();
        let hi = percentile(positive.clone(), 0.999).max(f64::MIN_POSITIVE);
        let lo = percentile(positive, 0.01).clamp(hi * 1e-6, hi * 0.5);
        Scale { lo, hi, is_log: true, unit, map: VIRIDIS }
    }

    fn place(&self, value: f64) -> f64 {
        let of = |v: f64| if self.is_log { v.max(f64::MIN_POSITIVE).ln() } else { v };
        let (lo, hi) = (of(self.lo), of(self.hi));
        if hi > lo { ((of(value) - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.0 }
    }
}

fn percentile(mut values: Vec<f32>, share: f64) -> f64 {
    values.retain(|v| v.is_finite());
    if values.is_empty() {
        return 0.0;
    }
    let place = (share * (values.len() - 1) as f64).round() as usize;
    f64::from(*values.select_nth_unstable_by(place, f32::total_cmp).1)
}

fn in_false_colors(size: [usize; 2], values: &[f32], scale: &Scale) -> Drawn {
    let color = |v: &f32| if v.is_finite() { color_of(scale.map, scale.place(f64::from(*v))) } else { [0; 3] };
    let rgb: Vec<[u8; 3]> = values.par_iter().with_min_len(1024).map(color).collect();
    let stops: Vec<String> = (0..=16)
        .map(|i| {
            let [r, g, b] = color_of(scale.map, f64::from(i) / 16.0);
            format!("#{r:02x}{g:02x}{b:02x}")
        })
        .collect();
    let about = json!({"scale": {"lo": scale.lo, "hi": scale.hi, "log": scale.is_log, "unit": scale.unit, "colors": stops}});
    Drawn { size, rgb: rgb.into_flattened(), about }
}

/// Coefficients of polynomials for R, G and B, from the constant on.
type Map = &'static [[f64; 3]];

/// Fits by M. Zucker (CC0, 2019) to the colour maps of S. van der Walt and N. Smith for matplotlib.
const VIRIDIS: Map = &[
    [0.277_727_327_223_417_7, 0.005_407_344_544_966_578, 0.334_099_805_335_306_1],
    [0.105_093_043_108_577_4, 1.404_613_529_898_575, 1.384_590_162_594_685],
    [-0.330_861_828_725_556_3, 0.214_847_559_468_213, 0.095_095_163_028_236_59],
    [-4.634_230_498_983_486, -5.799_100_973_351_585, -19.332_440_956_279_87],
    [6.228_269_936_347_081, 14.179_933_366_805_09, 56.690_552_600_681_05],
    [4.776_384_997_670_288, -13.745_145_377_746_01, -65.353_032_633_372_34],
    [-5.435_455_855_934_631, 4.645_852_612_178_535, 26.312_435_249_583_2],
];
const INFERNO: Map = &[
    [0.000_218_940_369_119_226_5, 0.001_651_004_631_001_012, -0.019_480_898_437_091_84],
    [0.106_513_419_485_611_6, 0.563_956_436_788_409_1, 3.932_712_388_889_277],
    [11.602_493_082_471_87, -3.972_853_965_665_698, -15.942_394_106_291_4],
    [-41.703_996_131_394_59, 17.436_398_882_053_13, 44.354_145_198_728_13],
    [77.162_935_699_427, -33.402_358_942_100_92, -81.807_309_257_389_93],
    [-71.319_428_244_992_14, 32.626_064_263_977_23, 73.209_519_858_032_02],
    [25.131_126_224_773_41, -12.242_668_952_385_67, -23.070_325_002_871_72],
];
/// Blue by way of white to red.
const DIVERGING: Map = &[[0.13, 0.30, 0.65], [2.74, 2.86, 1.81], [-2.12, -3.04, -2.34]];

fn color_of(map: Map, t: f64) -> [u8; 3] {
    let component = |c: usize| map.iter().rev().fold(0.0, |sum, coefficients| sum * t + coefficients[c]);
    std::array::from_fn(|c| (255.0 * component(c).clamp(0.0, 1.0)).round() as u8)
}

impl Look {
    /// Whether it is of two pictures.
    pub fn is_of_two(&self) -> bool {
        matches!(self.view, View::Difference | View::DeltaE)
    }

    /// Whether it is of a picture without noise: its colours as the standard observer sees them, since only X, Y, Z are denoised.
    pub fn denoises(&self) -> bool {
        self.denoise && self.view == View::Colors && self.development.observer == Observer::Cie1931
    }

    /// Whether it shows, or takes, what is seen first.
    pub fn needs_aovs(&self) -> bool {
        self.denoises() || matches!(self.view, View::Depth | View::Normal | View::Albedo)
    }
}
