//! What lies over materials of glTF: clear coats and sheen.

use super::{Reader, colour, factor};
use crate::bsdf::sheen::LEAST;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::gltf::texture::Use;
use crate::scene::roughness::Roughness;
use crate::scene::{CoatNormals, Material, Texture};
use crate::spectrum::{Ior, Spectrum};

/// Index of clear coats (KHR_materials_clearcoat).
const CLEAR_COAT: f64 = 1.5;

/// A clear coat: how much of it there is, its roughness and which way it points.
pub(super) struct Lacquer {
    share: Texture,
    roughness: Roughness,
    normals: CoatNormals,
}

impl Reader<'_, '_, '_> {
    /// A coat on paint, whose colour is the one that is seen: coats of glTF send nothing down again (glTF 2.0, appendix B.3.2).
    pub(super) fn coated(&mut self, base: usize, ior: &Ior, roughness: &Roughness, normals: &CoatNormals) -> usize {
        let coated = |alpha| Material::Coated { base, ior: ior.clone(), alpha, seen: true, normals: normals.clone() };
        self.push_rough(roughness, coated)
    }

    /// The clear coat; nothing where there is none.
    pub(super) fn lacquer(&mut self) -> Result<Option<Lacquer>> {
        let Some(node) = self.extension("KHR_materials_clearcoat") else { return Ok(None) };
        let share = self.share(factor(Some(&node), "clearcoatFactor", 0.0, 1.0)?, "clearcoatTexture", 0, None)?;
        let own = node.get("clearcoatNormalTexture");
        let roughness = self.roughness(Some(node), "clearcoatRoughnessFactor", 0.0, "clearcoatRoughnessTexture")?;
        if share.is_zero() {
            return Ok(None);
        }
        let of_base = self.node.get("normalTexture");
        let normals = if own.as_ref().map(|info| info.value) == of_base.map(|info| info.value) {
            CoatNormals::OfBase
        } else if self.extension("KHR_materials_sheen").is_some() {
            self.note(
                "normals of clear coats under sheen: ignored, they are those of what is under them (KHR_materials_clearcoat)",
            );
            CoatNormals::OfBase
        } else {
            let map = own.map_or(Ok(None), |info| self.map_of_normals(&info))?;
            map.map_or(CoatNormals::OfShape, CoatNormals::Mapped)
        };
        Ok(Some(Lacquer { share, roughness, normals }))
    }

    /// `bare` as it is where there is no lacquer, and where there is some, `base` under it.
    pub(super) fn lacquered(&mut self, base: usize, bare: usize, lacquer: &Option<Lacquer>) -> usize {
        let Some(Lacquer { share, roughness, normals }) = lacquer else { return bare };
        let coated = self.coated(base, &Ior::constant(CLEAR_COAT), roughness, normals);
        self.mix(coated, bare, share.clone())
    }

    /// Colour and roughness of sheen; nothing where there is none.
    pub(super) fn sheen(&mut self) -> Result<Option<(Spectrum, Roughness)>> {
        let Some(node) = self.extension("KHR_materials_sheen") else { return Ok(None) };
        let rgb = colour(Some(&node), "sheenColorFactor", [0.0; 3], 1.0)?;
        if rgb == [0.0; 3] {
            return Ok(None);
        }
        let mut color = upsample::reflectance_from_linear_srgb(rgb).map_err(|e| node.fail(e, "use another colour"))?;
        if let Some(info) = self.info("sheenColorTexture") {
            let one = Spectrum::Constant(1.0);
            if let Some(picture) = self.textures.read(&info, self.uv_sets, Use::Reflectance(rgb), one, None)? {
                self.note("pictures of the colour of sheen: their mean counts (KHR_materials_sheen)");
                color = Spectrum::sampled(self.loader.reader.range, |nm| picture.average(nm));
            }
        }
        let roughness = factor(Some(&node), "sheenRoughnessFactor", 0.0, 1.0)?;
        let roughness = Roughness::pictured(self.share(roughness, "sheenRoughnessTexture", 3, None)?);
        if self.extension("KHR_materials_clearcoat").is_some() {
            self.note("sheen under clear coats: it lies on them (KHR_materials_sheen)");
        }
        Ok(Some((color, roughness)))
    }

    pub(super) fn under_sheen(&mut self, base: usize, sheen: &Option<(Spectrum, Roughness)>) -> usize {
        let Some((color, roughness)) = sheen else { return base };
        self.push_rough(roughness, |alpha| Material::Sheen { base, color: color.clone(), alpha: alpha.max(LEAST) })
    }
}
