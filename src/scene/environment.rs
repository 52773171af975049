//! Image environments: latitude-longitude pictures, their colours made into spectra.

use super::json::{Node, quoted};
use super::spectra::SpectrumReader;
use super::{EnvironmentMap, Light, transform};
use crate::error::Result;
use crate::spectrum::upsample;
use glam::DMat3;
use image::{ImageReader, Limits};
use std::io::Cursor;
use std::sync::Arc;

/// Texels at most on a side.
const LARGEST_SIDE: u32 = 16384;

/// `{"image": {"file", "scale", "transform"}}`. A linear value of 1 is [`upsample::white`] times `scale`; 8-bit pictures are decoded from sRGB.
/// The transform may only rotate.
pub(super) fn image(reader: &SpectrumReader, node: &Node) -> Result<Light> {
    let file = node.need("file")?;
    let (_, bytes) = reader.files.read(&file)?;
    let scale = node.get("scale").map_or(Ok(1.0), |n| n.non_negative())?;
    let to_local = match node.get("transform") {
        None => DMat3::IDENTITY,
        Some(t) => {
            let m = DMat3::from_mat4(transform::parse(&t)?);
            if !(m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-9) || m.determinant() < 0.0 {
                return Err(t.fail("an environment can only be rotated", "use only \"rotate_deg\" and \"axis\""));
            }
            m.transpose()
        }
    };
    let name = quoted(file.string()?);
    let unreadable = |e: String| file.fail(format!("{name}: {e}"), "use a readable .hdr, .exr, .png or .jpg picture");
    let mut decoder = ImageReader::new(Cursor::new(&bytes)).with_guessed_format().map_err(|e| unreadable(e.to_string()))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    decoder.limits(limits);
    let picture = decoder.decode().map_err(|e| unreadable(e.to_string()))?;
    let encoded = !matches!(picture.color(), image::ColorType::Rgb32F | image::ColorType::Rgba32F);
    let picture = picture.into_rgb32f();
    let (width, height) = picture.dimensions();
    if width == 0 || height == 0 {
        return Err(unreadable("the picture is empty".into()));
    }
    let mut texels = Vec::with_capacity(picture.len() / 3);
    for (x, y, pixel) in picture.enumerate_pixels() {
        let mut rgb = pixel.0.map(f64::from);
        if encoded {
            rgb = rgb.map(upsample::srgb_decode);
        }
        if rgb.iter().any(|v| !v.is_finite() || *v < 0.0) {
            return Err(file.fail(format!("{name}: the texel at {x}, {y} is negative or not finite"), "repair the picture"));
        }
        texels.push(texel(rgb, scale).ok_or_else(|| unreadable(format!("the texel at {x}, {y} is too bright")))?);
    }
    Ok(Light::Image(Arc::new(EnvironmentMap { width, height, texels, illuminant: upsample::white(), to_local })))
}

/// Sigmoid coefficients and scale of one texel; `None` if it is too bright for single precision.
fn texel(rgb: [f64; 3], scale: f64) -> Option<[f32; 4]> {
    let (c, s) = upsample::emission_texel(rgb);
    let texel = [c[0] as f32, c[1] as f32, c[2] as f32, (s * scale) as f32];
    texel.iter().all(|v| v.is_finite()).then_some(texel)
}
