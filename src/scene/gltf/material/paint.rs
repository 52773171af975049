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

    /// A coat on paint, whose colour is the one that is seen: coats of glTF send nothing down again (glTF 2.0, appendix B.3.2).
    pub(super) fn coated(&mut self, base: usize, ior: &Ior, roughness: &Roughness, normals: &CoatNormals) -> usize {
        let coated = |alpha| Material::Coated { base, ior: ior.clone(), alpha, seen: true, normals: normals.clone() };
        self.push_rough(roughness, coated)
    }

    fn colour_of_specular(&self) -> Result<[f64; 3]> {
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
    fn by_specular(&mut self, glossy: usize, bare: usize) -> Result<usize> {
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

    /// Glass that reflects as much as KHR_materials_specular says, and lets the rest through: a mixture with what reflects nothing. A pane has an index
    /// for the colour, solid glass keeps its own.
    pub(super) fn less_specular(&mut self, glass: usize, tint: &Texture, rough: &Roughness) -> Result<usize> {
        if self.extension("KHR_materials_specular").is_none() {
            return Ok(glass);
        }
        let scene = &self.loader.scene;
        let solid = scene.made_of(glass).into_iter().find_map(|m| scene.materials[m].interior());
        let Some(interior) = solid else {
            let (ior, depth) = (Ior::constant(1.0), Spectrum::Constant(0.0));
            let clear =
                |alpha| Material::ThinDielectric { ior: ior.clone(), alpha, tint: Some(tint.clone()), depth: depth.clone() };
            let clear = self.push_rough(rough, clear);
            return self.by_specular(glass, clear);
        };
        let tint = Some(tint.clone()).filter(|tint| !is_one(tint));
        let clear = |alpha| Material::Dielectric { interior, alpha, tint: tint.clone(), antireflective: true };
        let clear = self.push_rough(rough, clear);
        let coloured = self.coloured_reflection(glass, clear, interior, rough)?;
        self.by_specular(coloured, clear)
    }

    /// Solid glass that reflects at normal incidence what its index and the factor of a colour say. Of less than the index says a share reflects, of more
    /// than that a mirror reflects the rest.
    fn coloured_reflection(&mut self, glass: usize, clear: usize, interior: usize, rough: &Roughness) -> Result<usize> {
        let rgb = self.colour_of_specular()?;
        if rgb == [1.0; 3] {
            return Ok(glass);
        }
        let ior = self.loader.scene.interiors[interior].ior.clone();
        let at_normal = |nm: f64| fresnel::dielectric(1.0, ior.eval(nm));
        let rgb = rgb.map(|c| (c * at_normal(LINE_D_NM)).min(1.0));
        let f0 = upsample::reflectance_from_linear_srgb(rgb).map_err(|e| self.node.fail(e, "use another colour"))?;
        let range = self.loader.reader.range;
        let share = Spectrum::sampled(range, |nm| (f0.eval(nm) / at_normal(nm).max(1e-9)).min(1.0));
        let more = Spectrum::sampled(range, |nm| ((f0.eval(nm) - at_normal(nm)) / (1.0 - at_normal(nm))).max(0.0));
        let less = self.mix(glass, clear, share.into());
        if more.mean(range.0, range.1) == 0.0 {
            return Ok(less);
        }
        let white = Texture::from(Spectrum::Constant(1.0));
        let mirror = self.push_rough(rough, |alpha| Material::ColoredConductor { reflectance: white.clone(), alpha });
        Ok(self.mix(mirror, less, more.into()))
    }
}
