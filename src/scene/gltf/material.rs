//! glTF materials as Abbe's: metal is a conductor, transmission glass, the rest paint under a coat, and what lies between a mixture; alpha mixes with
//! nothing at all. A clear coat lies on metal, and on paint in place of paint's own coat, from which nothing would tell it: their indices are the same.

use crate::color::cie;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::gltf::texture::{Textures, Use, UvSets};
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::roughness::{self, Roughness};
use crate::scene::texture::{ImageTexture, Texels};
use crate::scene::{Emission, Material, Texture};
use crate::spectrum::library::Observer;
use crate::spectrum::{LINE_D_NM, Spectrum};
use std::sync::Arc;

mod coat;
mod glass;
mod levels;
mod paint;
pub(in crate::scene::gltf) mod specular_glossiness;

/// A material and what it emits.
#[derive(Clone)]
pub(in crate::scene) struct Look {
    pub material: usize,
    pub emission: Option<Emission>,
    /// The sets of texture coordinates that its pictures use.
    pub uv_sets: UvSets,
    /// The name of its glass, if that has no thickness: thin panes, or a body whose file does not say so.
    pub pane: Option<String>,
}

/// Radiance, intensity or irradiance of a light whose linear RGB is photometric: (1, 1, 1) is D65 of 1 cd m^-2, cd or lx.
pub(in crate::scene) fn photometric(node: &Node, rgb: [f64; 3], factor: f64) -> Result<Spectrum> {
    let spectrum = upsample::emission_from_linear_srgb(rgb).map_err(|problem| node.fail(problem, "use a colour of 0 or more"))?;
    Ok(spectrum.scaled(factor / cie::xyz_of_unit(Observer::Cie1931)[1]))
}

/// Textures that are read. Those of one material use one set of coordinates.
const SLOTS: &[&str] = &[
    "baseColorTexture",
    "metallicRoughnessTexture",
    "emissiveTexture",
    "transmissionTexture",
    "specularTexture",
    "specularColorTexture",
    "diffuseTransmissionTexture",
    "diffuseTransmissionColorTexture",
    "clearcoatTexture",
    "clearcoatRoughnessTexture",
    "clearcoatNormalTexture",
    "iridescenceTexture",
    "iridescenceThicknessTexture",
    "anisotropyTexture",
    "sheenColorTexture",
    "sheenRoughnessTexture",
    "normalTexture",
    "diffuseTexture",
    "specularGlossinessTexture",
];

/// Extensions that these are in.
const PICTURED: [&str; 8] = [
    "transmission",
    "diffuse_transmission",
    "specular",
    "clearcoat",
    "iridescence",
    "anisotropy",
    "sheen",
    "pbrSpecularGlossiness",
];

/// What is older than metalness, and takes the place of that.
const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
/// Where there are more materials, pictures make no more of them.
const MOST_MATERIALS: usize = 1 << 15;

/// One glTF material being read.
struct Reader<'r, 'n, 't> {
    loader: &'r mut Loader,
    textures: &'r mut Textures<'t>,
    node: &'r Node<'n>,
    pbr: Option<Node<'n>>,
    uv_sets: UvSets,
    /// Is glass without a thickness solid?
    solid: bool,
    /// Do the colours of vertices tint its base colour?
    coloured: bool,
    /// The name of the glass that has none.
    pane: Option<String>,
}

/// Adds a glTF material to the scene, but for its emission where the scene's material `given` replaces it; its glass is `solid` whatever the file says, and
/// its colour is that of vertices too where it is `coloured`.
pub(in crate::scene) fn material(
    loader: &mut Loader,
    textures: &mut Textures,
    node: &Node,
    given: Option<usize>,
    solid: bool,
    coloured: bool,
) -> Result<Look> {
    let pbr = node.get("pbrMetallicRoughness");
    let mut reader = Reader { loader, textures, node, pbr, uv_sets: UvSets::default(), solid, coloured, pane: None };
    let slots: &[&str] = if given.is_some() { &["emissiveTexture"] } else { SLOTS };
    reader.uv_sets = UvSets::of(slots.iter().filter_map(|slot| reader.info(slot)))?;
    if reader.extension("KHR_materials_unlit").is_some() && given.is_none() {
        return reader.unlit();
    }
    let emission = reader.emission()?;
    let material = match given {
        Some(given) => given,
        None => {
            let surface = match reader.extension(SPECULAR_GLOSSINESS) {
                Some(node) => reader.specular_glossiness(&node)?,
                None => reader.surface()?,
            };
            let surface = reader.normal_mapped(surface)?;
            reader.present(surface, emission.is_some())?
        }
    };
    Ok(Look { material, emission, uv_sets: reader.uv_sets, pane: reader.pane })
}

impl<'n> Reader<'_, 'n, '_> {
    fn extension(&self, name: &str) -> Option<Node<'n>> {
        self.node.get("extensions").and_then(|e| e.get(name))
    }

    /// The textureInfo of a slot, wherever it stands.
    fn info(&self, slot: &str) -> Option<Node<'n>> {
        let extensions = PICTURED.map(|name| format!("KHR_materials_{name}"));
        let places = [self.pbr.clone(), Some(self.node.clone())].into_iter().chain(extensions.map(|name| self.extension(&name)));
        places.flatten().find_map(|place| place.get(slot))
    }

    fn note(&mut self, text: &str) {
        self.loader.note(format!("{}: {text}", self.node.file.display()));
    }

    /// Adds the material that `make` makes of a GGX width, of this roughness.
    fn push_rough(&mut self, roughness: &Roughness, make: impl Fn(f64) -> Material) -> usize {
        let material = match roughness {
            Roughness::Picture(picture, _) if self.is_full() => make(roughness::width(picture.average(LINE_D_NM))),
            roughness => self.loader.rough(roughness, make),
        };
        self.push(material)
    }

    /// Have pictures of roughness, films and grains made so many materials that means must do for the rest?
    fn is_full(&mut self) -> bool {
        let full = self.loader.scene.materials.len() > MOST_MATERIALS;
        if full {
            self.note(&format!(
                "pictures of roughness, films and grains come to more than {MOST_MATERIALS} materials: of the rest of them the mean counts"
            ));
        }
        full
    }

    fn push(&mut self, material: Material) -> usize {
        self.loader.scene.materials.push(material);
        self.loader.scene.materials.len() - 1
    }

    /// `weight` of `a`, the rest of `b`, or one of the two alone.
    fn mix(&mut self, a: usize, b: usize, weight: Texture) -> usize {
        match weight {
            Texture::Uniform(Spectrum::Constant(1.0)) => a,
            Texture::Uniform(Spectrum::Constant(0.0)) => b,
            weight => self.push(Material::Mix { a, b, weight }),
        }
    }

    /// A number in [0, 1] from a factor and a channel of a texture.
    fn share(&mut self, factor: f64, slot: &str, channel: usize, cutoff: Option<f64>) -> Result<Texture> {
        if let (Some(info), true) = (self.info(slot), factor > 0.0) {
            let one = Spectrum::Constant(1.0);
            if let Some(texture) = self.textures.read(&info, self.uv_sets, Use::Channel(channel, factor), one, cutoff)? {
                return Ok(texture);
            }
        }
        Ok(Spectrum::Constant(cutoff.map_or(factor, |cutoff| f64::from(u8::from(factor >= cutoff)))).into())
    }

    fn surface(&mut self) -> Result<usize> {
        let metallic = factor(self.pbr.as_ref(), "metallicFactor", 1.0, 1.0)?;
        let transmission = factor(self.extension("KHR_materials_transmission").as_ref(), "transmissionFactor", 0.0, 1.0)?;
        let metallic = self.share(metallic, "metallicRoughnessTexture", 2, None)?;
        let transmission = self.share(transmission, "transmissionTexture", 0, None)?;
        let rough = self.roughness(self.pbr.clone(), "roughnessFactor", 1.0, "metallicRoughnessTexture")?;
        let lacquer = self.lacquer()?;
        let sheen = self.sheen()?;
        let films = self.films()?;
        let grains = self.grains()?;
        let is = |share: &Texture, value: f64| matches!(share, Texture::Uniform(Spectrum::Constant(v)) if *v == value);
        let reflectance = self.base_colour()?;
        let mut surface = None;
        if !is(&metallic, 1.0) && !is(&transmission, 1.0) {
            if films.is_some() {
                self.note("iridescence of what is neither metal nor glass: ignored (KHR_materials_iridescence)");
            }
            if grains.is_some() {
                self.note("anisotropy of gloss on paint: ignored, it is the same in all directions (KHR_materials_anisotropy)");
            }
            let paint = self.paint(&reflectance)?;
            let glossy = self.glossy(paint, &rough)?;
            let bare = self.lacquered(paint, glossy, &lacquer);
            surface = Some(self.under_sheen(bare, &sheen));
        }
        if !is(&metallic, 1.0) && !is(&transmission, 0.0) {
            let make = |reader: &mut Self| {
                let glass = reader.glass(&reflectance, &rough)?;
                reader.filmed_glass(glass, &reflectance, &rough, &films)
            };
            let mut glass = make(self)?;
            if grains.is_some() && self.is_solid(glass) {
                self.note("anisotropy of solid glass: ignored (KHR_materials_anisotropy)");
            } else if grains.is_some() {
                glass = self.grained(&grains, make)?;
            }
            let glass = self.less_specular(glass, &reflectance, &rough)?;
            if sheen.is_some() {
                self.note("sheen on glass: ignored (KHR_materials_sheen)");
            }
            if lacquer.is_some() {
                self.note("clear coats on glass: ignored (KHR_materials_clearcoat)");
            }
            surface = Some(surface.map_or(glass, |under| self.mix(glass, under, transmission)));
        }
        if !is(&metallic, 0.0) {
            let metal = self.grained(&grains, |reader| {
                let metal = |alpha| Material::ColoredConductor { reflectance: reflectance.clone(), alpha };
                let metal = reader.push_rough(&rough, metal);
                reader.filmed_metal(metal, &reflectance, &rough, &films)
            })?;
            let metal = self.lacquered(metal, metal, &lacquer);
            let metal = self.under_sheen(metal, &sheen);
            surface = Some(surface.map_or(metal, |under| self.mix(metal, under, metallic)));
        }
        Ok(surface.unwrap_or_else(|| self.loader.black()))
    }

    /// The same where alpha says that it is there, and elsewhere nothing.
    fn present(&mut self, surface: usize, emits: bool) -> Result<usize> {
        let mode = match self.node.get("alphaMode") {
            Some(mode) => mode.choice(&["OPAQUE", "MASK", "BLEND"])?,
            None => "OPAQUE",
        };
        if mode == "OPAQUE" {
            return Ok(surface);
        }
        let by_diffuse = self.extension(SPECULAR_GLOSSINESS);
        let (factor_of, slot) = match &by_diffuse {
            Some(node) => (node.get("diffuseFactor"), "diffuseTexture"),
            None => (self.pbr.as_ref().and_then(|p| p.get("baseColorFactor")), "baseColorTexture"),
        };
        let opacity = match factor_of.and_then(|f| f.element(3)) {
            Some(alpha) => alpha.number()?.clamp(0.0, 1.0),
            None => 1.0,
        };
        let cutoff = if mode == "MASK" { Some(factor(Some(self.node), "alphaCutoff", 0.5, 1e3)?) } else { None };
        let presence = self.share(opacity, slot, 3, cutoff)?;
        if is_one(&presence) {
            return Ok(surface);
        }
        let surface = self.thin(surface);
        if emits {
            self.note("a surface that emits does so where it is transparent too");
        }
        let nothing = self.push(Material::NOTHING);
        Ok(self.mix(surface, nothing, presence))
    }

    fn normal_mapped(&mut self, base: usize) -> Result<usize> {
        let Some(info) = self.node.get("normalTexture") else { return Ok(base) };
        let normals = self.map_of_normals(&info)?;
        Ok(normals.map_or(base, |normals| self.push(Material::NormalMapped { base, normals })))
    }

    fn map_of_normals(&mut self, info: &Node) -> Result<Option<Arc<ImageTexture>>> {
        let scale = info.get("scale").map_or(Ok(1.0), |n| n.within(-100.0, 100.0))?;
        let normals = self.textures.read(info, self.uv_sets, Use::Normals(scale), Spectrum::Constant(1.0), None)?;
        Ok(normals.and_then(|normals| normals.image().cloned()))
    }

    /// Roughness from a factor of `node` and the green channel of a texture.
    fn roughness(&mut self, node: Option<Node<'n>>, key: &str, default: f64, slot: &str) -> Result<Roughness> {
        let factor = factor(node.as_ref(), key, default, 1.0)?;
        Ok(Roughness::pictured(self.share(factor, slot, 1, None)?))
    }

    /// KHR_materials_unlit: it shines as bright as it is painted, 1 cd m^-2 where that is white, and reflects nothing.
    fn unlit(&mut self) -> Result<Look> {
        self.note("unlit surfaces shine by themselves, as bright as daylight makes white ones (KHR_materials_unlit)");
        let base = colour(self.pbr.as_ref(), "baseColorFactor", [1.0; 3], 1.0)?;
        let white = upsample::white().scaled(1.0 / cie::xyz_of_unit(Observer::Cie1931)[1]);
        let picture = match self.info("baseColorTexture") {
            Some(info) => self.textures.read(&info, self.uv_sets, Use::Light(base), white, None)?,
            None => None,
        };
        let radiance = match picture {
            Some(picture) => picture,
            None => photometric(self.node, base, 1.0)?.into(),
        };
        let radiance = self.tinted(radiance);
        let material = self.loader.black();
        let material = self.present(material, true)?;
        let emission = (!radiance.is_zero()).then_some(Emission { radiance, two_sided: true });
        Ok(Look { material, emission, uv_sets: self.uv_sets, pane: None })
    }

    fn emission(&mut self) -> Result<Option<Emission>> {
        let emissive = colour(Some(self.node), "emissiveFactor", [0.0; 3], 1e12)?;
        let strength = factor(self.extension("KHR_materials_emissive_strength").as_ref(), "emissiveStrength", 1.0, 1e12)?;
        if emissive.iter().all(|v| *v * strength == 0.0) {
            return Ok(None);
        }
        let two_sided = self.node.get("doubleSided").map_or(Ok(false), |n| n.boolean())?;
        let white = upsample::white().scaled(strength / cie::xyz_of_unit(Observer::Cie1931)[1]);
        let picture = match self.info("emissiveTexture") {
            Some(info) => self.textures.read(&info, self.uv_sets, Use::Light(emissive), white, None)?,
            None => None,
        };
        let radiance = match picture {
            Some(picture) if picture.is_zero() => return Ok(None),
            Some(picture) => picture,
            None => photometric(self.node, emissive, strength)?.into(),
        };
        self.loader.reader.check_light(self.node, &radiance)?;
        Ok(Some(Emission { radiance, two_sided }))
    }
}

/// A number, the nearest in [0, `most`]: what is beyond by more than rounding is noted ([`super::properties`]).
fn factor(node: Option<&Node>, key: &str, default: f64, most: f64) -> Result<f64> {
    node.and_then(|n| n.get(key)).map_or(Ok(default), |v| Ok(v.number()?.clamp(0.0, most)))
}

/// A colour, each number the nearest in [0, `most`].
fn colour(node: Option<&Node>, key: &str, default: [f64; 3], most: f64) -> Result<[f64; 3]> {
    let Some(value) = node.and_then(|n| n.get(key)) else { return Ok(default) };
    let items = value.array(3)?;
    let mut rgb = [0.0; 3];
    for (c, item) in rgb.iter_mut().zip(&items) {
        *c = item.number()?.clamp(0.0, most);
    }
    Ok(rgb)
}

/// A colour in linear sRGB as a reflectance.
fn rgb_texture(node: &Node, rgb: [f64; 3]) -> Result<Texture> {
    Ok(upsample::reflectance_from_linear_srgb(rgb).map_err(|e| node.fail(e, "use another colour"))?.into())
}

/// Is it 1 everywhere? Colours are taken not to be: of them only the brightest wavelength is known.
fn is_one(share: &Texture) -> bool {
    match share {
        Texture::Uniform(spectrum) => *spectrum == Spectrum::Constant(1.0),
        Texture::Image(picture) => {
            let least = picture.image.range()[0] * picture.factor.eval(550.0);
            matches!(picture.image.texels, Texels::Numbers { .. }) && least >= picture.cutoff.unwrap_or(1.0 - 1e-6)
        }
    }
}
