//! Glass of glTF: panes and solids.

use super::{Reader, colour, factor, is_one};
use crate::bsdf::fresnel;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::roughness::Roughness;
use crate::scene::{Interior, Material, Texture};
use crate::spectrum::{Ior, LINE_D_NM, Spectrum};

/// Indices above are as good as infinite: 10,000 reflects all but 0.04 %.
const GREATEST_INDEX: f64 = 1e4;

impl Reader<'_, '_, '_> {
    /// Glass of this roughness; its base colour tints what gets through, at each surface anew.
    pub(super) fn glass(&mut self, base: &Texture, rough: &Roughness) -> Result<usize> {
        let Some(ior) = self.ior()? else {
            // An infinite index reflects all light.
            let white = Texture::from(Spectrum::Constant(1.0));
            return Ok(self.push_rough(rough, |alpha| Material::ColoredConductor { reflectance: white.clone(), alpha }));
        };
        let tint = Some(base.clone()).filter(|tint| !matches!(tint, Texture::Uniform(Spectrum::Constant(1.0))));
        let name = self.node.get("name").and_then(|n| n.value.as_str()).unwrap_or("glass").to_string();
        let volume = self
            .extension("KHR_materials_volume")
            .filter(|v| v.get("thicknessFactor").is_some_and(|t| t.number().is_ok_and(|t| t > 0.0)));
        if volume.is_none() && !self.solid {
            self.note(&format!(
                "the glass {name:?} has no thickness (KHR_materials_volume) and counts as a thin pane that refracts nothing; to make it solid, \
                 set a thickness in the exporter or \"override\" it in a scene"
            ));
            self.pane = Some(name);
            let (ior, _) = self.gloss()?;
            let depth = Spectrum::Constant(0.0);
            let pane = |alpha| Material::ThinDielectric { ior: ior.clone(), alpha, tint: tint.clone(), depth: depth.clone() };
            return Ok(self.push_rough(rough, pane));
        }
        let volume = volume.or(self.extension("KHR_materials_volume"));
        let sigma_a = volume.map_or(Ok(Spectrum::Constant(0.0)), |volume| absorption(&volume, self.loader.reader.range))?;
        let interior = self.loader.volume(Interior { ior, priority: 1, sigma_a, ..Interior::vacuum(&name) });
        Ok(self.push_rough(rough, |alpha| Material::Dielectric { interior, alpha, tint: tint.clone(), antireflective: false }))
    }

    /// The index of refraction: of the glass that the material's custom property "glass" names, or from KHR_materials_ior and the dispersion, which may
    /// be a custom property too, as not every exporter knows KHR_materials_dispersion. `None` stands for an infinite one, written as 0.
    pub(super) fn ior(&self) -> Result<Option<Ior>> {
        let extras = self.node.get("extras");
        if let Some(glass) = extras.as_ref().and_then(|e| e.get("glass")) {
            return self.loader.reader.ior(&glass).map(Some);
        }
        let ior = factor(self.extension("KHR_materials_ior").as_ref(), "ior", 1.5, f64::MAX)?;
        if ior == 0.0 || ior > GREATEST_INDEX {
            return Ok(None);
        }
        if ior < 1.0 {
            self.loader
                .reader
                .remarks
                .note(self.node, &format!("an index of {ior} counts as 1: it is 0, for one without end, or 1 and more"));
        }
        let dispersion = factor(self.extension("KHR_materials_dispersion").or(extras).as_ref(), "dispersion", 0.0, 100.0)?;
        let ior = Ior::from_abbe_number(ior.max(1.0), if dispersion > 0.0 { 20.0 / dispersion } else { f64::INFINITY });
        let (lo, hi) = self.loader.reader.range;
        ior.check_range(lo, hi).map_err(|problem| self.node.fail(problem, "use a smaller dispersion"))?;
        Ok(Some(ior))
    }

    /// The same with panes for solid glass, if there is some. What is behind a surface that is there in part would be glass for some of the light and none
    /// for the rest, which makes light or loses it; a thin wall has nothing behind it.
    pub(super) fn thin(&mut self, surface: usize) -> usize {
        let solid = self.loader.scene.made_of(surface).into_iter().find_map(|m| self.loader.scene.materials[m].interface());
        let Some((interior, _)) = solid else { return surface };
        let Interior { name, ior, .. } = self.loader.scene.interiors[interior].clone();
        self.note(&format!(
            "the solid glass {name:?} has an alpha below 1, of which no solid can be made: it counts as a thin pane that is there in part; set alphaMode \
             to OPAQUE for solid glass"
        ));
        self.thin_part(surface, &ior)
    }

    fn thin_part(&mut self, surface: usize, ior: &Ior) -> usize {
        if !self.is_solid(surface) {
            return surface;
        }
        let part = match self.loader.scene.materials[surface].clone() {
            Material::Dielectric { alpha, tint, antireflective, .. } => {
                let ior = if antireflective { Ior::constant(1.0) } else { ior.clone() };
                Material::ThinDielectric { ior, alpha, tint, depth: Spectrum::Constant(0.0) }
            }
            Material::Mix { a, b, weight } => Material::Mix { a: self.thin_part(a, ior), b: self.thin_part(b, ior), weight },
            Material::NormalMapped { base, normals } => Material::NormalMapped { base: self.thin_part(base, ior), normals },
            Material::Graded { mut materials, levels, roughness } => {
                materials.iter_mut().for_each(|level| *level = self.thin_part(*level, ior));
                Material::Graded { materials, levels, roughness }
            }
            _ => return surface,
        };
        self.push(part)
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

/// KHR_materials_volume: transmittance `attenuationColor` over `attenuationDistance` metres, as a coefficient in m^-1.
fn absorption(volume: &Node, range: (f64, f64)) -> Result<Spectrum> {
    let rgb = colour(Some(volume), "attenuationColor", [1.0; 3], 1.0)?;
    let Some(distance) = volume.get("attenuationDistance") else { return Ok(Spectrum::Constant(0.0)) };
    let distance = distance.length()?;
    if rgb == [1.0; 3] {
        return Ok(Spectrum::Constant(0.0));
    }
    let colour = upsample::reflectance_from_linear_srgb(rgb).map_err(|problem| volume.fail(problem, "use another colour"))?;
    Ok(colour.attenuation(distance, range))
}
