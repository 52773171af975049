//! Reading spectral EXRs of the layout in [`super::exr`]: ours and other programs', with any list of wavelengths, half or float, and those of
//! which a [`Bands`] table says what the channels are. A checkpoint is read as the EXR that its render would write.

use super::Checkpoint;
use super::exr::{Aovs, FilmChannels, Provenance, SOFTWARE, Window, attributes, error_channel_name};
use crate::channels::{Bands, Quantity, Selection, check_size, open_plain, read_lines, read_pixels};
use crate::error::{Error, Result};
use crate::film::Film;
use exr::block::reader::Reader;
use exr::meta::attribute::AttributeValue;
use exr::meta::header::Header;
use exr::prelude::Vec2;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

/// A spectral image.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Which pixels of its picture these are.
    pub window: Window,
    /// Light or reflectance.
    pub quantity: Quantity,
    /// Wavelength of every spectral channel, nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    edges_nm: Vec<f64>,
    /// Values `[pixel][wavelength]`, rows from the top.
    pub data: Vec<f32>,
    /// The channels that are not spectral (`R`, `XYZ.Y`, `error.Y`, ...), by name, each with its pixels.
    pub others: Vec<(String, Vec<f32>)>,
    /// Attributes of the header that are texts or numbers, by name, as text, sorted.
    pub attributes: Vec<(String, String)>,
}

/// What a file says of itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct About {
    /// Which pixels of its picture it has.
    pub window: Window,
    /// Names of all channels.
    pub names: Vec<String>,
    pub selection: Selection,
    /// As [`SpectralImage::attributes`].
    pub attributes: Vec<(String, String)>,
}

impl About {
    /// An attribute of the header.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

/// A spectral EXR whose header has been read.
pub(super) struct Opened<R: Read + Seek> {
    reader: Reader<R>,
    layer: usize,
    pub about: About,
}

/// Why a file is not read, and what to do about it.
pub(super) struct Refusal {
    problem: String,
    remedy: &'static str,
}

impl Refusal {
    fn of(self, path: &Path) -> Error {
        Error::file(path, self.problem, self.remedy)
    }
}

/// Opens a file, or says what is wrong with it.
///
/// # Errors
/// [`Error::File`] as of [`SpectralImage::read`].
pub(super) fn open_exr(path: &Path, bands: Option<&Bands>) -> Result<Opened<BufReader<File>>> {
    let (file, length) = open_plain(path).map_err(|e| Error::file(path, format!("cannot read: {e}"), "check the path"))?;
    Opened::new(BufReader::new(file), length, bands).map_err(|refusal| refusal.of(path))
}

/// The attributes of a file's header that are texts or numbers, by name, as text, sorted; pixels are not read.
///
/// # Errors
/// [`Error::File`] as of [`SpectralImage::read`].
pub fn read_attributes(path: &Path) -> Result<Vec<(String, String)>> {
    open_exr(path, None).map(|file| file.about.attributes)
}

fn not_spectral(problem: impl ToString) -> Refusal {
    let remedy = "give a spectral EXR with channels such as S0.390,000000nm, or say with --bands which channels are bands";
    Refusal { problem: problem.to_string(), remedy }
}

fn unreadable(problem: impl std::fmt::Display) -> Refusal {
    Refusal {
        problem: format!("not a readable EXR: {problem}"),
        remedy: "give a whole file, not cut short, compressed as ZIP, RLE, PIZ, PXR24, B44 or DWA, or not at all",
    }
}

impl SpectralImage {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::File`] where the file cannot be read, is damaged, is no EXR or has no `S0` or `T` channels.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::read_with(path.as_ref(), None)
    }

    /// Reads a file whose spectral channels are those of `bands` or, where it has none of them, those that name their wavelengths.
    ///
    /// # Errors
    /// [`Error::File`] as of [`SpectralImage::read`], and where only some of the bands are there.
    pub fn read_with(path: &Path, bands: Option<&Bands>) -> Result<Self> {
        if Checkpoint::is_one(path) {
            let (rendering, provenance, errors) = Checkpoint::open(path)?.rendering()?;
            let aovs = Aovs { errors, halves: rendering.film.keeps_half(), ..Aovs::default() };
            return Self::of_film(&rendering.film, &provenance, aovs).map_err(|problem| not_spectral(problem).of(path));
        }
        open_exr(path, bands)?.read().map_err(|refusal| refusal.of(path))
    }

    /// Reads a file that is in memory; the error says what is wrong with it.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, String> {
        let read = Opened::new(Cursor::new(bytes), bytes.len() as u64, None).and_then(Opened::read);
        read.map_err(|refusal| refusal.problem)
    }

    /// What [`super::write_exr`] would write, read again; the error says what is wrong.
    pub fn of_film(film: &Film, provenance: &Provenance, aovs: Aovs) -> std::result::Result<Self, String> {
        let channels = FilmChannels::new(film, provenance, &aovs);
        let names = channels.names();
        let selection = select(&names, None).ok_or("no bins")??;
        let pixels = 0..film.pixels();
        let spectrum = |pixel: usize| selection.channels.iter().map(move |(c, _)| (*c, pixel));
        let data = pixels.clone().flat_map(spectrum).map(|(c, pixel)| channels.value(c, pixel)).collect();
        let plane = |c: usize| pixels.clone().map(|pixel| channels.value(c, pixel)).collect();
        let others = selection.others(&names).into_iter().map(|c| (names[c].clone(), plane(c))).collect();
        let attributes = attributes(film, provenance, &aovs).into_iter();
        let attributes = plain_attributes(attributes.map(|(name, value)| (name.to_string(), value)), Some(SOFTWARE.to_string()));
        Ok(Self::assembled(Window::of(film.settings()), selection, data, others, attributes))
    }

    fn assembled(
        window: Window,
        selection: Selection,
        data: Vec<f32>,
        others: Vec<(String, Vec<f32>)>,
        attributes: Vec<(String, String)>,
    ) -> Self {
        let Selection { quantity, wavelengths_nm, mut edges_nm, .. } = selection;
        if let ([_], Some((lo, hi))) = (wavelengths_nm.as_slice(), range_nm(&attributes)) {
            edges_nm = vec![lo, hi];
        }
        let [width, height] = window.size;
        SpectralImage { width, height, window, quantity, wavelengths_nm, edges_nm, data, others, attributes }
    }

    /// Number of wavelengths.
    pub fn bins(&self) -> usize {
        self.wavelengths_nm.len()
    }

    /// The spectrum of a pixel, rows from the top.
    pub fn pixel(&self, pixel: usize) -> &[f32] {
        &self.data[pixel * self.bins()..(pixel + 1) * self.bins()]
    }

    /// The pixels that lie in `window`, which is one of the same picture.
    ///
    /// # Panics
    /// If the image has not all of them: the caller's mistake.
    pub fn cut(&self, window: Window) -> SpectralImage {
        assert_eq!(
            self.window.common(&window).map(|common| (common.x, common.y, common.size)),
            Some((window.x, window.y, window.size))
        );
        let (left, top) = ((window.x - self.window.x) as usize, (window.y - self.window.y) as usize);
        let [width, height] = window.size;
        let rows = |values: &[f32], each: usize| -> Vec<f32> {
            let row = |y: usize| &values[(y * self.width + left) * each..(y * self.width + left + width) * each];
            (top..top + height).flat_map(row).copied().collect()
        };
        let others = self.others.iter().map(|(name, values)| (name.clone(), rows(values, 1))).collect();
        SpectralImage { width, height, window, data: rows(&self.data, self.bins()), others, ..self.clone() }
    }

    /// A channel that is not spectral.
    pub fn other(&self, name: &str) -> Option<&[f32]> {
        self.others.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }

    /// Standard errors `[pixel][wavelength]`, where the file has finite ones for all.
    pub fn errors(&self) -> Option<Vec<f32>> {
        let channel = |nm: &f64| self.other(&error_channel_name(*nm));
        let channels: Vec<&[f32]> = self.wavelengths_nm.iter().map(channel).collect::<Option<_>>()?;
        let errors: Vec<f32> = (0..self.width * self.height).flat_map(|p| channels.iter().map(move |c| c[p])).collect();
        errors.iter().all(|e| e.is_finite()).then_some(errors)
    }

    /// Where the channels' bins join, nm, one more than wavelengths: halfway between neighbours, unless a table of bands or Abbe's header says
    /// otherwise. A single channel that says nothing is taken to be 1 nm wide.
    pub fn edges_nm(&self) -> &[f64] {
        &self.edges_nm
    }

    /// An attribute of the header.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

/// First and last wavelength of a film, nm, where the header says so.
pub(super) fn range_nm(attributes: &[(String, String)]) -> Option<(f64, f64)> {
    let (_, range) = attributes.iter().find(|(name, _)| name == "abbe.range")?;
    let mut ends = range.split(' ').map_while(|word| word.parse::<f64>().ok());
    Some((ends.next()?, ends.next()?))
}

/// The channels that are spectral: those of `bands` or, where there are none of them, those that name their wavelengths.
fn select(names: &[String], bands: Option<&Bands>) -> Option<std::result::Result<Selection, String>> {
    bands.and_then(|bands| bands.select(names)).or_else(|| Selection::of_layout(names))
}

impl<R: Read + Seek + Send> Opened<R> {
    /// Reads the header of the `length` bytes of `source`.
    fn new(source: R, length: u64, bands: Option<&Bands>) -> std::result::Result<Self, Refusal> {
        let reader = exr::block::read(source, false).map_err(unreadable)?;
        check_size(reader.headers(), length).map_err(unreadable)?;
        let names = |header: &Header| header.channels.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>();
        let spectral = |header: &Header| {
            let names = names(header);
            select(&names, bands).map(|selection| (names, selection))
        };
        let mut layers = reader.headers().iter().enumerate();
        let (layer, (names, selection)) = layers
            .find_map(|(layer, header)| spectral(header).map(|found| (layer, found)))
            .ok_or(if bands.is_some() { "none of the bands" } else { "no spectral channels (S0.<wavelength>nm)" })
            .map_err(not_spectral)?;
        let selection = selection.map_err(not_spectral)?;
        let header = &reader.headers()[layer];
        let Vec2(width, height) = header.layer_size;
        let (Vec2(x, y), display) = (header.own_attributes.layer_position, header.shared_attributes.display_window);
        let [x, y] = [(x, display.position.x()), (y, display.position.y())].map(|(at, from)| i64::from(at) - i64::from(from));
        let window = Window { x, y, size: [width, height], picture: [display.size.width(), display.size.height()] };
        let all = header.shared_attributes.other.iter().chain(&header.own_attributes.other);
        let all = all.map(|(name, value)| (name.to_string(), value.clone()));
        let attributes = plain_attributes(all, header.own_attributes.software_name.as_ref().map(ToString::to_string));
        let about = About { window, names, selection, attributes };
        Ok(Opened { reader, layer, about })
    }

    fn read(self) -> std::result::Result<SpectralImage, Refusal> {
        let Opened { reader, layer, about: About { window, names, selection, attributes } } = self;
        let others = selection.others(&names);
        let pixels = read_pixels(reader, layer, &selection.channels, &others).map_err(unreadable)?;
        let others = others.into_iter().map(|channel| names[channel].clone()).zip(pixels.planes).collect();
        Ok(SpectralImage::assembled(window, selection, pixels.interleaved, others, attributes))
    }

    /// Hands its pixels over, as [`read_lines`] does; the error says what is wrong with the file.
    pub fn lines(self, visit: impl Fn(usize, usize, usize, &[f32]) + Sync) -> std::result::Result<(), String> {
        read_lines(self.reader, self.layer, visit).map_err(|e| e.to_string())
    }
}

/// Those that are texts or numbers, sorted.
fn plain_attributes(all: impl Iterator<Item = (String, AttributeValue)>, software: Option<String>) -> Vec<(String, String)> {
    let mut attributes: Vec<(String, String)> = all.filter_map(|(name, value)| Some((name, plain(&value)?))).collect();
    attributes.extend(software.map(|name| ("software".to_string(), name)));
    attributes.sort();
    attributes
}

fn plain(value: &AttributeValue) -> Option<String> {
    match value {
        AttributeValue::Text(text) => Some(text.to_string()),
        AttributeValue::F32(v) => Some(v.to_string()),
        AttributeValue::F64(v) => Some(v.to_string()),
        AttributeValue::I32(v) => Some(v.to_string()),
        _ => None,
    }
}
