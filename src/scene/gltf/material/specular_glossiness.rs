//! KHR_materials_pbrSpecularGlossiness, which is archived but in many files: a colour of paint, and one of what is reflected at normal incidence.
//!
//! What is reflected beyond what gloss of index 1.5 does, a mirror does, in proportion: of the greatest component `f` the share `(f - .04) / .96`, so that
//! paint keeps `1 - f` of its colour, as the extension has it.

use super::{Reader, colour, factor, rgb_texture};
use crate::error::Result;
use crate::scene::gltf::texture::Use;
use crate::scene::json::Node;
use crate::scene::roughness::Roughness;
use crate::scene::{CoatNormals, Material, Texture};
use crate::spectrum::{Ior, Spectrum};

/// What gloss of index 1.5 reflects at normal incidence.
const GLOSS: f64 = 0.04;

/// The share of a mirror, and its colour, for what is reflected at normal incidence in linear sRGB.
pub(in crate::scene::gltf) fn mirror(f0: [f64; 3]) -> (f64, [f64; 3]) {
    let greatest = f0.into_iter().fold(0.0, f64::max);
    let share = ((greatest - GLOSS) / (1.0 - GLOSS)).clamp(0.0, 1.0);
    // Where it is almost nothing its colour is no matter, and rounding would be all there is to see of it.
    if share < 1e-3 {
        return (0.0, [1.0; 3]);
    }
    (share, f0.map(|f| ((f - GLOSS * (1.0 - share)) / share).clamp(0.0, 1.0)))
}

impl<'n> Reader<'_, 'n, '_> {
    pub(super) fn specular_glossiness(&mut self, node: &Node<'n>) -> Result<usize> {
        for other in ["transmission", "clearcoat", "sheen", "iridescence", "anisotropy", "specular"] {
            let other = format!("KHR_materials_{other}");
            if self.extension(&other).is_some() {
                self.note(&format!("what goes by metalness beside specular colour and glossiness: ignored ({other})"));
            }
        }
        let f0 = colour(Some(node), "specularFactor", [1.0; 3], 1.0)?;
        let glossiness = factor(Some(node), "glossinessFactor", 1.0, 1.0)?;
        let diffuse = colour(Some(node), "diffuseFactor", [1.0; 3], 1.0)?;
        let diffuse = self.colour_of(diffuse, "diffuseTexture")?;
        let reflectance = self.tinted(diffuse);
        let paint = self.paint(&reflectance)?;
        let one = Spectrum::Constant(1.0);
        let mut read = |wanted| match self.info("specularGlossinessTexture") {
            Some(info) => self.textures.read(&info, self.uv_sets, wanted, one.clone(), None),
            None => Ok(None),
        };
        let pictures = (read(Use::MirrorShare(f0))?, read(Use::MirrorColour(f0))?, read(Use::RoughnessOfGlossiness(glossiness))?);
        let (share, color, rough) = match pictures {
            (Some(share), Some(color), Some(rough)) => (share, color, rough),
            _ => {
                let (share, color) = mirror(f0);
                let number = |v: f64| Texture::from(Spectrum::Constant(v));
                (number(share), rgb_texture(node, color)?, number(1.0 - glossiness))
            }
        };
        let rough = Roughness::pictured(rough);
        let gloss = f0.into_iter().fold(0.0, f64::max).min(GLOSS).sqrt();
        if gloss == 0.0 {
            return Ok(paint);
        }
        let glossy = self.coated(paint, &Ior::constant((1.0 + gloss) / (1.0 - gloss)), &rough, &CoatNormals::OfBase);
        if share.is_zero() {
            return Ok(glossy);
        }
        let mirror = self.push_rough(&rough, |alpha| Material::ColoredConductor { reflectance: color.clone(), alpha });
        Ok(self.mix(mirror, glossy, share))
    }
}
