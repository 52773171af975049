//! Image environments: latitude-longitude pictures, their colours made into spectra.

use crate::color::upsample;
use crate::error::{Result, quoted};
use crate::scene::json::Node;
use crate::scene::json::spectra::{Place, SpectrumReader};
use crate::scene::json::transform;
use crate::scene::texture::picture;
use crate::scene::{EnvironmentMap, Light};
use glam::DMat3;
use std::sync::Arc;

/// `{"image": {"file", "scale", "transform"}}`. A linear value of 1 is [`upsample::white`] times `scale`; 8-bit pictures are decoded from sRGB.
/// The transform may only rotate.
pub(in crate::scene) fn image(reader: &SpectrumReader, node: &Node) -> Result<Light> {
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
    let picture = picture::decode(&bytes, &name, &file)?;
    let scaled = || picture.linear(picture.encoded).map(|[r, g, b, _]| [r, g, b].map(|v| v * scale));
    // Before single precision makes nothing of it.
    let brightest = scaled().flatten().fold(0.0, f64::max);
    reader.check(node, &upsample::white().scaled(brightest), Place::Light)?;
    let image = picture.spectra(scaled(), Place::Light);
    let image = image.ok_or_else(|| file.fail(format!("{name}: a texel is too bright"), "use a smaller \"scale\""))?;
    let (width, height, texels) = (image.width, image.height, image.texels);
    Ok(Light::Image(Arc::new(EnvironmentMap { width, height, texels, illuminant: upsample::white(), to_local })))
}
