//! Pictures on surfaces, as a scene names them: `{"texture": "wood.jpg"}` where a reflectance, a share of a mixture or the radiance of a lamp stands.

use crate::color::upsample;
use crate::error::{Result, quoted};
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::json::spectra::Place;
use crate::scene::texture::picture;
use crate::scene::texture::{Image, ImageTexture, Texture, Wrap};
use crate::spectrum::Spectrum;
use std::sync::Arc;

/// A picture that was read already: its file, whether it holds light, and whether whole numbers in it are shares as they are.
pub(in crate::scene) type Key = (std::path::PathBuf, bool, bool);

impl Loader {
    /// A share in [0, 1]: a spectrum, or a picture.
    pub(in crate::scene) fn share(&mut self, node: &Node) -> Result<Texture> {
        match self.image_texture(node, Place::Share)? {
            Some(image) => Ok(image),
            None => Ok(self.reader.spectrum(node, Place::Share)?.into()),
        }
    }

    /// A picture of numbers in [0, 1], if `node` names one: the green channel as it is stored, where glTF keeps roughness.
    pub(in crate::scene) fn number_texture(&mut self, node: &Node) -> Result<Option<Texture>> {
        let Some(file) = node.get("texture") else { return Ok(None) };
        node.object("texture")?;
        let (to_image, wrap, nearest) = placing(node)?;
        let scale = node.get("scale").map_or(Ok(1.0), |n| n.within(0.0, 1.0))?;
        let (_, bytes) = self.reader.files.read(&file)?;
        let picture = picture::decode(&bytes, &quoted(file.string()?), &file)?;
        let image = Arc::new(picture.numbers(picture.pixels.iter().map(|p| f64::from(p[1]).clamp(0.0, 1.0))));
        let factor = Spectrum::Constant(scale);
        Ok(Some(Texture::Image(Arc::new(ImageTexture { image, wrap: [wrap; 2], nearest, to_image, factor, cutoff: None }))))
    }

    /// The picture that `node` names, if it is one: `{"texture", "tiles", "wrap", "filter", "linear", "scale"}`.
    pub(in crate::scene) fn image_texture(&mut self, node: &Node, place: Place) -> Result<Option<Texture>> {
        let Some(file) = node.get("texture") else { return Ok(None) };
        node.object("texture")?;
        let (to_image, wrap, nearest) = placing(node)?;
        let scale = match node.get("scale") {
            Some(n) if place == Place::Light => n.non_negative()?,
            Some(n) => n.within(0.0, 1.0)?,
            None => 1.0,
        };
        let as_it_is = node.get("linear").map_or(Ok(false), |n| n.boolean())?;
        let light = place == Place::Light;
        let key = (self.reader.files.base.join(file.string()?), light, as_it_is);
        let image = match self.images.get(&key) {
            Some(image) => image.clone(),
            None => {
                let image = Arc::new(self.image(&file, place, as_it_is)?);
                self.images.insert(key, image.clone());
                image
            }
        };
        let factor = if light { upsample::white() } else { Spectrum::Constant(1.0) }.scaled(scale);
        let texture = Texture::Image(Arc::new(ImageTexture { image, wrap: [wrap; 2], nearest, to_image, factor, cutoff: None }));
        if light {
            self.reader.check_light(node, &texture)?;
        }
        Ok(Some(texture))
    }

    /// The picture of normals of a `normal_map`: red to the right, green up the picture, blue outwards, a half standing for 0.
    pub(in crate::scene) fn normals(&mut self, node: &Node) -> Result<Arc<ImageTexture>> {
        let file = node.need("texture")?;
        let (to_image, wrap, nearest) = placing(node)?;
        let strength = node.get("strength").map_or(Ok(1.0), |n| n.within(-100.0, 100.0))?;
        let (_, bytes) = self.reader.files.read(&file)?;
        let image = Arc::new(picture::decode(&bytes, &quoted(file.string()?), &file)?.normals(strength));
        Ok(Arc::new(ImageTexture { image, wrap: [wrap; 2], nearest, to_image, factor: Spectrum::Constant(1.0), cutoff: None }))
    }

    fn image(&self, file: &Node, place: Place, as_it_is: bool) -> Result<Image> {
        let (_, bytes) = self.reader.files.read(file)?;
        let name = quoted(file.string()?);
        let picture = picture::decode(&bytes, &name, file)?;
        let colours = picture.linear(picture.encoded && !as_it_is).map(|[r, g, b, _]| [r, g, b]);
        let (problem, remedy) = match place {
            Place::Light => ("a texel is too bright for single precision", "scale the picture"),
            _ => ("a texel is not within 0 to 1", "a reflectance or share lies between 0 and 1: scale the picture"),
        };
        picture.spectra(colours, place).ok_or_else(|| file.fail(format!("{name}: {problem}"), remedy))
    }
}

/// How the picture that `node` names lies on a surface: from the surface's coordinates to its own, what is beside it, and whether it has hard texels.
fn placing(node: &Node) -> Result<([[f64; 3]; 2], Wrap, bool)> {
    let tiles: [f64; 2] = node.get("tiles").map_or(Ok([1.0; 2]), |n| n.numbers())?;
    if let (Some(node), true) = (node.get("tiles"), tiles.iter().any(|t| !(1e-3..=1e3).contains(&t.abs()))) {
        return Err(node.fail("a picture is repeated 0.001 to 1000 times", "give two such numbers, negative ones to mirror it"));
    }
    let wrap = match node.get("wrap").map(|n| n.choice(&["repeat", "mirror", "clamp"])).transpose()? {
        Some("mirror") => Wrap::Mirror,
        Some("clamp") => Wrap::Clamp,
        _ => Wrap::Repeat,
    };
    let nearest = node.get("filter").map(|n| n.choice(&["linear", "nearest"])).transpose()? == Some("nearest");
    Ok(([[tiles[0], 0.0, 0.0], [0.0, tiles[1], 0.0]], wrap, nearest))
}
