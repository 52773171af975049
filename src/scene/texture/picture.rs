//! Pictures read from files, and their colours made into spectra.

use crate::color::upsample;
use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::spectra::Place;
use crate::scene::texture::Image;
use image::{ImageReader, Limits};
use std::collections::HashMap;
use std::io::Cursor;

/// Texels at most on a side.
const LARGEST_SIDE: u32 = 16384;
/// Pixels at most.
const MOST_PIXELS: u64 = 1 << 25;
/// Pixels at most for each byte of the file, beyond the first Mi pixels: what deflate can do at best, so that a small file cannot ask for much memory.
const PIXELS_PER_BYTE: u64 = 1032;

/// A picture as its file has it: straight alpha, rows from the top.
#[derive(Debug, Clone)]
pub(in crate::scene) struct Picture {
    pub width: u32,
    pub height: u32,
    /// Red, green, blue, alpha.
    pub pixels: Vec<[f32; 4]>,
    /// Colours are encoded as in sRGB: whatever holds whole numbers.
    pub encoded: bool,
}

/// Decodes a picture; `name` stands for it in messages. The size is checked before there is room made for it.
pub(in crate::scene) fn decode(bytes: &[u8], name: &str, node: &Node) -> Result<Picture> {
    let unreadable = |e: String| node.fail(format!("{name}: {e}"), "use a readable .png, .jpg, .hdr or .exr picture");
    let reader = || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| unreadable(e.to_string()));
    let (width, height) = reader()?.into_dimensions().map_err(|e| unreadable(e.to_string()))?;
    if width == 0 || height == 0 {
        return Err(unreadable("the picture is empty".into()));
    }
    let most = MOST_PIXELS.min((1 << 20) + PIXELS_PER_BYTE * bytes.len() as u64);
    if width.max(height) > LARGEST_SIDE || u64::from(width) * u64::from(height) > most {
        return Err(node.fail(
            format!("{name}: {width} x {height} pixels are too many for a file of {} bytes", bytes.len()),
            format!("use a picture of at most {LARGEST_SIDE} pixels on a side and {} Mi in all", MOST_PIXELS >> 20),
        ));
    }
    let mut decoder = reader()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(16 * most);
    decoder.limits(limits);
    let picture = decoder.decode().map_err(|e| unreadable(e.to_string()))?;
    let encoded = !matches!(picture.color(), image::ColorType::Rgb32F | image::ColorType::Rgba32F);
    let picture = picture.into_rgba32f();
    let pixels: Vec<[f32; 4]> = picture.pixels().map(|p| p.0).collect();
    if let Some(i) = pixels.iter().position(|p| p.iter().any(|v| !v.is_finite() || *v < 0.0)) {
        let (x, y) = (i as u32 % width, i as u32 / width);
        return Err(node.fail(format!("{name}: the texel at {x}, {y} is negative or not finite"), "repair the picture"));
    }
    Ok(Picture { width, height, pixels, encoded })
}

impl Picture {
    /// Linear RGB and alpha of every pixel; `encoded` says whether whole numbers stand for sRGB, or for shares as they are.
    pub(in crate::scene) fn linear(&self, encoded: bool) -> impl Iterator<Item = [f64; 4]> {
        self.pixels.iter().map(move |&[r, g, b, a]| {
            let decode = |v: f32| if encoded { upsample::srgb_decode(f64::from(v)) } else { f64::from(v) };
            [decode(r), decode(g), decode(b), f64::from(a)]
        })
    }

    /// The picture of these linear colours as spectra. `None` where one is not finite in single precision, or as a share beyond 1.
    pub(in crate::scene) fn spectra(&self, rgb: impl Iterator<Item = [f64; 3]>, place: Place) -> Option<Image> {
        // A picture of whole numbers has few colours.
        let mut known: HashMap<[u64; 3], [f32; 4]> = HashMap::new();
        let mut texel = |rgb: [f64; 3]| -> Option<[f32; 4]> {
            let found = *known.entry(rgb.map(f64::to_bits)).or_insert_with(|| match place {
                Place::Light => coefficients(upsample::emission_texel(rgb)),
                _ => coefficients(upsample::reflectance_texel(rgb)),
            });
            let most = if place == Place::Light { f64::INFINITY } else { 1.0 };
            (found.iter().all(|v| v.is_finite()) && rgb.iter().all(|v| *v <= most)).then_some(found)
        };
        let texels = rgb.map(&mut texel).collect::<Option<Vec<_>>>()?;
        Some(Image { width: self.width, height: self.height, texels })
    }

    /// The picture of the normals in tangent space that its colours stand for, x and y times `strength`.
    pub(in crate::scene) fn normals(&self, strength: f64) -> Image {
        let texel = |p: &[f32; 4]| {
            let [x, y, z] = [p[0], p[1], p[2]].map(|v| 2.0 * f64::from(v) - 1.0);
            [(x * strength) as f32, (y * strength) as f32, z as f32, 0.0]
        };
        Image { width: self.width, height: self.height, texels: self.pixels.iter().map(texel).collect() }
    }

    /// The picture of numbers that are the same at every wavelength.
    pub(in crate::scene) fn numbers(&self, values: impl Iterator<Item = f64>) -> Image {
        Image { width: self.width, height: self.height, texels: values.map(number).collect() }
    }
}

/// A texel that is `v` at every wavelength: the sigmoid of 0 is a half.
fn number(v: f64) -> [f32; 4] {
    [0.0, 0.0, 0.0, (2.0 * v) as f32]
}

fn coefficients((c, scale): ([f64; 3], f64)) -> [f32; 4] {
    [c[0] as f32, c[1] as f32, c[2] as f32, scale as f32]
}
