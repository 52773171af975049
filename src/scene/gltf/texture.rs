//! Textures of glTF materials: pictures in buffers, files and data URIs, samplers, and KHR_texture_transform.

use crate::error::Result;
use crate::scene::gltf::document::{Asset, item};
use crate::scene::gltf::material::specular_glossiness::mirror;
use crate::scene::gltf::uri;
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use crate::scene::json::spectra::Place;
use crate::scene::texture::picture::{Encoding, Picture, Shade, times};
use crate::scene::texture::{Image, ImageTexture, Texture, Wrap};
use crate::spectrum::Spectrum;
use gltf::texture::{MagFilter, WrappingMode};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// What of a picture is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) enum Use {
    /// Colours as reflectances, times these factors.
    Reflectance([f64; 3]),
    /// Colours as light, times these factors.
    Light([f64; 3]),
    /// A channel as a number, times this factor: 0 red to 3 alpha.
    Channel(usize, f64),
    /// Normals in tangent space, x and y times this factor.
    Normals(f64),
    /// Colours times these factors as what is reflected at normal incidence: the share of a mirror in it ([`specular_glossiness::mirror`]).
    MirrorShare([f64; 3]),
    /// And its colour.
    MirrorColour([f64; 3]),
    /// Colours times these factors as shares of the way from one number to another.
    Between([f64; 3], f64, f64),
    /// The direction in tangent space that red and green stand for, as a share of half a turn, times this factor.
    Direction(f64),
    /// One less alpha times this factor.
    RoughnessOfGlossiness(f64),
}

/// The pictures of a glTF file that were looked at already.
pub(in crate::scene) struct Textures<'a> {
    asset: &'a Asset,
    root: &'a Node<'a>,
    files: &'a Files,
    pictures: HashMap<u32, Arc<Picture>>,
    images: Vec<(u32, Use, Arc<Image>)>,
    /// What could not be honoured.
    pub notes: Vec<String>,
}

impl<'a> Textures<'a> {
    pub(in crate::scene) fn new(asset: &'a Asset, root: &'a Node<'a>, files: &'a Files) -> Self {
        Textures { asset, root, files, pictures: HashMap::new(), images: Vec::new(), notes: Vec::new() }
    }

    /// The texture that `info` (a glTF textureInfo) names, with `factor` on top and a `cutoff` perhaps; none if its picture cannot be read here. All
    /// textures of a material use these sets of coordinates.
    pub(in crate::scene) fn read(
        &mut self,
        info: &Node,
        sets: UvSets,
        wanted: Use,
        factor: Spectrum,
        cutoff: Option<f64>,
    ) -> Result<Option<Texture>> {
        let texture = item(self.root, "textures", &info.need("index")?)?;
        let webp = texture.get("extensions").and_then(|e| e.get("EXT_texture_webp")?.get("source"));
        let Some(source) = webp.or(texture.get("source")) else {
            self.notes.push("a texture in a format of an extension is ignored: export pictures as PNG or JPEG".into());
            return Ok(None);
        };
        let own = uv_set(info)?;
        let Some(set) = sets.0.iter().position(|set| *set == own) else {
            self.notes.push("a material's textures use more than two sets of coordinates: those of others are ignored".into());
            return Ok(None);
        };
        let sampler = texture.get("sampler").map(|s| s.integer(0, u32::MAX)).transpose()?;
        let sampler = sampler.and_then(|i| self.asset.gltf.samplers().nth(i as usize));
        let wrap = |mode: Option<WrappingMode>| match mode {
            Some(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Some(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let texture = ImageTexture {
            image: self.image(&source, wanted)?,
            wrap: [wrap(sampler.as_ref().map(|s| s.wrap_s())), wrap(sampler.as_ref().map(|s| s.wrap_t()))],
            nearest: sampler.as_ref().and_then(|s| s.mag_filter()) == Some(MagFilter::Nearest),
            to_image: transform(info)?,
            factor,
            cutoff,
            set,
            tinted: false,
        };
        Ok(Some(Texture::Image(Arc::new(texture))))
    }

    fn image(&mut self, source: &Node, wanted: Use) -> Result<Arc<Image>> {
        let index = source.integer(0, u32::MAX)?;
        if let Some((.., image)) = self.images.iter().find(|(i, used, _)| (*i, *used) == (index, wanted)) {
            return Ok(image.clone());
        }
        let picture = self.picture(source)?;
        // The document says what colours mean, not the picture (glTF 2.0, section 3.9.2).
        let coloured = |place, shade: Shade| {
            let image = picture.colors(place, Encoding::Srgb, shade);
            image.ok_or_else(|| source.fail("a texel is out of range", "export the picture again"))
        };
        let mirror_at = |rgb: [f64; 3], factors: [f64; 3]| mirror(std::array::from_fn(|i| rgb[i] * factors[i]));
        let image = match wanted {
            Use::Reflectance(factors) => coloured(Place::Share, &times(factors))?,
            Use::Light(factors) => coloured(Place::Light, &times(factors))?,
            Use::MirrorColour(factors) => coloured(Place::Share, &|rgb| mirror_at(rgb, factors).1)?,
            Use::MirrorShare(factors) => picture.shares(1.0, |i| mirror_at(picture.linear_at(i, Encoding::Srgb), factors).0),
            Use::Between(factors, low, high) => {
                let share = |v: f64| ((v - low) / (high - low)).clamp(0.0, 1.0);
                coloured(Place::Share, &|rgb| times(factors)(rgb).map(share))?
            }
            Use::Direction(scale) => picture.shares(scale, |i| {
                let [x, y] = [0, 1].map(|channel| 2.0 * picture.number(i, channel) - 1.0);
                y.atan2(x).rem_euclid(PI) / PI
            }),
            Use::RoughnessOfGlossiness(factor) => picture.shares(1.0, |i| 1.0 - factor * picture.number(i, 3)),
            Use::Normals(scale) => picture.normals(scale),
            Use::Channel(channel, factor) => picture.numbers(channel, factor),
        };
        let image = Arc::new(image);
        self.images.push((index, wanted, image.clone()));
        Ok(image)
    }

    fn picture(&mut self, source: &Node) -> Result<Arc<Picture>> {
        let index = source.integer(0, u32::MAX)?;
        if let Some(picture) = self.pictures.get(&index) {
            return Ok(picture.clone());
        }
        let node = item(self.root, "images", source)?;
        let owned;
        let bytes: &[u8] = match (node.get("uri"), node.get("bufferView")) {
            (Some(uri), _) => {
                owned = uri::read(&uri, self.files)?;
                &owned
            }
            (None, Some(index)) => self.asset.bytes_of_view(self.root, &index)?,
            (None, None) => return Err(node.fail("the picture has no data", "export the file again")),
        };
        let picture = self.files.pictures.decode(bytes, "the picture", &node, None)?;
        self.pictures.insert(index, picture.clone());
        Ok(picture)
    }
}

fn extension<'a>(info: &Node<'a>) -> Option<Node<'a>> {
    info.get("extensions").and_then(|e| e.get("KHR_texture_transform"))
}

/// The sets of texture coordinates that a material's pictures use, of which there are two at most: the first twice where there is one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::scene) struct UvSets(pub [u32; 2]);

impl UvSets {
    /// The first two different sets of these textureInfos.
    pub(in crate::scene) fn of<'a>(infos: impl Iterator<Item = Node<'a>>) -> Result<Self> {
        let sets = infos.map(|info| uv_set(&info)).collect::<Result<Vec<_>>>()?;
        let first = sets.first().copied().unwrap_or(0);
        Ok(UvSets([first, sets.into_iter().find(|set| *set != first).unwrap_or(first)]))
    }

    /// Is there a second one?
    pub(in crate::scene) fn are_two(self) -> bool {
        self.0[0] != self.0[1]
    }
}

/// The set of texture coordinates that a textureInfo uses.
fn uv_set(info: &Node) -> Result<u32> {
    let own = extension(info).and_then(|t| t.get("texCoord")).or_else(|| info.get("texCoord"));
    own.map_or(Ok(0), |n| n.integer(0, 15))
}

/// KHR_texture_transform: scale, then a turn counter-clockwise as seen with v downwards, then the offset.
fn transform(info: &Node) -> Result<[[f64; 3]; 2]> {
    let Some(t) = extension(info) else { return Ok([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) };
    let pair = |key: &str, default: f64| t.get(key).map_or(Ok([default; 2]), |n| n.numbers::<2>());
    let ([sx, sy], [x, y]) = (pair("scale", 1.0)?, pair("offset", 0.0)?);
    if [sx, sy, x, y].iter().any(|v| v.abs() > 1e6) {
        return Err(t.fail("the picture is scaled or moved by more than 1e6", "export the file again"));
    }
    let (sin, cos) = t.get("rotation").map_or(Ok(0.0), |n| n.within(-1e3, 1e3))?.sin_cos();
    Ok([[cos * sx, sin * sy, x], [-sin * sx, cos * sy, y]])
}
