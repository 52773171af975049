//! Paint of glTF: its colour, what lies on it as gloss, and what light gets through it.

use super::{Reader, colour, factor, is_one};
use crate::bsdf::coat::Coat;
use crate::bsdf::energy::ETA_MAX;
use crate::bsdf::fresnel;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::gltf::texture::Use;
use crate::scene::roughness::Roughness;
use crate::scene::texture::{Image, ImageTexture, Wrap};
use crate::scene::{Material, Texture};
use crate::spectrum::{Ior, LINE_D_NM, Spectrum};
use std::sync::Arc;

impl Reader<'_, '_, '_> {
    /// The colour of a slot: a picture times a factor, or that.
    pub(super) fn colour_of(&mut self, rgb: [f64; 3], slot: &str) -> Result<Texture> {
        if let Some(info) = self.info(slot) {
            let one = Spectrum::Constant(1.0);
            if let Some(texture) = self.textures.read(&info, self.uv_sets, Use::Reflectance(rgb), one, None)? {
                return Ok(texture);
            }
        }
        Ok(upsample::reflectance_from_linear_srgb(rgb).map_err(|e| self.node.fail(e, "use another colour"))?.into())
    }

    /// A colour as the vertices tint it, if they do.
    pub(super) fn tinted(&self, texture: Texture) -> Texture {
        if !self.coloured {
            return texture;
        }
        Texture::Image(Arc::new(match texture {
            Texture::Image(picture) => ImageTexture { tinted: true, ..ImageTexture::clone(&picture) },
            Texture::Uniform(factor) => ImageTexture {
                image: Arc::new(Image::white()),
                wrap: [Wrap::Clamp; 2],
                nearest: true,
                to_image: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                factor,
                cutoff: None,
                set: 0,
                tinted: true,
            },
        }))
    }

    /// The base colour; that of paint under a coat of index `coat`, if there is one. Colours of glTF are those that are seen: its coats send nothing down
    /// again (glTF 2.0, appendix B.3.2), and what ours do is given back.
    pub(super) fn base_colour(&mut self, coat: Option<f64>) -> Result<Texture> {
        let base = colour(self.pbr.as_ref(), "baseColorFactor", [1.0; 3], 1.0)?;
        if let Some(info) = self.info("baseColorTexture") {
            let wanted = coat.map_or(Use::Reflectance(base), |eta| Use::Paint(base, eta));
            if let Some(texture) = self.textures.read(&info, self.uv_sets, wanted, Spectrum::Constant(1.0), None)? {
                return Ok(self.tinted(texture));
            }
        }
        let base = coat.map_or(base, |eta| base.map(|seen| Coat { eta, rough: None }.paint_of(seen)));
        let colour = upsample::reflectance_from_linear_srgb(base).map_err(|e| self.node.fail(e, "use another colour"))?;
        Ok(self.tinted(colour.into()))
    }

    /// Paint, under a coat of index `coat` if there is one; KHR_materials_diffuse_transmission lets some light through it.
    pub(super) fn paint(&mut self, coat: Option<f64>) -> Result<usize> {
        if let Some((_, known)) = self.paints.iter().find(|(of, _)| *of == coat) {
            return Ok(*known);
        }
        let paint = self.paint_anew(coat)?;
        self.paints.push((coat, paint));
        Ok(paint)
    }

    pub(super) fn paint_anew(&mut self, coat: Option<f64>) -> Result<usize> {
        let reflectance = self.base_colour(coat)?;
        let paint = self.push(Material::Diffuse { reflectance });
        let Some(node) = self.extension("KHR_materials_diffuse_transmission") else { return Ok(paint) };
        let share = factor(Some(&node), "diffuseTransmissionFactor", 0.0, 1.0)?;
        let share = self.share(share, "diffuseTransmissionTexture", 3, None)?;
        if share.is_zero() {
            return Ok(paint);
        }
        let rgb = colour(Some(&node), "diffuseTransmissionColorFactor", [1.0; 3], 1.0)?;
        let transmittance = self.colour_of(rgb, "diffuseTransmissionColorTexture")?;
        if self.extension("KHR_materials_volume").is_some() {
            self.note("what is in a volume behind diffuse transmission: ignored (KHR_materials_volume)");
        }
        let sheet = self.push(Material::DiffuseTransmission { transmittance });
        Ok(self.mix(sheet, paint, share))
    }

    /// Paint with its gloss, as much of it and of the colour as KHR_materials_specular says.
    pub(super) fn glossy(&mut self, rough: &Roughness) -> Result<usize> {
        let node = self.extension("KHR_materials_specular");
        let specular = factor(node.as_ref(), "specularFactor", 1.0, 1.0)?;
        let specular = self.share(specular, "specularTexture", 3, None)?;
        let ior = self.ior()?;
        let rgb = colour(node.as_ref(), "specularColorFactor", [1.0; 3], f64::MAX)?;
        let range = self.loader.reader.range;
        let at_normal = |nm: f64| ior.as_ref().map_or(1.0, |ior| fresnel::dielectric(1.0, ior.eval(nm)));
        let coloured = rgb != [1.0; 3];
        // Above this much at normal incidence coats end: what more there is, a mirror reflects.
        let by_coat = fresnel::dielectric(1.0, ETA_MAX);
        let (coat, mirror) = match &ior {
            Some(ior) if !coloured && at_normal(range.0).max(at_normal(range.1)) <= by_coat => (ior.clone(), None),
            _ => {
                let rgb = rgb.map(|c| (c * at_normal(LINE_D_NM)).min(1.0));
                let f0 = upsample::reflectance_from_linear_srgb(rgb).map_err(|e| self.node.fail(e, "use another colour"))?;
                let by_f0 = |f: &dyn Fn(f64) -> f64| match f0 {
                    Spectrum::Constant(f0) => Spectrum::Constant(f(f0)),
                    _ => Spectrum::sampled(range, |nm| f(f0.eval(nm))),
                };
                let index = |f0: f64| (1.0 + f0.min(by_coat).sqrt()) / (1.0 - f0.min(by_coat).sqrt());
                let mirror = by_f0(&|f0| ((f0 - by_coat) / (1.0 - by_coat)).max(0.0));
                (Ior::of_spectrum(&by_f0(&index), range), Some(mirror))
            }
        };
        if specular.is_zero() || coat.matches(&Ior::constant(1.0), range.0, range.1) {
            return self.paint(None);
        }
        let under = self.paint(Some(coat.nd()))?;
        let mut glossy = self.push_rough(rough, |alpha| Material::Coated { base: under, ior: coat.clone(), alpha });
        if let Some(share) = mirror.filter(|share| share.mean(range.0, range.1) > 0.0) {
            let white = Texture::from(Spectrum::Constant(1.0));
            let mirror = self.push_rough(rough, |alpha| Material::ColoredConductor { reflectance: white.clone(), alpha });
            glossy = self.mix(mirror, glossy, share.into());
        }
        // A picture of that colour takes from all reflection alike.
        let picture = self.colour_of([1.0; 3], "specularColorTexture")?;
        if is_one(&picture) && is_one(&specular) {
            return Ok(glossy);
        }
        let paint = self.paint(None)?;
        let glossy = self.mix(glossy, paint, picture);
        Ok(self.mix(glossy, paint, specular))
    }
}
