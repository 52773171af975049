//! A spectral image written as the file that it was read from, with other values.

use super::exr::{Planes, channel_name, text, write_planes};
use super::{Quantity, SpectralImage};
use crate::error::{Error, Result};
use exr::meta::attribute::AttributeValue;
use std::path::Path;

/// Where a channel's values lie.
enum Place {
    Spectral(usize),
    Other(usize),
}

/// Writes an image of light with all its channels and attributes, by a temporary file and a rename.
///
/// # Errors
/// [`Error::Usage`] for a reflectance, [`Error::File`] where the file cannot be written; what was there before stays.
pub fn write_image(path: &Path, image: &SpectralImage) -> Result<()> {
    if image.quantity != Quantity::Emissive {
        return Err(Error::usage("a reflectance is no light", "give a file with S0 channels"));
    }
    let spectral = image.wavelengths_nm.iter().enumerate().map(|(b, nm)| (channel_name(*nm), Place::Spectral(b)));
    let others = image.others.iter().enumerate().map(|(i, (name, _))| (name.clone(), Place::Other(i)));
    let mut channels: Vec<(String, Place)> = spectral.chain(others).collect();
    channels.sort_by(|a, b| a.0.cmp(&b.0));
    let value = |channel: usize, pixel: usize| match channels[channel].1 {
        Place::Spectral(b) => image.pixel(pixel)[b],
        Place::Other(i) => image.others[i].1[pixel],
    };
    let attributes = image.attributes.iter().filter(|(name, _)| name != "software").map(|(name, value)| {
        let number = (name == "EV").then(|| value.parse().ok()).flatten();
        (name.as_str(), number.map_or_else(|| AttributeValue::Text(text(value)), AttributeValue::F32))
    });
    let names = channels.iter().map(|(name, _)| name.clone()).collect();
    let planes = Planes { window: image.window, names, value: &value };
    write_planes(path, &planes, attributes.collect())
}
