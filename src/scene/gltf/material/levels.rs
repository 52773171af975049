//! Films and grains of glTF, of which pictures may say how thick they are and where they point. As of roughness, light meets one of a few levels: between
//! the two next to what a picture says chance decides in proportion.

use super::{Reader, colour, factor};
use crate::error::Result;
use crate::scene::gltf::texture::Use;
use crate::scene::json::{THICKEST_FILM, THINNEST_FILM};
use crate::scene::roughness::{Roughness, STEPS};
use crate::scene::texture::ImageTexture;
use crate::scene::{Grain, Material, Texture, ThinFilm};
use crate::spectrum::{Ior, LINE_D_NM, Spectrum};
use std::f64::consts::PI;
use std::sync::Arc;

/// Steps of a film's thickness, nm, and how many there are at most.
const STEP_NM: f64 = 10.0;
const MOST_STEPS: usize = 64;
/// Steps of a grain's direction over half a turn, after which it is the same again, and of its strength.
const DIRECTIONS: usize = 16;
const STRENGTHS: usize = 4;

/// Reflectances of metals of a pictured colour that films are worked out on.
const REFLECTANCES: [f64; 3] = [0.04, 0.4, 1.0];

/// The films of a surface.
pub(super) struct Films {
    /// How much of the surface has one.
    share: Texture,
    levels: Vec<ThinFilm>,
    /// Which level, if there are several.
    picture: Option<Texture>,
}

/// The grain of a surface.
pub(super) struct Grains {
    /// Its greatest strength, and its direction but for what a picture says.
    grain: Grain,
    /// Levels of its direction and strength.
    pictures: Option<[Texture; 2]>,
}

impl Reader<'_, '_, '_> {
    /// A material for each of `count` levels, of which `picture` says which.
    fn levels(
        &mut self,
        picture: &Texture,
        count: usize,
        mut make: impl FnMut(&mut Self, usize) -> Result<usize>,
    ) -> Result<usize> {
        if self.is_full() {
            let mean = picture.average(LINE_D_NM) * STEPS as f64;
            return make(self, (mean.round() as usize).min(count - 1));
        }
        let materials = (0..count).map(|level| make(self, level)).collect::<Result<Vec<_>>>()?;
        Ok(self.push(Material::Graded { materials, levels: 0..count, roughness: picture.clone() }))
    }

    /// The film that makes a surface iridescent, if there is one.
    pub(super) fn films(&mut self) -> Result<Option<Films>> {
        let Some(node) = self.extension("KHR_materials_iridescence") else { return Ok(None) };
        let share = self.share(factor(Some(&node), "iridescenceFactor", 0.0, 1.0)?, "iridescenceTexture", 0, None)?;
        let ior = Ior::constant(node.get("iridescenceIor").map_or(Ok(1.3), |n| Ok(n.number()?.clamp(1.0, 5.0)))?);
        let least = factor(Some(&node), "iridescenceThicknessMinimum", 100.0, THICKEST_FILM)?;
        let greatest = factor(Some(&node), "iridescenceThicknessMaximum", 400.0, THICKEST_FILM)?;
        if greatest > 0.0 && greatest < THINNEST_FILM {
            self.note(&format!("a film of {greatest} nm cannot be seen: thickness is in nm (KHR_materials_iridescence)"));
        }
        let steps = (((greatest - least).abs() / STEP_NM).ceil() as usize).clamp(1, MOST_STEPS);
        let picture = match self.info("iridescenceThicknessTexture") {
            Some(info) => {
                let wanted = Use::Channel(1, steps as f64 / STEPS as f64);
                self.textures.read(&info, self.uv_sets, wanted, Spectrum::Constant(1.0), None)?
            }
            None => None,
        };
        let at = |share: f64| ThinFilm { ior: ior.clone(), thickness_nm: least + share * (greatest - least) };
        let levels = match &picture {
            Some(_) => (0..=steps).map(|i| at(i as f64 / steps as f64)).collect(),
            None => vec![at(1.0)],
        };
        let is_there = !share.is_zero() && levels.iter().any(|film: &ThinFilm| film.thickness_nm > 0.0);
        Ok(is_there.then_some(Films { share, levels, picture }))
    }

    /// `bare`, or where there is a film what `make` makes, with that on it.
    fn filmed(&mut self, bare: usize, films: &Films, mut make: impl FnMut(&mut Self) -> Result<usize>) -> Result<usize> {
        let mut level = |reader: &mut Self, level: usize| {
            let filmed = make(reader)?;
            reader.loader.put_thin_film(filmed, &films.levels[level]);
            Ok(filmed)
        };
        let filmed = match &films.picture {
            Some(picture) => self.levels(picture, films.levels.len(), level)?,
            None => level(self, 0)?,
        };
        Ok(self.mix(filmed, bare, films.share.clone()))
    }

    pub(super) fn filmed_glass(
        &mut self,
        bare: usize,
        tint: &Texture,
        rough: &Roughness,
        films: &Option<Films>,
    ) -> Result<usize> {
        let Some(films) = films else { return Ok(bare) };
        let is_rough = |m: &usize| matches!(self.loader.scene.materials[*m], Material::Dielectric { alpha, .. } if alpha > 0.0);
        if self.loader.scene.made_of(bare).iter().any(is_rough) {
            self.note("iridescence of rough solid glass: ignored (KHR_materials_iridescence)");
            return Ok(bare);
        }
        self.filmed(bare, films, |reader| reader.glass(tint, rough))
    }

    /// What a film does depends on the metal's index: that of a dielectric with its reflectance, (n - 1)^2 / (n + 1)^2, as the extension has it.
    pub(super) fn filmed_metal(
        &mut self,
        bare: usize,
        reflectance: &Texture,
        rough: &Roughness,
        films: &Option<Films>,
    ) -> Result<usize> {
        let Some(films) = films else { return Ok(bare) };
        let range = self.loader.reader.range;
        let index = |r: f64| (1.0 + r.min(0.98).sqrt()) / (1.0 - r.min(0.98).sqrt());
        let on = |reader: &mut Self, reflectance: &dyn Fn(f64) -> f64| {
            let eta = Spectrum::sampled(range, |nm| index(reflectance(nm)));
            let conductor = |alpha| Material::Conductor { eta: eta.clone(), k: Spectrum::Constant(0.0), alpha };
            reader.filmed(bare, films, |reader| Ok(reader.push_rough(rough, conductor)))
        };
        if let Texture::Uniform(reflectance) = reflectance {
            return on(self, &|nm| reflectance.eval(nm));
        }
        // Of a picture's colours between a few reflectances, in proportion at each wavelength.
        let base = colour(self.pbr.as_ref(), "baseColorFactor", [1.0; 3], 1.0)?;
        let Some(info) = self.info("baseColorTexture") else {
            self.note("iridescence of metals that vertices colour: ignored (KHR_materials_iridescence)");
            return Ok(bare);
        };
        let mut filmed = on(self, &|_| REFLECTANCES[0])?;
        for pair in REFLECTANCES.windows(2) {
            let share = Use::Between(base, pair[0], pair[1]);
            let share = self.textures.read(&info, self.uv_sets, share, Spectrum::Constant(1.0), None)?;
            let more = on(self, &|_| pair[1])?;
            filmed = self.mix(more, filmed, share.unwrap_or(Spectrum::Constant(1.0).into()));
        }
        Ok(filmed)
    }

    /// The grain of what is brushed, if the material has one.
    pub(super) fn grains(&mut self) -> Result<Option<Grains>> {
        let Some(node) = self.extension("KHR_materials_anisotropy") else { return Ok(None) };
        let strength = factor(Some(&node), "anisotropyStrength", 0.0, 1.0)?;
        let rotation = node.get("anisotropyRotation").map_or(Ok(0.0), |n| n.within(-1e3, 1e3))?;
        let mut read = |wanted| match self.info("anisotropyTexture") {
            Some(info) => self.textures.read(&info, self.uv_sets, wanted, Spectrum::Constant(1.0), None),
            None => Ok(None),
        };
        let of_strength = STRENGTHS as f64 / STEPS as f64;
        let pictures = match (read(Use::Direction(DIRECTIONS as f64 / STEPS as f64))?, read(Use::Channel(2, of_strength))?) {
            (Some(Texture::Image(direction)), Some(strength)) => {
                // Between directions there is no mean.
                let direction = ImageTexture { nearest: true, ..ImageTexture::clone(&direction) };
                Some([Texture::Image(Arc::new(direction)), strength])
            }
            _ => None,
        };
        Ok((strength > 0.0).then_some(Grains { grain: Grain { strength, rotation }, pictures }))
    }

    /// What `make` makes, with a grain where there is one.
    pub(super) fn grained(&mut self, grains: &Option<Grains>, mut make: impl FnMut(&mut Self) -> Result<usize>) -> Result<usize> {
        let Some(Grains { grain, pictures }) = grains else { return make(self) };
        let mut with = |reader: &mut Self, grain: Grain| {
            let made = make(reader)?;
            reader.loader.put_grain(made, grain);
            Ok(made)
        };
        let Some([directions, strengths]) = pictures else { return with(self, *grain) };
        self.levels(directions, DIRECTIONS + 1, |reader, direction| {
            let rotation = grain.rotation + PI * direction as f64 / DIRECTIONS as f64;
            let of = |level: f64| Grain { strength: grain.strength * level / STRENGTHS as f64, rotation };
            match strengths.image().map(|picture| picture.image.range()) {
                Some([least, greatest]) if least == greatest => with(reader, of(least * STEPS as f64)),
                _ => reader.levels(strengths, STRENGTHS + 1, |reader, level| with(reader, of(level as f64))),
            }
        })
    }

    /// Does something in this material refract into a volume?
    pub(super) fn is_solid(&self, material: usize) -> bool {
        self.loader.scene.made_of(material).into_iter().any(|m| self.loader.scene.materials[m].interface().is_some())
    }
}
