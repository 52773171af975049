//! Image environments: latitude-longitude pictures, their colours made into spectra.

use crate::color::upsample;
use crate::error::{Result, quoted};
use crate::scene::json::Node;
use crate::scene::json::spectra::{Place, SpectrumReader};
use crate::scene::json::transform;
use crate::scene::texture::picture::Encoding;
use crate::scene::{EnvironmentMap, EnvironmentTexels, Light};
use crate::spectrum::Spectrum;
use glam::DMat3;
use std::sync::Arc;

/// `{"image": {"file", "scale", "transform"}}`. A linear value of 1 is [`upsample::white`] times `scale`, and what spectral pictures hold is radiance times that.
/// The transform may only rotate.
pub(in crate::scene) fn image(reader: &SpectrumReader, node: &Node) -> Result<Light> {
    let file = node.need("file")?;
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
    let picture = reader.picture(node, &file)?;
    let (width, height) = (picture.width, picture.height);
    let too_bright = || file.fail(format!("{name}: a texel is too bright for single precision"), "use a smaller \"scale\"");
    let (texels, illuminant) = match picture.spectra() {
        Some(spectra) => {
            reader.remark_bins(&file, spectra.edges_nm(), false);
            (EnvironmentTexels::Spectra(spectra.clone()), Spectrum::Constant(scale))
        }
        None => {
            let texels = picture.coefficients([scale; 3], Place::Light, Encoding::Own).ok_or_else(too_bright)?;
            (EnvironmentTexels::Colors(texels), upsample::white())
        }
    };
    let map = EnvironmentMap { width, height, texels, illuminant, to_local };
    // Before single precision makes nothing of it.
    let brightest = match (map.brightest(), picture.spectra()) {
        (0.0, None) => {
            let unscaled = picture.coefficients([1.0; 3], Place::Light, Encoding::Own).ok_or_else(too_bright)?;
            unscaled.iter().map(|t| 0.5 * f64::from(t[3]) * scale).fold(0.0, f64::max)
        }
        (brightest, _) => brightest,
    };
    reader.check(node, &map.illuminant.clone().scaled(brightest), Place::Light)?;
    Ok(Light::Image(Arc::new(map)))
}
