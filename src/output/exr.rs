//! The spectral EXR: Fichet, Pacanowski & Wilkie, "An OpenEXR Layout for Spectral Images", JCGT 10(3), 2021.
//!
//! The display window is the picture, the data window what of it was rendered. Channels, all 32-bit float:
//! - `S0.390,000000nm` for every bin, named by its centre: mean radiance over the bin, W m^-2 sr^-1 nm^-1 (irradiance, W m^-2
//!   nm^-1, from an irradiance sensor; the attribute `abbe.quantity` says which);
//! - `R`, `G`, `B`: linear sRGB for viewers, the film's XYZ times 2^`EV`, where at `EV` 0 the equal-energy spectrum of 1 W m^-2
//!   sr^-1 nm^-1 has luminance 1, as in [`crate::develop::picture`];
//! - `XYZ.X`, `XYZ.Y`, `XYZ.Z`: CIE 1931 in cd m^-2 (or lx), accumulated at the sampled wavelengths;
//! - on request ([`Aovs`]): `error.Y`, the standard error of `XYZ.Y`, and `error.390,000000nm`, that of the bin (see [`Errors`]);
//! - likewise `depth.Z`, `normal.X` `normal.Y` `normal.Z`, `albedo.R` `albedo.G` `albedo.B`: what rays meet first, as the attributes
//!   `abbe.depth`, `abbe.normal` and `abbe.albedo` explain;
//! - likewise `behind.depth.Z`, `behind.normal.X`, `behind.albedo.R` and so on: what rays meet first that is neither smooth glass nor a mirror, of scenes that
//!   have such;
//! - likewise `half.390,000000nm`, `half.XYZ.Y`, `half.depth.Z` and so on: half the difference of two halves of the samples, for the denoiser
//!   ([`Film::half_difference`]).
//!
//! The attribute `abbe.meanErrors` has the standard error of every bin's mean over the image, bins in increasing order, blanks between, estimated from `abbe.meanGroups` groups of batches: pixels
//! may share part of their errors, so it does not follow from theirs.
//!
//! The prefixes keep what is not a spectral channel from readers of the layout, and a bare `Y` from viewers that would take the
//! file for a luminance-chroma picture.

use super::picture::chromaticities;
use super::replace_file;
use crate::color::cie::xyz_of_unit;
use crate::color::convert::linear_srgb_of_xyz;
use crate::color::space::Space;
use crate::error::Result;
use crate::film::aov::AovBuffers;
use crate::film::{Errors, Film, Tile};
use crate::render::Rendering;
use crate::scene::{FilmSettings, Scene};
use crate::spectrum::library::Observer;
use crate::stats::BatchStats;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::image::{Encoding, Image, Layer};
use exr::meta::attribute::{AttributeValue, ChannelDescription, ChannelList, LevelMode, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{Compression, IntegerBounds, LineOrder, Vec2, WritableImage};
use serde_json::Value;
use std::path::Path;

/// Where a picture comes from: what its header says beside the layout's own attributes, which is all that reproducing it takes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    /// The scene's name.
    pub scene: String,
    /// A hash of the scene file and of all files that it includes.
    pub scene_hash: String,
    /// The greatest number of scattering events on a path.
    pub max_depth: u32,
    /// The device that rendered it.
    pub device: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// How paths were found, in words.
    pub techniques: String,
    /// Light paths were merged at visible points, or wavelengths shared ways, which blurs the picture within a pixel ([`crate::integrator::mean_squared_radius`]).
    pub merging: bool,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Counts of rays and of dropped samples.
    pub stats: BatchStats,
    /// Exposure in stops of the `R G B` preview, 0 unless given.
    pub exposure: Option<f64>,
    /// The pixels are irradiance instead of radiance.
    pub irradiance: bool,
    /// Of a camera with a lens: the pixels are irradiance on the film over this many sr ([`crate::lens::LensCamera::axial`]).
    pub film_sr: Option<f64>,
    /// The frame, of a sequence.
    pub frame: Option<u32>,
    /// What was asked for; null where that is not known.
    pub options: Value,
    /// It was interrupted before it came to what was asked for.
    pub interrupted: bool,
}

impl Provenance {
    /// Of a render of `scene` by a device of this name, which merges light paths or not, as far as it is.
    pub fn of(scene: &Scene, rendering: &Rendering, device: String, merging: bool, seed: u64, techniques: String) -> Self {
        Provenance {
            scene: scene.name.clone(),
            scene_hash: scene_hash(scene),
            max_depth: scene.max_depth,
            device,
            seed,
            techniques,
            merging,
            seconds: rendering.elapsed.as_secs_f64(),
            stats: rendering.stats,
            exposure: scene.film.exposure,
            irradiance: scene.sensor.area().is_some(),
            film_sr: scene.sensor.optics().map(|o| o.axial),
            ..Provenance::default()
        }
    }
}

/// What `abbe.sceneHash` says of a scene: the hash of its files' content.
pub fn scene_hash(scene: &Scene) -> String {
    format!("fnv1a64:{:016x}", scene.source_hash)
}

/// Which extra channels a file gets; none unless asked for.
#[derive(Debug, Clone, Copy, Default)]
pub struct Aovs<'a> {
    /// Standard errors of luminance and of every bin.
    pub errors: bool,
    /// Depth of these.
    pub depth: Option<&'a AovBuffers>,
    /// Normals of these.
    pub normal: Option<&'a AovBuffers>,
    /// Albedo of these.
    pub albedo: Option<&'a AovBuffers>,
    /// Depth, normals and albedo of what lies behind smooth glass and in mirrors.
    pub behind: Option<&'a AovBuffers>,
    /// Half the differences of two halves of the samples, of all of them and of the film.
    pub halves: bool,
}

/// Writes `film` as a spectral EXR (lossless ZIP), block by block from the film: no second copy of the picture is held. By a
/// temporary file and a rename.
///
/// # Errors
/// [`crate::Error::File`] where the file cannot be written; what was there before stays.
pub fn write_exr(path: &Path, film: &Film, provenance: &Provenance, aovs: Aovs) -> Result<()> {
    let source = FilmChannels::new(film, provenance, &aovs);
    let value = |channel: usize, pixel: usize| source.value(channel, pixel);
    let planes = Planes { window: Window::of(film.settings()), names: source.names(), value: &value };
    write_planes(path, &planes, attributes(film, provenance, &aovs))
}

/// Which pixels of a picture a file has: its data window in its display window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Column of the first pixel, from that of the picture.
    pub x: i64,
    /// Row of it.
    pub y: i64,
    /// Pixels across and down.
    pub size: [usize; 2],
    /// Pixels of the picture across and down.
    pub picture: [usize; 2],
}

impl Window {
    /// All of a picture.
    pub fn whole(width: usize, height: usize) -> Self {
        Window { x: 0, y: 0, size: [width, height], picture: [width, height] }
    }

    /// What is kept of a film.
    pub(super) fn of(film: &FilmSettings) -> Self {
        let Tile { x, y, width, height } = film.pixel_bounds();
        let size = [width as usize, height as usize];
        Window { x: x.into(), y: y.into(), size, picture: [film.width as usize, film.height as usize] }
    }

    /// Whether there is more of the picture than the file has, or less.
    pub fn is_whole(&self) -> bool {
        *self == Window::whole(self.size[0], self.size[1])
    }

    /// What two files both have, if anything.
    pub fn common(&self, other: &Window) -> Option<Window> {
        let axis = |a: i64, size: usize, b: i64, other: usize| {
            let (low, high) = (a.max(b), (a + size as i64).min(b + other as i64));
            (high > low).then_some((low, (high - low) as usize))
        };
        let (x, width) = axis(self.x, self.size[0], other.x, other.size[0])?;
        let (y, height) = axis(self.y, self.size[1], other.y, other.size[1])?;
        Some(Window { x, y, size: [width, height], ..*self })
    }
}

impl std::fmt::Display for Window {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [width, height] = self.size;
        write!(f, "{width}x{height}")?;
        if self.is_whole() {
            return Ok(());
        }
        write!(f, " from {},{} of {}x{}", self.x, self.y, self.picture[0], self.picture[1])
    }
}

/// Channels as they are written.
pub(super) struct Planes<'a> {
    /// Which pixels they have.
    pub window: Window,
    /// Names of the channels, sorted by their bytes.
    pub names: Vec<String>,
    /// Value of a channel at a pixel.
    pub value: &'a (dyn Fn(usize, usize) -> f32 + Sync),
}

/// Writes channels, block by block.
///
/// # Errors
/// As [`write_exr`].
pub(super) fn write_planes(path: &Path, planes: &Planes, attributes: Vec<(&str, AttributeValue)>) -> Result<()> {
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: exr::image::Blocks::ScanLines, line_order: LineOrder::Increasing };
    let other = attributes.into_iter().map(|(name, value)| (text(name), value)).collect();
    let Window { x, y, size, picture } = planes.window;
    let (layer_position, size) = (Vec2(x as i32, y as i32), Vec2(size[0], size[1]));
    let layer = LayerAttributes { software_name: Some(text(SOFTWARE)), layer_position, other, ..LayerAttributes::default() };
    let mut image = Image::from_layer(Layer::new(size, layer, encoding, planes));
    image.attributes.display_window = IntegerBounds::new((0, 0), (picture[0], picture[1]));
    // Without it `R G B` would mean the same (the default is Rec. 709), but not say so.
    image.attributes.chromaticities = Some(chromaticities(Space::Srgb));
    replace_file(path, |file| image.write().to_buffered(file))
}

/// What the header names as the writer.
pub(super) const SOFTWARE: &str = concat!("Abbe ", env!("CARGO_PKG_VERSION"));

/// Name of a bin's channel: `S0.390,000000nm`.
pub fn channel_name(centre_nm: f64) -> String {
    format!("S0.{}nm", format!("{centre_nm:.6}").replace('.', ","))
}

/// Name of the channel with a bin's standard error: `error.390,000000nm`.
pub fn error_channel_name(centre_nm: f64) -> String {
    channel_name(centre_nm).replacen("S0", "error", 1)
}

/// Name of the channel with half the difference of the halves of `channel`: `half.390,000000nm`, `half.depth.Z`.
pub fn half_channel_name(channel: &str) -> String {
    format!("half.{}", channel.strip_prefix("S0.").unwrap_or(channel))
}

pub(super) fn text(s: &str) -> Text {
    // EXR text is bytes of Latin-1; anything else is replaced rather than refused, for a scene may have any name.
    Text::new_or_none(s).unwrap_or_else(|| {
        let ascii: String = s.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
        Text::from(ascii.as_str())
    })
}

/// JSON in ASCII: of other characters EXR text loses some.
fn ascii(json: &Value) -> String {
    let escaped = |c: char| c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")).collect::<String>();
    json.to_string().chars().map(|c| if c.is_ascii() { c.to_string() } else { escaped(c) }).collect()
}

/// What the header says.
pub(super) fn attributes(film: &Film, p: &Provenance, aovs: &Aovs) -> Vec<(&'static str, AttributeValue)> {
    let string = |s: &str| AttributeValue::Text(text(s));
    let count = |n: u64| AttributeValue::Text(text(&n.to_string()));
    let bins = &film.settings().bins;
    let mean_errors: Vec<String> = (0..film.bins()).map(|b| format!("{:e}", film.mean_standard_error(b) as f32)).collect();
    let film_irradiance = |sr: f64| {
        string(&format!(
            "{sr:e} sr times the pixels: irradiance W.m^-2.nm^-1 on the film, behind the lens; 1 is what unit radiance gives on the axis, at the d line, without losses"
        ))
    };
    let mut list = vec![
        ("spectralLayoutVersion", string("1.0")),
        ("emissiveUnits", string("W.m^-2.sr^-1")),
        ("EV", AttributeValue::F32(p.exposure.unwrap_or(0.0) as f32)),
        ("abbe.version", string(env!("CARGO_PKG_VERSION"))),
        ("abbe.scene", string(&p.scene)),
        ("abbe.sceneHash", string(&p.scene_hash)),
        ("abbe.maxDepth", count(p.max_depth.into())),
        ("abbe.techniques", string(&p.techniques)),
        ("abbe.merging", string(if p.merging { "yes" } else { "no" })),
        ("abbe.device", string(&p.device)),
        ("abbe.quantity", string(if p.irradiance { "irradiance W.m^-2.nm^-1" } else { "radiance W.m^-2.sr^-1.nm^-1" })),
        ("abbe.range", string(&format!("{} {} nm", bins.min_nm, bins.max_nm))),
        ("abbe.meanErrors", string(&mean_errors.join(" "))),
        ("abbe.meanGroups", count(film.mean_groups() as u64)),
        // Counts outgrow the 32 bits of an EXR integer.
        ("abbe.seed", count(p.seed)),
        ("abbe.samples", count(film.samples_per_pixel())),
        ("abbe.batches", count(u64::from(film.batches()))),
        ("abbe.seconds", AttributeValue::F64(p.seconds)),
        ("abbe.rays", count(p.stats.rays)),
        ("abbe.droppedNotFinite", count(p.stats.dropped_not_finite)),
        ("abbe.droppedNegative", count(p.stats.dropped_negative)),
        ("abbe.droppedSaturated", count(p.stats.dropped_saturated)),
        ("abbe.droppedCrowded", count(p.stats.dropped_crowded)),
        ("abbe.droppedUnfinished", count(p.stats.unfinished)),
        ("abbe.truncated", count(p.stats.truncated)),
    ];
    list.extend(p.frame.map(|frame| ("abbe.frame", count(frame.into()))));
    if !p.options.is_null() {
        list.push(("abbe.options", string(&ascii(&p.options))));
        list.push(("abbe.interrupted", string(if p.interrupted { "yes" } else { "no" })));
    }
    list.extend(p.film_sr.map(|sr| ("abbe.filmIrradiance", film_irradiance(sr))));
    list.extend(descriptions(aovs));
    list
}

/// What the header says of AOVs.
fn descriptions(aovs: &Aovs) -> Vec<(&'static str, AttributeValue)> {
    let of = |name, aovs: Option<&AovBuffers>, what: &str| {
        Some((name, AttributeValue::Text(text(&format!("{what} ({} samples per pixel)", aovs?.samples())))))
    };
    let all = [
        of(
            "abbe.depth",
            aovs.depth,
            "distance along the ray from the lens or sensor to the first surface, m: mean over the samples that meet one, 0 where none does",
        ),
        of(
            "abbe.normal",
            aovs.normal,
            "shading normal of the first surface in world space (right-handed, Y up), towards the sensor: mean of unit vectors, not made unit \
             again, nothing counting as 0",
        ),
        of(
            "abbe.albedo",
            aovs.albedo,
            "linear sRGB of the first surface's reflectance under D65 (CIE 1931), a perfect reflector being 1 1 1; 1 for glass, at normal incidence \
             for metals: mean, nothing counting as 0",
        ),
        of(
            "abbe.behind",
            aovs.behind,
            "depth, normal and albedo of the first surface that is neither smooth glass nor a mirror, of rays that go through the one and are reflected by \
             the other; depth is the length of their way",
        ),
    ];
    all.into_iter().flatten().collect()
}

/// What a channel of the file shows.
#[derive(Debug)]
enum Source<'a> {
    Mean(usize),
    Error(Errors<'a>),
    Rgb(usize),
    Depth(&'a AovBuffers),
    Normal(&'a AovBuffers, usize),
    Albedo(&'a AovBuffers, usize),
    /// Half the difference of two halves.
    Half(Box<Source<'a>>),
}

/// What is seen, as far as it is wanted.
fn seen<'a>(prefix: &str, [depth, normal, albedo]: [Option<&'a AovBuffers>; 3]) -> Vec<(String, Source<'a>)> {
    let depth = depth.map(|of| (format!("{prefix}depth.Z"), Source::Depth(of)));
    let normal = normal.map(|of| [0, 1, 2].map(|i| (format!("{prefix}normal.{}", ["X", "Y", "Z"][i]), Source::Normal(of, i))));
    let albedo = albedo.map(|of| [0, 1, 2].map(|i| (format!("{prefix}albedo.{}", ["R", "G", "B"][i]), Source::Albedo(of, i))));
    depth.into_iter().chain(normal.into_iter().flatten()).chain(albedo.into_iter().flatten()).collect()
}

fn channels<'a>(film: &'a Film, aovs: &Aovs<'a>) -> Vec<(String, Source<'a>)> {
    let (bins, settings) = (film.bins(), film.settings());
    let mut list = vec![
        ("R".to_string(), Source::Rgb(0)),
        ("G".to_string(), Source::Rgb(1)),
        ("B".to_string(), Source::Rgb(2)),
        ("XYZ.X".to_string(), Source::Mean(bins)),
        ("XYZ.Y".to_string(), Source::Mean(bins + 1)),
        ("XYZ.Z".to_string(), Source::Mean(bins + 2)),
    ];
    let centre = |b: usize| settings.bins.centre_nm(b as u32);
    list.extend((0..bins).map(|b| (channel_name(centre(b)), Source::Mean(b))));
    if aovs.errors {
        list.push(("error.Y".to_string(), Source::Error(film.errors(bins + 1))));
        list.extend((0..bins).map(|b| (error_channel_name(centre(b)), Source::Error(film.errors(b)))));
    }
    let seen = || {
        let first = seen("", [aovs.depth, aovs.normal, aovs.albedo]);
        first.into_iter().chain(seen("behind.", [aovs.behind; 3]))
    };
    list.extend(seen());
    if aovs.halves {
        let of_bins = (0..bins).map(|b| (channel_name(centre(b)), Source::Mean(b)));
        let of_xyz = (0..3).map(|i| (format!("XYZ.{}", ["X", "Y", "Z"][i]), Source::Mean(bins + i)));
        let half = |(name, source): (String, _)| (half_channel_name(&name), Source::Half(Box::new(source)));
        list.extend(of_bins.chain(of_xyz).chain(seen()).map(half));
    }
    // The format wants them sorted by their bytes.
    list.sort_by(|a, b| a.0.cmp(&b.0));
    list
}

/// In single precision, the greatest there is where exposure makes it more.
fn finite(value: f64) -> f32 {
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// A film as the channels of a file.
pub(super) struct FilmChannels<'a> {
    film: &'a Film,
    gain: f64,
    channels: Vec<(String, Source<'a>)>,
}

impl<'a> FilmChannels<'a> {
    pub fn new(film: &'a Film, provenance: &Provenance, aovs: &Aovs<'a>) -> Self {
        FilmChannels { film, gain: preview_gain(provenance.exposure.unwrap_or(0.0)), channels: channels(film, aovs) }
    }

    pub fn names(&self) -> Vec<String> {
        self.channels.iter().map(|(name, _)| name.clone()).collect()
    }

    pub fn value(&self, channel: usize, pixel: usize) -> f32 {
        match &self.channels[channel].1 {
            &Source::Depth(first) => first.depth(pixel),
            &Source::Normal(first, i) => first.normal(pixel)[i],
            &Source::Albedo(first, i) => first.albedo(pixel)[i],
            Source::Half(of) => match **of {
                Source::Mean(channel) => finite(self.film.half_difference(pixel, channel)),
                Source::Depth(first) => first.half_difference(|half| half.depth(pixel)),
                Source::Normal(first, i) => first.half_difference(|half| half.normal(pixel)[i]),
                Source::Albedo(first, i) => first.half_difference(|half| half.albedo(pixel)[i]),
                Source::Error(_) | Source::Rgb(_) | Source::Half(_) => 0.0,
            },
            &Source::Mean(channel) => finite(self.film.pixel(pixel)[channel]),
            Source::Error(errors) => errors.standard_error(pixel) as f32,
            &Source::Rgb(c) => preview(self.film.xyz(pixel), self.gain)[c],
        }
    }
}

/// What [`write_exr`] writes in the channel `name`, pixel by pixel; `None` where the file has none.
pub fn plane_of_film(film: &Film, aovs: &Aovs, name: &str) -> Option<Vec<f32>> {
    let source = FilmChannels::new(film, &Provenance::default(), aovs);
    let channel = source.channels.iter().position(|(n, _)| n == name)?;
    Some((0..film.pixels()).map(|pixel| source.value(channel, pixel)).collect())
}

/// What `R G B` are multiplied by at an exposure in stops.
pub(super) fn preview_gain(exposure: f64) -> f64 {
    exposure.exp2() / xyz_of_unit(Observer::Cie1931)[1]
}

/// `R G B` of a pixel.
pub(super) fn preview(xyz: [f64; 3], gain: f64) -> [f32; 3] {
    linear_srgb_of_xyz(xyz).map(|v| finite(v * gain))
}

impl<'a, 'planes: 'a> WritableChannels<'a> for &'planes Planes<'planes> {
    type Writer = &'planes Planes<'planes>;

    fn infer_channel_list(&self) -> ChannelList {
        let describe = |name: &String| ChannelDescription::new(text(name), SampleType::F32, false);
        ChannelList::new(self.names.iter().map(describe).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, exr::math::RoundingMode) {
        (LevelMode::Singular, exr::math::RoundingMode::Down)
    }

    fn create_writer(&'a self, _: &Header) -> Self::Writer {
        self
    }
}

impl ChannelsWriter for &Planes<'_> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, |line| {
            let at = line.location;
            let first = at.position.y() * self.window.size[0] + at.position.x();
            for (bytes, pixel) in line.value.chunks_exact_mut(4).zip(first..first + at.sample_count) {
                bytes.copy_from_slice(&(self.value)(at.channel, pixel).to_ne_bytes());
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn json_is_the_same_in_ascii() {
        let options = json!({"set": ["name=Gl\u{e4}ser \u{1f52e} \"x\""], "spp": 4});
        let text = ascii(&options);
        assert!(text.is_ascii(), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), options);
    }
}
