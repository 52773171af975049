//! Reading spectral EXRs of the layout in [`super::exr`]: ours and other programs', with any list of wavelengths, half or float.

use super::exr::error_channel_name;
use crate::error::{Error, Result};
use crate::scene::Bins;
use exr::image::{AnyChannel, FlatSamples};
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{Compression, ReadChannels, ReadLayers, read};
use std::io::Cursor;
use std::path::Path;

/// An emissive spectral image.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Wavelength of every spectral channel, nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    /// Values `[pixel][wavelength]`, rows from the top.
    pub data: Vec<f32>,
    /// The channels that are not spectral (`R`, `XYZ.Y`, `error.Y`, ...), by name, each with its pixels.
    pub others: Vec<(String, Vec<f32>)>,
    /// Attributes of the header that are texts or numbers, by name, as text, sorted.
    pub attributes: Vec<(String, String)>,
}

const REMEDY: &str = "give an emissive spectral EXR with channels such as S0.390,000000nm";

impl SpectralImage {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::File`] where the file cannot be read, is damaged, is no EXR or has no `S0` channels.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|e| Error::file(path, format!("cannot read: {e}"), "check the path"))?;
        Self::from_bytes(&bytes).map_err(|problem| Error::file(path, problem, REMEDY))
    }

    /// Reads a file that is in memory; the error says what is wrong with it.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, String> {
        check_size(bytes)?;
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map_err(|e| format!("not a readable EXR: {e}"))?;

        let spectral = |c: &AnyChannel<FlatSamples>| wavelength_nm(&c.name.to_string()).is_some();
        let layer = image.layer_data.iter().find(|layer| layer.channel_data.list.iter().any(spectral));
        let layer = layer.ok_or("no spectral channels (S0.<wavelength>nm)")?;
        let (width, height) = (layer.size.width(), layer.size.height());
        let pixels = width * height;

        let mut bins: Vec<(f64, Vec<f32>)> = Vec::new();
        let mut others = Vec::new();
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            if values.len() != pixels {
                return Err(format!("channel {name} has {} samples for {pixels} pixels", values.len()));
            }
            match wavelength_nm(&name) {
                Some(nm) => bins.push((nm, values)),
                None => others.push((name, values)),
            }
        }
        bins.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(twice) = bins.windows(2).find(|w| w[0].0 == w[1].0) {
            return Err(format!("two channels at {} nm", twice[0].0));
        }
        let mut data = vec![0.0; pixels * bins.len()];
        for (b, (_, values)) in bins.iter().enumerate() {
            data.iter_mut().skip(b).step_by(bins.len()).zip(values).for_each(|(to, &from)| *to = from);
        }
        let header = image.attributes.other.iter().chain(&layer.attributes.other);
        let mut attributes: Vec<(String, String)> =
            header.filter_map(|(name, value)| Some((name.to_string(), plain(value)?))).collect();
        let software = layer.attributes.software_name.as_ref();
        attributes.extend(software.map(|name: &Text| ("software".to_string(), name.to_string())));
        attributes.sort();
        Ok(SpectralImage { width, height, wavelengths_nm: bins.iter().map(|b| b.0).collect(), data, others, attributes })
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

    /// Where the wavelengths' bins meet, nm: halfway between neighbours; one more than wavelengths. A single one is taken to be 1 nm wide.
    pub fn edges_nm(&self) -> Vec<f64> {
        let nm = &self.wavelengths_nm;
        let inner: Vec<f64> = nm.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        let (first, last) = (nm[0], nm[nm.len() - 1]);
        let ends = (inner.first().map_or(first - 0.5, |e| 2.0 * first - e), inner.last().map_or(last + 0.5, |e| 2.0 * last - e));
        [ends.0].into_iter().chain(inner).chain([ends.1]).collect()
    }

    /// As many equal bins between the outermost edges.
    pub fn equal_bins(&self) -> Bins {
        let edges = self.edges_nm();
        Bins { min_nm: edges[0], max_nm: edges[edges.len() - 1], count: self.bins() as u32 }
    }

    /// An attribute of the header.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

/// Refuses a header that promises more pixels than the file can hold, before anyone allocates for them.
fn check_size(bytes: &[u8]) -> std::result::Result<(), String> {
    let meta =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| format!("not a readable EXR: {e}"))?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width() as u128, header.layer_size.height() as u128);
        let per_pixel: u128 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u128).sum();
        // Deflate packs at most 1032:1; the wavelet and lossy schemes have no such bound, so they get a flat allowance.
        let packing: u128 = if header.compression == Compression::Uncompressed { 1 } else { 1032 };
        let most = packing * bytes.len() as u128 + (64 << 20);
        if width * height * per_pixel > most {
            return Err(format!("the header promises {width}x{height} pixels, more than {} bytes can hold", bytes.len()));
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

/// The wavelength in nm of a channel `S0.<number><prefix><m|Hz>`, the number with a decimal comma (the layout's grammar, section
/// 3 of the paper); `None` for any other channel.
fn wavelength_nm(channel: &str) -> Option<f64> {
    // SI prefixes but "da", which is no use for light.
    const PREFIXES: &str = "YZEPTGMkhdcmunp";
    const EXPONENTS: [i32; 15] = [24, 21, 18, 15, 12, 9, 6, 3, 2, -1, -2, -3, -6, -9, -12];
    let rest = channel.strip_prefix("S0.")?;
    let (rest, is_frequency) = match rest.strip_suffix("Hz") {
        Some(rest) => (rest, true),
        None => (rest.strip_suffix('m')?, false),
    };
    let prefixes = PREFIXES.chars().zip(EXPONENTS);
    let (number, exponent) = prefixes.filter_map(|(p, e)| Some((rest.strip_suffix(p)?, e))).next().unwrap_or((rest, 0));
    if number.is_empty() || !number.chars().all(|c| c.is_ascii_digit() || matches!(c, ',' | 'e' | 'E' | '+' | '-')) {
        return None;
    }
    let value: f64 = number.replace(',', ".").parse().ok()?;
    // A division by the exact power keeps 390,000000nm at 390 exactly.
    let nm = match (is_frequency, exponent) {
        (false, -9) => value,
        (false, e) => value * 10f64.powi(e + 9),
        (true, e) => 299_792_458e9 / (value * 10f64.powi(e)),
    };
    (nm.is_finite() && nm > 0.0).then_some(nm)
}

#[cfg(test)]
mod tests {
    use super::wavelength_nm;

    #[test]
    fn channel_names_of_the_layout_are_understood_and_others_are_not() {
        for (name, nm) in [("S0.390,000000nm", 390.0), ("S0.5,5e2nm", 550.0), ("S0.0,55um", 550.0), ("S0.5,5E-7m", 550.0)] {
            assert!((wavelength_nm(name).expect(name) - nm).abs() < 1e-9, "{name}");
        }
        assert!((wavelength_nm("S0.500THz").expect("THz") - 599.584_916).abs() < 1e-9);
        for name in [
            "S0.390.000000nm",
            "s0.390,000000nm",
            "a.S0.390,000000nm",
            "S1.390,000000nm",
            "S0.nm",
            "S0.-1nm",
            "S0.0nm",
            "S0.infm",
            "Y",
        ] {
            assert_eq!(wavelength_nm(name), None, "{name}");
        }
    }
}
