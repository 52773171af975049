//! Picture files: PNG, JPEG, and EXR of linear RGB, each marked with its colour space.

use super::icc;
use super::replace_file;
use crate::color::cie::is_visible;
use crate::color::space::Space;
use crate::develop::gpu;
use crate::develop::picture::{Developer, Development, Exposure, Whole};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::spectrum::library::Observer;
use exr::meta::attribute::{Chromaticities, Text};
use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::BufWriter;
use std::path::Path;

/// Kinds of picture file, by the ending of the name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `.png`
    Png,
    /// `.jpg` or `.jpeg`
    Jpeg,
    /// `.exr`
    Exr,
}

impl Format {
    /// The format of a file of this name, if pictures are written in it.
    pub fn of(path: &Path) -> Option<Format> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "png" => Some(Format::Png),
            "jpg" | "jpeg" => Some(Format::Jpeg),
            "exr" => Some(Format::Exr),
            _ => None,
        }
    }
}

/// How exactly the components are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Precision {
    /// PNG of 16 bits instead of 8.
    pub sixteen_bits: bool,
    /// Spread what rounding to 8 or 16 bits takes over neighbouring pixels.
    pub dither: bool,
    /// Quality of JPEG, 1 to 100.
    pub quality: u8,
}

impl Default for Precision {
    fn default() -> Self {
        Precision { sixteen_bits: false, dither: true, quality: 95 }
    }
}

/// Exposure in stops of the picture that goes with a spectral EXR of wavelengths from `lo` to `hi` nm, as the file holds it: as it is `given`, from the
/// picture of `xyz` itself; of what nobody sees, 0.
pub fn picture_exposure(xyz: &[[f32; 3]], (lo, hi): (f64, f64), given: Exposure) -> f64 {
    let is_known = is_visible(lo, hi) || matches!(given, Exposure::Stops(_));
    if is_known { f64::from(given.of(xyz, Observer::Cie1931) as f32) } else { 0.0 }
}

/// Develops `xyz` (cd m^-2, row by row from the upper left, `width` pixels each) and writes it in the format that the name's ending says, by a
/// temporary file and a rename. On a GPU if one is given and single precision is enough, else in double precision.
///
/// # Errors
/// [`Error::Usage`] for a name of another ending, a linear space in a format of 8 or 16 bits or linear light beyond single precision, [`Error::File`] where the file cannot be
/// written, [`Error::Device`] where the GPU fails; what was there before stays.
pub fn write_picture(
    path: &Path,
    xyz: &[[f32; 3]],
    width: usize,
    d: &Development,
    precision: Precision,
    gpu: Option<&Gpu>,
) -> Result<()> {
    let format = Format::of(path).ok_or_else(|| {
        Error::usage(format!("no picture can be written as {}", path.display()), "let the name end in .png, .jpg or .exr")
    })?;
    if d.space == Space::AcesCg && format != Format::Exr {
        return Err(Error::usage("ACEScg is linear light, for which 8 or 16 bits are too few", "let the name end in .exr"));
    }
    let developer = Developer::new(d);
    let gpu = gpu.filter(|_| developer.suits_single_precision(xyz));
    let size = (width, xyz.len() / width.max(1));
    let encoded = |most| {
        let whole = Whole { most, dither: precision.dither, width };
        gpu.map_or_else(|| Ok(developer.encoded(xyz, whole)), |gpu| gpu::encoded(gpu, &developer, xyz, whole))
    };
    match format {
        Format::Png if precision.sixteen_bits => {
            let data: Vec<u8> = encoded(u16::MAX)?.iter().flatten().flat_map(|v| v.to_be_bytes()).collect();
            replace_file(path, |file| png(file, size, png::BitDepth::Sixteen, &data, d.space))
        }
        Format::Png => {
            let data = bytes(&encoded(u8::MAX.into())?);
            replace_file(path, |file| png(file, size, png::BitDepth::Eight, &data, d.space))
        }
        Format::Jpeg => {
            let data = bytes(&encoded(u8::MAX.into())?);
            replace_file(path, |file| jpeg(file, size, &data, precision.quality, d.space))
        }
        Format::Exr => {
            let rgb = gpu.map_or_else(|| Ok(developer.linear_image(xyz)), |gpu| gpu::linear_image(gpu, &developer, xyz))?;
            // What is not finite in XYZ is black by now.
            if rgb.iter().flatten().any(|v| !v.is_finite()) {
                let problem = format!("at {:+} stops the brightest pixel is beyond single precision", d.exposure);
                return Err(Error::usage(problem, "choose a smaller --exposure, or 'auto'"));
            }
            replace_file(path, |file| exr(file, size, &rgb, d.space))
        }
    }
}

/// Writes an 8-bit sRGB picture of three bytes per pixel as PNG, by a temporary file and a rename.
///
/// # Errors
/// [`Error::File`] where the file cannot be written; what was there before stays.
pub fn write_rgb(path: &Path, width: u32, height: u32, pixels: &[u8]) -> Result<()> {
    replace_file(path, |file| png(file, (width as usize, height as usize), png::BitDepth::Eight, pixels, Space::Srgb))
}

fn bytes(pixels: &[[u16; 3]]) -> Vec<u8> {
    pixels.iter().flatten().map(|&v| v as u8).collect()
}

fn png(
    file: &mut BufWriter<&std::fs::File>,
    size: (usize, usize),
    depth: png::BitDepth,
    data: &[u8],
    space: Space,
) -> std::result::Result<(), png::EncodingError> {
    let mut info = png::Info::with_size(size.0 as u32, size.1 as u32);
    info.color_type = png::ColorType::Rgb;
    info.bit_depth = depth;
    match space {
        Space::Srgb => info.srgb = Some(png::SrgbRenderingIntent::RelativeColorimetric),
        _ => info.icc_profile = Some(icc::profile(space).into()),
    }
    let mut writer = png::Encoder::with_info(file, info)?.write_header()?;
    // Code points of ITU-T H.273, for readers that prefer them to the profile: primaries, transfer, RGB, full range.
    let code_points = match space {
        Space::DisplayP3 => Some([12, 13, 0, 1]),
        Space::Rec2020 => Some([9, 14, 0, 1]),
        Space::Srgb | Space::AcesCg => None,
    };
    if let Some(code_points) = code_points {
        writer.write_chunk(png::chunk::cICP, &code_points)?;
    }
    writer.write_image_data(data)?;
    writer.finish()
}

fn jpeg(
    file: &mut BufWriter<&std::fs::File>,
    size: (usize, usize),
    data: &[u8],
    quality: u8,
    space: Space,
) -> image::ImageResult<()> {
    let mut encoder = JpegEncoder::new_with_quality(file, quality);
    encoder.set_icc_profile(icc::profile(space)).map_err(image::ImageError::Unsupported)?;
    encoder.write_image(data, size.0 as u32, size.1 as u32, ExtendedColorType::Rgb8)
}

fn exr(file: &mut BufWriter<&std::fs::File>, size: (usize, usize), pixels: &[[f32; 3]], space: Space) -> exr::error::UnitResult {
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = pixels[at.y() * size.0 + at.x()];
        (r, g, b)
    });
    let software_name = Some(Text::from(concat!("Abbe ", env!("CARGO_PKG_VERSION"))));
    let layer = LayerAttributes { software_name, ..LayerAttributes::default() };
    let mut image = Image::from_layer(Layer::new(Vec2(size.0, size.1), layer, Encoding::SMALL_LOSSLESS, channels));
    image.attributes.chromaticities = Some(chromaticities(space));
    image.write().to_buffered(file)
}

/// A space as the attribute of an EXR says it.
pub(super) fn chromaticities(space: Space) -> Chromaticities {
    let point = |xy: [f64; 2]| Vec2(xy[0] as f32, xy[1] as f32);
    let [red, green, blue] = space.primaries().map(point);
    Chromaticities { red, green, blue, white: point(space.white()) }
}
