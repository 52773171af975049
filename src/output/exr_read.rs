//! Reading spectral EXRs of the layout in [`super::exr`]: ours and other programs', with any list of wavelengths, half or float, and those of
//! which a [`Bands`] table says what the channels are.

use super::bands::{Bands, Selection};
use super::exr::error_channel_name;
use super::exr_pixels::read_pixels;
use super::open_plain;
use crate::error::{Error, Result};
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::Header;
use exr::prelude::Compression;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

/// What the spectral channels of an image are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// `S0`: light, W m^-2 sr^-1 nm^-1.
    Emissive,
    /// `T`: reflectance or transmittance.
    Reflective,
}

/// A spectral image.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
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

/// Why a file is not read, and what to do about it.
struct Refusal {
    problem: String,
    remedy: &'static str,
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
        let (file, length) = open_plain(path).map_err(|e| Error::file(path, format!("cannot read: {e}"), "check the path"))?;
        Self::decode(BufReader::new(file), length, bands).map_err(|refusal| Error::file(path, refusal.problem, refusal.remedy))
    }

    /// Reads a file that is in memory; the error says what is wrong with it.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, String> {
        Self::decode(Cursor::new(bytes), bytes.len() as u64, None).map_err(|refusal| refusal.problem)
    }

    /// Decodes the `length` bytes of `source`.
    fn decode(source: impl Read + Seek + Send, length: u64, bands: Option<&Bands>) -> std::result::Result<Self, Refusal> {
        let reader = exr::block::read(source, false).map_err(unreadable)?;
        check_size(reader.headers(), length).map_err(unreadable)?;

        let spectral = |header: &Header| {
            let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
            bands.and_then(|bands| bands.select(&names)).or_else(|| Selection::of_layout(&names))
        };
        let (layer, selection) = reader
            .headers()
            .iter()
            .enumerate()
            .find_map(|(layer, header)| spectral(header).map(|selection| (layer, selection)))
            .ok_or(if bands.is_some() { "none of the bands" } else { "no spectral channels (S0.<wavelength>nm)" })
            .map_err(not_spectral)?;
        let Selection { quantity, channels: selected, wavelengths_nm, mut edges_nm } = selection.map_err(not_spectral)?;
        let header = reader.headers()[layer].clone();
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let other = |channel: &usize| !selected.iter().any(|(c, _)| c == channel);
        let others: Vec<usize> = (0..header.channels.list.len()).filter(other).collect();
        let pixels = read_pixels(reader, layer, &selected, &others).map_err(unreadable)?;
        let names = others.iter().map(|&channel| header.channels.list[channel].name.to_string());
        let (data, others) = (pixels.interleaved, names.zip(pixels.planes).collect());

        let all = header.shared_attributes.other.iter().chain(&header.own_attributes.other);
        let mut attributes: Vec<(String, String)> =
            all.filter_map(|(name, value)| Some((name.to_string(), plain(value)?))).collect();
        let software = header.own_attributes.software_name.as_ref();
        attributes.extend(software.map(|name: &Text| ("software".to_string(), name.to_string())));
        attributes.sort();
        let range = attributes.iter().find(|(name, _)| name == "abbe.range").and_then(|(_, range)| {
            let mut ends = range.split(' ').map_while(|word| word.parse::<f64>().ok());
            Some([ends.next()?, ends.next()?])
        });
        if let ([_], Some(range)) = (wavelengths_nm.as_slice(), range) {
            edges_nm = range.to_vec();
        }
        Ok(SpectralImage { width, height, quantity, wavelengths_nm, edges_nm, data, others, attributes })
    }

    /// Number of wavelengths.
    pub fn bins(&self) -> usize {
        self.wavelengths_nm.len()
    }

    /// The spectrum of a pixel, rows from the top.
    pub fn pixel(&self, pixel: usize) -> &[f32] {
        &self.data[pixel * self.bins()..(pixel + 1) * self.bins()]
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

/// Refuses a header that promises more pixels than the file can hold, before anyone allocates for them.
fn check_size(headers: &[Header], length: u64) -> std::result::Result<(), String> {
    for header in headers {
        let (width, height) = (header.layer_size.width() as u128, header.layer_size.height() as u128);
        let per_pixel: u128 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u128).sum();
        // Deflate packs at most 1032:1; the wavelet and lossy schemes have no such bound, so they get a flat allowance.
        let packing: u128 = if header.compression == Compression::Uncompressed { 1 } else { 1032 };
        let most = packing * u128::from(length) + (64 << 20);
        if width * height * per_pixel > most {
            return Err(format!("the header promises {width}x{height} pixels, more than {length} bytes can hold"));
        }
        if header.channels.list.iter().any(|c| c.sampling != exr::prelude::Vec2(1, 1)) {
            return Err("subsampled channels are not supported".to_string());
        }
    }
    Ok(())
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
