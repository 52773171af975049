//! Pictures on surfaces, as a scene names them: `{"texture": "wood.jpg"}` where a reflectance, a share of a mixture or the radiance of a lamp stands.

use crate::channels::Bands;
use crate::color::upsample;
use crate::error::{Result, quoted};
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::json::spectra::{Place, SpectrumReader};
use crate::scene::texture::picture::{Encoding, Picture};
use crate::scene::texture::{Image, ImageTexture, Texels, Texture, Wrap};
use crate::spectrum::{Spectrum, unit_problem};
use std::sync::Arc;

/// What a file of bands has.
const TABLE_OF_BANDS: &str = "write one 'CHANNEL LOW_NM HIGH_NM [RESPONSE or mean]' per line";

/// Colours that were made into spectra already: their picture, whether it is light, and what its numbers are taken for.
pub(in crate::scene) type Key = (*const Picture, bool, Encoding);

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
        let lying = Lying::of(node)?;
        let scale = node.get("scale").map_or(Ok(1.0), |n| n.within(0.0, 1.0))?;
        let image = Arc::new(self.reader.picture(node, &file)?.numbers(1, scale));
        let factor = Spectrum::Constant(1.0);
        Ok(Some(Texture::Image(Arc::new(lying.picture(image, factor)))))
    }

    /// The picture that `node` names, if it is one: `{"texture", "tiles", "wrap", "filter", "linear", "scale"}`.
    pub(in crate::scene) fn image_texture(&mut self, node: &Node, place: Place) -> Result<Option<Texture>> {
        let Some(file) = node.get("texture") else { return Ok(None) };
        node.object("texture")?;
        let lying = Lying::of(node)?;
        let scale = match node.get("scale") {
            Some(n) if place == Place::Light => n.non_negative()?,
            Some(n) => n.within(0.0, 1.0)?,
            None => 1.0,
        };
        let as_it_is = node.get("linear").map_or(Ok(false), |n| n.boolean())?;
        let encoding = if as_it_is { Encoding::Linear } else { Encoding::Own };
        let light = place == Place::Light;
        let picture = self.reader.picture(node, &file)?;
        let key = (Arc::as_ptr(&picture), light, encoding);
        let image = match self.images.get(&key) {
            Some((_, image)) => image.clone(),
            None => {
                let image = Arc::new(self.image(&file, &picture, place, encoding)?);
                self.images.insert(key, (picture, image.clone()));
                image
            }
        };
        let is_measured = matches!(image.texels, Texels::Spectra { .. });
        let factor = if light && !is_measured { upsample::white() } else { Spectrum::Constant(1.0) }.scaled(scale);
        let texture = Texture::Image(Arc::new(lying.picture(image, factor)));
        if light {
            self.reader.check_light(node, &texture)?;
        }
        Ok(Some(texture))
    }

    /// The picture of normals of a `normal_map`: red to the right, green up the picture, blue outwards, a half standing for 0.
    pub(in crate::scene) fn normals(&mut self, node: &Node) -> Result<Arc<ImageTexture>> {
        let file = node.need("texture")?;
        let lying = Lying::of(node)?;
        let strength = node.get("strength").map_or(Ok(1.0), |n| n.within(-100.0, 100.0))?;
        let image = Arc::new(self.reader.picture(node, &file)?.normals(strength));
        Ok(Arc::new(lying.picture(image, Spectrum::Constant(1.0))))
    }

    fn image(&self, file: &Node, picture: &Picture, place: Place, encoding: Encoding) -> Result<Image> {
        let name = quoted(file.string()?);
        let (problem, remedy) = match place {
            Place::Light => ("a texel is too bright for single precision", "scale the picture"),
            _ => ("a texel is not within 0 to 1", "a reflectance or share lies between 0 and 1: scale the picture"),
        };
        let image = match picture.spectra() {
            Some(spectra) => {
                let hold = place != Place::Light;
                self.reader.remark_bins(file, spectra.edges_nm(), hold);
                let texels = Texels::Spectra { stored: spectra.clone(), hold };
                Some(Image { width: picture.width, height: picture.height, texels })
                    .filter(|_| !hold || spectra.greatest() <= 1.0)
            }
            None => picture.colors(place, encoding, &|rgb| rgb),
        };
        image.ok_or_else(|| file.fail(format!("{name}: {problem}"), remedy))
    }
}

impl SpectrumReader {
    /// The picture in `file`, which `node` names, with its bands where `node` has any.
    pub(in crate::scene) fn picture(&self, node: &Node, file: &Node) -> Result<Arc<Picture>> {
        let (_, bytes) = self.files.read(file)?;
        let bands = node.get("bands").map(|bands| self.bands(&bands)).transpose()?;
        let picture = self.files.pictures.decode(&bytes, &quoted(file.string()?), file, bands.as_ref())?;
        picture.notes.iter().for_each(|note| self.remarks.note(file, note));
        Ok(picture)
    }

    /// The bands of channels that do not say what they are: `[lowest, highest]` in nm, or a file with a table of them.
    fn bands(&self, node: &Node) -> Result<Bands> {
        if node.value.is_array() {
            let [lo, hi] = node.numbers()?;
            if let Some(problem) = unit_problem(lo, hi) {
                return Err(node.fail(problem, "give [lowest, highest] in nm"));
            }
            if !(lo > 0.0 && hi > lo) {
                return Err(node.fail(format!("{lo} to {hi} is no range"), "give [lowest, highest] in nm"));
            }
            return Ok(Bands::Range(lo, hi));
        }
        let (_, bytes) = self.files.read(node)?;
        let name = quoted(node.string()?);
        Bands::parse(&String::from_utf8_lossy(&bytes)).map_err(|problem| node.fail(format!("{name}: {problem}"), TABLE_OF_BANDS))
    }

    /// Notes where the bins of a spectral picture leave off.
    pub(in crate::scene) fn remark_bins(&self, node: &Node, edges_nm: &[f64], hold: bool) {
        let (lo, hi) = self.range;
        let (first, last) = (edges_nm[0], edges_nm[edges_nm.len() - 1]);
        if first > lo + 1e-3 || last < hi - 1e-3 {
            let beyond = if hold { "its end values are taken" } else { "it is taken to be dark" };
            let text =
                format!("the picture has bins from {first} to {last} nm; in the rest of the film's {lo} to {hi} nm {beyond}");
            self.remarks.note(node, &text);
        }
    }
}

/// How a picture lies on a surface.
struct Lying {
    /// From the surface's coordinates to its own.
    to_image: [[f64; 3]; 2],
    /// What is beside it.
    wrap: Wrap,
    /// Has it hard texels?
    nearest: bool,
}

impl Lying {
    /// As `node` says, which names the picture.
    fn of(node: &Node) -> Result<Self> {
        let tiles: [f64; 2] = node.get("tiles").map_or(Ok([1.0; 2]), |n| n.numbers())?;
        if let (Some(node), true) = (node.get("tiles"), tiles.iter().any(|t| !(1e-3..=1e3).contains(&t.abs()))) {
            return Err(
                node.fail("a picture is repeated 0.001 to 1000 times", "give two such numbers, negative ones to mirror it")
            );
        }
        let wrap = match node.get("wrap").map(|n| n.choice(&["repeat", "mirror", "clamp"])).transpose()? {
            Some("mirror") => Wrap::Mirror,
            Some("clamp") => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        let nearest = node.get("filter").map(|n| n.choice(&["linear", "nearest"])).transpose()? == Some("nearest");
        Ok(Lying { to_image: [[tiles[0], 0.0, 0.0], [0.0, tiles[1], 0.0]], wrap, nearest })
    }

    /// This picture so.
    fn picture(self, image: Arc<Image>, factor: Spectrum) -> ImageTexture {
        let Lying { to_image, wrap, nearest } = self;
        ImageTexture { image, wrap: [wrap; 2], nearest, to_image, factor, cutoff: None, set: 0, tinted: false }
    }
}
