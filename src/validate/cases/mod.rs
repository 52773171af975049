//! The table of cases, and what their scenes share.

mod camera;
mod caustics;
mod glass;
mod hard;
mod highlights;
mod lenses;
mod light;
mod matched;
mod numerics;
mod refraction;
mod shading;
mod starts;
mod uniform;
mod volumes;

use super::{Case, View};
use crate::film::Film;
use crate::spectrum::{LINE_C_NM, LINE_D_NM, LINE_F_NM};
use serde_json::{Value, json};

/// All cases, in the order in which they are told.
pub fn all() -> Vec<Case> {
    [
        glass::cases(),
        refraction::cases(),
        lenses::cases(),
        camera::cases(),
        caustics::cases(),
        uniform::cases(),
        light::cases(),
        highlights::cases(),
        numerics::cases(),
        hard::cases(),
        matched::cases(),
        volumes::cases(),
        shading::cases(),
        starts::cases(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The lines that indices are given at, with their names.
const LINES: [(&str, f64); 3] = [("F", LINE_F_NM), ("d", LINE_D_NM), ("C", LINE_C_NM)];

/// A film with a bin for each of the lines F, d and C.
fn film_of_lines(width: u32, height: u32) -> Value {
    json!({"width": width, "height": height, "range_nm": [450, 690], "bins": 3})
}

/// A spectrum of lines of 0.02 nm, 1 W nm^-1 high.
fn lines(nm: &[f64]) -> Value {
    let points: Vec<Value> = nm.iter().flat_map(|l| [json!([l - 0.01, 0]), json!([l, 1]), json!([l + 0.01, 0])]).collect();
    points.into()
}

/// A film of `bins` bins from 400 to 700 nm.
fn film(width: u32, height: u32, bins: u32) -> Value {
    json!({"width": width, "height": height, "range_nm": [400, 700], "bins": bins})
}

#[cfg(test)]
/// One pixel in the dark: the smallest scene there can be.
pub(super) fn smallest_scene() -> Value {
    json!({
        "film": film(1, 1, 1),
        "camera": {"orthographic": {"eye": [0, 0, 1], "target": [0, 0, 0], "height": 1}},
        "lights": [{"constant": {"radiance": 0}}],
    })
}

/// Mean of every bin over the film.
fn all_bins(film: &Film) -> Vec<f64> {
    (0..film.bins()).map(|bin| film.mean_of(bin)).collect()
}

/// Mean of all bins over the film.
fn mean(film: &Film) -> f64 {
    let bins = all_bins(film);
    bins.iter().sum::<f64>() / bins.len() as f64
}

/// Means over blocks of `size` x `size` pixels of every bin, `factor` times.
fn blocks(film: &Film, size: u32, factor: f64) -> Vec<f64> {
    let channels = film.channels();
    let bins = |block: &[f64]| block[..channels - 3].iter().map(|v| factor * v).collect::<Vec<_>>();
    film.block_means(size).chunks_exact(channels).flat_map(bins).collect()
}

/// Where the light of a bin lands within columns `from..to`, as a share of the film's width.
fn landing(film: &Film, bin: usize, from: usize, to: usize) -> f64 {
    let (mut sum, mut moment) = (0.0, 0.0);
    for column in from..to {
        let v = film.bin(column, bin);
        sum += v;
        moment += v * (column as f64 + 0.5);
    }
    moment / sum / film.pixels() as f64
}

/// An irradiance sensor of one row across the plane x = `x`, facing -x; its columns run from `y0` to `y1`.
fn screen(x: f64, y0: f64, y1: f64, depth: f64) -> Value {
    json!({"irradiance_plane": {"origin": [x, y0, 0.5 * depth], "edge_u": [0, y1 - y0, 0], "edge_v": [0, 0, -depth]}})
}

/// A view of an irradiance sensor of few pixels, with many light paths for each.
fn measuring(scene: Value, spp: u32, light_paths: f64) -> View {
    View { light_paths: Some(light_paths), ..View::new(scene, spp) }
}
