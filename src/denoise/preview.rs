//! What a film looks like without noise, while it is rendered: X, Y, Z alone, which take a small part of the time that spectra take. No spectrum comes out.

use super::features;
use super::filter::Noisy;
use super::planes::{Size, plane};
use crate::film::aov::AovBuffers;
use crate::film::{Earlier, Film};
use crate::output::exr::{Aovs, half_channel_name, plane_of_film};

/// X, Y, Z of every pixel of `film` without noise, row by row from the upper left, in the film's units. What it was `earlier` is one half of its samples, best half
/// or a third of them; `aovs` are of two halves.
///
/// `None` before the second batch: one does not tell what is noise.
pub fn denoised_xyz(film: &Film, earlier: &Earlier, aovs: &AovBuffers) -> Option<Vec<[f32; 3]>> {
    if film.batches() < 2 {
        return None;
    }
    let bounds = film.settings().pixel_bounds();
    let size = Size { width: bounds.width as usize, height: bounds.height as usize };
    let errors = [0, 1, 2].map(|i| film.errors(film.bins() + i));
    let [x, y, z] = errors.each_ref().map(|errors| plane(size, |p| errors.standard_error(p) as f32));
    let features = features(aovs.behind().is_some());
    let (first, behind) = (Some(aovs), aovs.behind());
    let aovs = Aovs { depth: first, normal: first, albedo: first, behind, halves: true, ..Aovs::default() };
    let channel = |name: &str| plane_of_film(film, &aovs, name);
    let feature = |(name, color): &(String, bool)| Some((channel(name)?, channel(&half_channel_name(name))?, *color));
    let noisy = Noisy {
        size,
        mean: (0..3).map(|i| plane(size, |p| film.xyz(p)[i] as f32)).collect(),
        half: (0..3).map(|i| plane(size, |p| film.half_difference_since(earlier, p)[i] as f32)).collect(),
        error: vec![x, y.clone(), z, y],
        features: features.iter().map(feature).collect::<Option<_>>()?,
    };
    let filtered = noisy.filter().mean;
    Some((0..size.pixels()).map(|p| [0, 1, 2].map(|i| filtered[i][p])).collect())
}
