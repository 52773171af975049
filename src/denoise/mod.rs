//! The denoiser: it keeps spectra.
//!
//! Filters of non-local means and of what is seen ([`kernel`]; Rousselle, Knaus & Zwicker 2012; for features Rousselle, Manzi & Zwicker 2013), by which two
//! halves of the samples filter each other, in two steps ([`filter`]). Several widths are tried, none among them, and the best is taken everywhere, by errors
//! estimated from the halves alone ([`select`]; after Bitterli et al. 2016): caustic edges and glints stay as they came where nothing else is like them. The
//! same estimates, bias included, are the errors that are told of the result.
//!
//! 512 x 512 pixels of 20 bins take 8 s of CPU time, files read and written, shared by all cores; tiles and rows are [`tile`] and [`rows`], and the result does
//! not depend on the number of cores. What it gains is measured in `src/README.md`.
//!
//! The live view shows X, Y, Z alone, filtered over fewer pixels ([`denoised_xyz`]): 640 x 480 pixels take 1.1 s of CPU time.
//!
//! Nothing is assumed of how the noise of bins or pixels hangs together: paths share wavelengths, and points at which light is gathered share photons.

pub mod filter;
pub mod kernel;
pub mod planes;
mod preview;
pub mod rows;
pub mod select;
pub mod tile;

#[cfg(test)]
mod tests;

pub use preview::denoised_xyz;

use crate::color::cie::xyz_of_unit;
use crate::color::convert::linear_srgb_of_xyz;
use crate::output::exr::{channel_name, error_channel_name, half_channel_name};
use crate::output::{Quantity, SpectralImage};
use crate::spectrum::library::Observer;
use filter::Noisy;
use planes::Size;

/// Attribute of what is denoised.
const DENOISED: &str = "abbe.denoised";
const XYZ: [&str; 3] = ["XYZ.X", "XYZ.Y", "XYZ.Z"];
const DEPTH: &str = "depth.Z";
/// What is seen, and whether it is a colour.
const FEATURES: [(&str, bool); 7] = [
    (DEPTH, false),
    ("normal.X", false),
    ("normal.Y", false),
    ("normal.Z", false),
    ("albedo.R", true),
    ("albedo.G", true),
    ("albedo.B", true),
];
/// Before the names of those behind smooth glass and in mirrors.
const BEHIND: &str = "behind.";

/// What `image`, rendered with `--aov denoise`, is without noise: spectra, X Y Z and the preview at `exposure` stops are filtered, errors are root mean square
/// errors with their bias, other channels stay, and what only the denoiser needs is left out.
///
/// # Errors
/// Says what is wrong: a channel that is missing, by its name, a value that is not finite, or that it is denoised already.
pub fn denoise(image: &SpectralImage, exposure: f64) -> Result<SpectralImage, String> {
    if image.attribute(DENOISED).is_some() {
        return Err("it is denoised already".to_string());
    }
    let filtered = noisy(image)?.filter();
    let bins = image.bins();
    let gain = exposure.exp2() / xyz_of_unit(Observer::Cie1931)[1];
    let preview = |c: usize| {
        let rgb = |p: usize| linear_srgb_of_xyz([0, 1, 2].map(|i| f64::from(filtered.mean[bins + i][p]) * gain))[c];
        (0..image.width * image.height).map(|p| rgb(p).clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32).collect()
    };
    let error_names: Vec<String> = image.wavelengths_nm.iter().map(|nm| error_channel_name(*nm)).collect();
    let other = |(name, values): &(String, Vec<f32>)| {
        let values = match (XYZ.iter().position(|n| n == name), ["R", "G", "B"].iter().position(|n| n == name)) {
            (Some(i), _) => filtered.mean[bins + i].clone(),
            (_, Some(c)) => preview(c),
            _ if name == "error.Y" => filtered.error[bins + 1].clone(),
            _ => error_names.iter().position(|n| n == name).map_or(values, |b| &filtered.error[b]).clone(),
        };
        (!name.starts_with("half.") && !name.starts_with(BEHIND)).then(|| (name.clone(), values))
    };
    let mut attributes = image.attributes.clone();
    attributes.retain(|(name, _)| name != "EV");
    attributes.push(("EV".to_string(), (exposure as f32).to_string()));
    attributes.push((
        DENOISED.to_string(),
        "S0, XYZ and RGB are filtered; errors are root mean square errors, bias included".to_string(),
    ));
    attributes.sort();
    let data = (0..image.width * image.height).flat_map(|p| filtered.mean[..bins].iter().map(move |plane| plane[p])).collect();
    let mut denoised = image.clone();
    denoised.others = image.others.iter().filter_map(other).collect();
    (denoised.data, denoised.attributes) = (data, attributes);
    Ok(denoised)
}

/// What tells where light is alike, and whether it is a colour: of the first surfaces, or where they are known of those behind smooth glass and in mirrors,
/// with the depth of the first ones, which has the outlines of the glass. (What a glass ball shows does not follow its normals, nor is it white.)
fn features(behind: bool) -> Vec<(String, bool)> {
    let seen = |prefix: &str| FEATURES.map(|(name, color)| (format!("{prefix}{name}"), color)).to_vec();
    if behind { [vec![(DEPTH.to_string(), false)], seen(BEHIND)].concat() } else { seen("") }
}

/// What the filter takes.
fn noisy(image: &SpectralImage) -> Result<Noisy, String> {
    if image.quantity != Quantity::Emissive {
        return Err("it is a reflectance, which has no noise of rendering".to_string());
    }
    let other = |name: &str| image.other(name).ok_or_else(|| format!("it has no {name}, which the denoiser needs"));
    let half = |name: &str| other(&half_channel_name(name));
    let planes = |names: &mut dyn Iterator<Item = String>| {
        names.map(|name| other(&name).map(<[f32]>::to_vec)).collect::<Result<Vec<_>, String>>()
    };
    let xyz = || XYZ.iter().map(|name| (*name).to_string());
    let colors = image.wavelengths_nm.iter().map(|nm| channel_name(*nm)).chain(xyz());
    let feature = |(name, color): &(String, bool)| Ok((other(name)?.to_vec(), half(name)?.to_vec(), *color));
    let bin = |bin: usize| image.data.iter().skip(bin).step_by(image.bins()).copied().collect::<Vec<f32>>();
    let noisy = Noisy {
        size: Size { width: image.width, height: image.height },
        mean: (0..image.bins()).map(bin).chain(planes(&mut xyz())?).collect(),
        half: planes(&mut colors.map(|name| half_channel_name(&name)))?,
        error: planes(&mut image.wavelengths_nm.iter().map(|nm| error_channel_name(*nm)).chain(["error.Y".to_string()]))?,
        features: features(image.other(&format!("{BEHIND}{DEPTH}")).is_some())
            .iter()
            .map(feature)
            .collect::<Result<_, String>>()?,
    };
    let mut values = noisy.mean.iter().chain(&noisy.half).chain(&noisy.error).flatten();
    match values.all(|v| v.is_finite()) {
        true => Ok(noisy),
        // So are the errors of a single batch.
        false => Err("some of its values or errors are not finite; of two batches and more they are".to_string()),
    }
}
