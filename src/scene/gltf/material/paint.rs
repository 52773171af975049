//! Paint of glTF: its colour, what lies on it as gloss, and what light gets through it.

use super::{Reader, colour, factor, is_one, rgb_texture};
use crate::bsdf::energy::ETA_MAX;
use crate::bsdf::fresnel;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::gltf::texture::Use;
use crate::scene::roughness::Roughness;
use crate::scene::texture::{Image, ImageTexture, Wrap};
use crate::scene::{CoatNormals, Material, Texture};
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
        rgb_texture(self.node, rgb)
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

    /// The base colour.
    pub(super) fn base_colour(&mut self) -> Result<Texture> {
        let base = colour(self.pbr.as_ref(), "baseColorFactor", [1.0; 3], 1.0)?;
        let color = self.colour_of(base, "baseColorTexture")?;
        Ok(self.tinted(color))
    }

    /// Paint of this colour; KHR_materials_diffuse_transmission lets some light through it.
    pub(super) fn paint(&mut self, reflectance: &Texture) -> Result<usize> {
        let paint = self.push(Material::Diffuse { reflectance: reflectance.clone() });
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

    pub(super) fn colour_of_specular(&self) -> Result<[f64; 3]> {
        colour(self.extension("KHR_materials_specular").as_ref(), "specularColorFactor", [1.0; 3], f64::MAX)
    }

    /// The index that gives what is reflected at normal incidence its colour, and the share of a mirror where that is more than a coat reflects.
    pub(super) fn gloss(&mut self) -> Result<(Ior, Option<Spectrum>)> {
        let ior = self.ior()?;
        let rgb = self.colour_of_specular()?;
        let range = self.loader.reader.range;
        let at_normal = |nm: f64| ior.as_ref().map_or(1.0, |ior| fresnel::dielectric(1.0, ior.eval(nm)));
        // Above this much at normal incidence coats end: what more there is, a mirror reflects.
        let by_coat = fresnel::dielectric(1.0, ETA_MAX);
        if let Some(ior) = ior.as_ref().filter(|_| rgb == [1.0; 3] && at_normal(range.0).max(at_normal(range.1)) <= by_coat) {
            return Ok((ior.clone(), None));
        }
        let rgb = rgb.map(|c| (c * at_normal(LINE_D_NM)).min(1.0));
        let f0 = upsample::reflectance_from_linear_srgb(rgb).map_err(|e| self.node.fail(e, "use another colour"))?;
        let by_f0 = |f: &dyn Fn(f64) -> f64| match f0 {
            Spectrum::Constant(f0) => Spectrum::Constant(f(f0)),
            _ => Spectrum::sampled(range, |nm| f(f0.eval(nm))),
        };
        let index = |f0: f64| (1.0 + f0.min(by_coat).sqrt()) / (1.0 - f0.min(by_coat).sqrt());
        let mirror = by_f0(&|f0| ((f0 - by_coat) / (1.0 - by_coat)).max(0.0));
        let mirror = Some(mirror).filter(|share| share.mean(range.0, range.1) > 0.0);
        Ok((Ior::of_spectrum(&by_f0(&index), range), mirror))
    }

    /// `glossy` where there is reflection, as much of it and of its colour as KHR_materials_specular says, and `bare` where there is none.
    pub(super) fn by_specular(&mut self, glossy: usize, bare: usize) -> Result<usize> {
        let node = self.extension("KHR_materials_specular");
        let specular = factor(node.as_ref(), "specularFactor", 1.0, 1.0)?;
        let specular = self.share(specular, "specularTexture", 3, None)?;
        // A picture of that colour takes from all reflection alike.
        let picture = self.colour_of([1.0; 3], "specularColorTexture")?;
        let glossy = if is_one(&picture) { glossy } else { self.mix(glossy, bare, picture) };
        Ok(if is_one(&specular) { glossy } else { self.mix(glossy, bare, specular) })
    }

    /// Paint with its gloss.
    pub(super) fn glossy(&mut self, paint: usize, rough: &Roughness) -> Result<usize> {
        let (coat, mirror) = self.gloss()?;
        let range = self.loader.reader.range;
        if coat.matches(&Ior::constant(1.0), range.0, range.1) {
            return Ok(paint);
        }
        let mut glossy = self.coated(paint, &coat, rough, &CoatNormals::OfBase);
        if let Some(share) = mirror {
            let white = Texture::from(Spectrum::Constant(1.0));
            let mirror = self.push_rough(rough, |alpha| Material::ColoredConductor { reflectance: white.clone(), alpha });
            glossy = self.mix(mirror, glossy, share.into());
        }
        self.by_specular(glossy, paint)
    }
}
