//! What the numbers of a picture's colours stand for, where its file says so: an ICC profile, the chunks cICP, gAMA and cHRM of a PNG, `chromaticities` of an EXR,
//! PRIMARIES of a Radiance picture.

use crate::color::adapt::{self, Method};
use crate::color::cie::xyz_of_xy;
use crate::color::convert::{self, Matrix, apply, multiply, srgb_decode};
use crate::color::space::D65;
use moxcms::{CicpColorPrimaries, CicpProfile, ColorProfile, DataColorSpace, Layout, MatrixCoefficients};
use moxcms::{ToneCurveEvaluator, ToneReprCurve, TransferCharacteristics, TransformF32Executor, TransformOptions};
use std::io::Cursor;
use std::sync::Arc;

type Curve = Box<dyn ToneCurveEvaluator + Send + Sync>;

/// White of the connection space of profiles, D50 as the standard rounds it (ICC.1:2022, section 7.2.16).
const D50: [f64; 3] = [0.9642, 1.0, 0.8249];
/// Gamma of the chunk gAMA that stands for sRGB.
const GAMMA_OF_SRGB: f32 = 0.454_55;

/// From the numbers of a file, 0 to 1 for whole numbers, to linear sRGB.
pub(super) enum ColorSpace {
    /// Linear numbers of other primaries.
    Linear(Matrix),
    /// A curve for each component, then other primaries.
    Curves([Curve; 3], Matrix),
    /// A profile with tables: to encoded sRGB.
    Tables(Arc<TransformF32Executor>),
}

impl ColorSpace {
    /// Linear sRGB; components lie outside [0, 1] for colours outside its gamut.
    pub fn linear_srgb(&self, rgb: [f64; 3]) -> [f64; 3] {
        match self {
            ColorSpace::Linear(matrix) => apply(matrix, rgb),
            ColorSpace::Curves(curves, matrix) => {
                apply(matrix, std::array::from_fn(|i| f64::from(curves[i].evaluate_value(rgb[i] as f32))))
            }
            ColorSpace::Tables(transform) => {
                let mut encoded = [0.0f32; 3];
                // It fails only on slices of unequal length.
                let _ = transform.transform(&rgb.map(|v| v as f32), &mut encoded);
                encoded.map(|v| srgb_decode(f64::from(v)))
            }
        }
    }

    /// Those of linear numbers with these chromaticities; `None` for those of sRGB, and for what spans no triangle.
    pub fn of_chromaticities(rgb: [[f64; 2]; 3], white: [f64; 2]) -> Option<ColorSpace> {
        let matrix = matrix_of_chromaticities(rgb, white)?;
        let apart = |(a, b): (&f64, f64)| (a - b).abs() > 1e-3;
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        matrix.iter().flatten().zip(identity.into_iter().flatten()).any(apart).then_some(ColorSpace::Linear(matrix))
    }

    /// What an ICC profile says of a picture of this many components for colour, 1 or 3; `None` if that is sRGB.
    ///
    /// # Errors
    /// Says why the profile is not heeded.
    pub fn of_icc(icc: &[u8], components: usize) -> Result<Option<ColorSpace>, &'static str> {
        let unreadable = "the colour profile cannot be read, and sRGB is taken";
        let profile = ColorProfile::new_from_slice(icc).map_err(|_| unreadable)?;
        let space = match (profile.color_space, components) {
            (DataColorSpace::Gray, 1) => {
                let curve = || {
                    profile.gray_trc.as_ref().ok_or(unreadable).and_then(|c| c.make_linear_evaluator().map_err(|_| unreadable))
                };
                ColorSpace::Curves([curve()?, curve()?, curve()?], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
            }
            (DataColorSpace::Rgb, 3) => match [&profile.red_trc, &profile.green_trc, &profile.blue_trc] {
                [Some(r), Some(g), Some(b)]
                    if profile.lut_a_to_b_perceptual.is_none() && profile.lut_a_to_b_colorimetric.is_none() =>
                {
                    let curve = |c: &ToneReprCurve| c.make_linear_evaluator().map_err(|_| unreadable);
                    ColorSpace::Curves([curve(r)?, curve(g)?, curve(b)?], matrix_of_profile(&profile))
                }
                _ => {
                    let srgb = ColorProfile::new_srgb();
                    let transform = profile.create_transform_f32(Layout::Rgb, &srgb, Layout::Rgb, TransformOptions::default());
                    ColorSpace::Tables(transform.map_err(|_| unreadable)?)
                }
            },
            (DataColorSpace::Cmyk, 3) => {
                return Err("the colour profile of four inks cannot be read, and the colours are converted without regard to it");
            }
            _ => return Err("the colour profile is not one for such pictures, and sRGB is taken"),
        };
        Ok(space.unless_srgb())
    }

    /// What the chunks of a PNG say: cICP, iCCP, sRGB and at last gAMA with cHRM, in the order of precedence of the third edition (section 4.3).
    pub fn of_png(bytes: &[u8]) -> Result<Option<ColorSpace>, &'static str> {
        let Ok(reader) = png::Decoder::new(Cursor::new(bytes)).read_info() else { return Ok(None) };
        let info = reader.info();
        if let Some(points) = &info.coding_independent_code_points {
            let unknown = "the chunk cICP names a colour space that is not known, and sRGB is taken";
            let known = (
                CicpColorPrimaries::try_from(points.color_primaries),
                TransferCharacteristics::try_from(points.transfer_function),
            );
            let (Ok(color_primaries), Ok(transfer_characteristics)) = known else { return Err(unknown) };
            let cicp = CicpProfile {
                color_primaries,
                transfer_characteristics,
                matrix_coefficients: MatrixCoefficients::Identity,
                full_range: true,
            };
            let matrix = matrix_of_profile(&ColorProfile::new_from_cicp(cicp));
            if matrix.iter().flatten().any(|v| !v.is_finite()) || matrix == [[0.0; 3]; 3] {
                return Err(unknown);
            }
            let curve = || ToneReprCurve::make_cicp_linear_evaluator(transfer_characteristics).map_err(|_| unknown);
            return Ok(ColorSpace::Curves([curve()?, curve()?, curve()?], matrix).unless_srgb());
        }
        if let Some(icc) = &info.icc_profile {
            let components = if info.color_type == png::ColorType::Grayscale || info.color_type == png::ColorType::GrayscaleAlpha
            {
                1
            } else {
                3
            };
            return ColorSpace::of_icc(icc, components);
        }
        let gamma = info.gama_chunk.map_or(GAMMA_OF_SRGB, |g| g.into_value());
        if info.srgb.is_some() || !(0.01..=100.0).contains(&gamma) {
            return Ok(None);
        }
        let matrix = info.chrm_chunk.as_ref().and_then(|c| {
            let at = |(x, y): (png::ScaledFloat, png::ScaledFloat)| [f64::from(x.into_value()), f64::from(y.into_value())];
            matrix_of_chromaticities([at(c.red), at(c.green), at(c.blue)], at(c.white))
        });
        let matrix = matrix.unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        // Who writes 1/2.2 means sRGB, which was made to look like it.
        let curve = if (gamma - GAMMA_OF_SRGB).abs() < 1e-3 {
            ToneReprCurve::Parametric(vec![2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.040_45])
        } else {
            ToneReprCurve::Parametric(vec![1.0 / gamma])
        };
        let curve = || curve.make_linear_evaluator().map_err(|_| "the chunk gAMA cannot be heeded, and sRGB is taken");
        Ok(ColorSpace::Curves([curve()?, curve()?, curve()?], matrix).unless_srgb())
    }

    /// What the line PRIMARIES of a Radiance picture says: x and y of red, green, blue and white.
    pub fn of_hdr(bytes: &[u8]) -> Option<ColorSpace> {
        let head = bytes.split(|b| *b == b'\n').take(64).take_while(|line| !line.is_empty());
        let line = head.filter_map(|line| std::str::from_utf8(line).ok()?.strip_prefix("PRIMARIES=")).next()?;
        let numbers: Vec<f64> = line.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
        let [r, s, g, h, b, c, x, y] = numbers.try_into().ok()?;
        ColorSpace::of_chromaticities([[r, s], [g, h], [b, c]], [x, y])
    }

    fn unless_srgb(self) -> Option<ColorSpace> {
        const STEPS: [f64; 5] = [0.02, 0.1, 0.3, 0.6, 1.0];
        let apart = |rgb: [f64; 3]| {
            let (own, srgb) = (self.linear_srgb(rgb), rgb.map(srgb_decode));
            own.iter().zip(srgb).any(|(a, b)| a.is_nan() || (a - b).abs() > 1e-3)
        };
        let colors =
            STEPS.into_iter().flat_map(|r| STEPS.into_iter().flat_map(move |g| STEPS.into_iter().map(move |b| [r, g, b])));
        colors.into_iter().any(apart).then_some(self)
    }
}

/// From linear RGB of a profile's primaries to linear sRGB, white to white.
fn matrix_of_profile(profile: &ColorProfile) -> Matrix {
    let to_d65 = adapt::matrix(D50, xyz_of_xy(D65), Method::Bradford);
    multiply(&convert::XYZ_TO_RGB, &multiply(&to_d65, &profile.colorant_matrix().v))
}

/// From linear RGB of these chromaticities to linear sRGB, white to white (Bradford); `None` where they span no triangle.
fn matrix_of_chromaticities(rgb: [[f64; 2]; 3], white: [f64; 2]) -> Option<Matrix> {
    // Primaries of no luminance, those of XYZ, have a y of 0.
    let columns = rgb.map(|[x, y]| [x, y, 1.0 - x - y]);
    let unscaled: Matrix = std::array::from_fn(|row| std::array::from_fn(|column| columns[column][row]));
    let white = (white[1] > 0.0).then(|| xyz_of_xy(white))?;
    let scale = apply(&convert::inverse(&unscaled)?, white);
    let to_xyz = unscaled.map(|row| std::array::from_fn(|column| row[column] * scale[column]));
    let matrix = multiply(&convert::XYZ_TO_RGB, &multiply(&adapt::matrix(white, xyz_of_xy(D65), Method::Bradford), &to_xyz));
    matrix.iter().flatten().all(|v| v.is_finite()).then_some(matrix)
}
