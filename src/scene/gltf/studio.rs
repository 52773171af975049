//! A soft studio for files that bring no light: brighter above than below, with two softboxes that gloss can show.

use crate::color::cie;
use crate::color::upsample;
use crate::scene::{EnvironmentMap, EnvironmentTexels, Light};
use crate::spectrum::library::Observer;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Texels around and from pole to pole.
const SIZE: [u32; 2] = [256, 128];
/// Where the softboxes hang (the key at the upper left behind the default camera, a rim light at the back), how bright they are beside the gradient, and
/// how sharply they end (the exponent of the cosine).
const SOFTBOXES: [(DVec3, f64, f64); 2] =
    [(DVec3::new(-0.55, 0.65, 0.52), 6.0, 40.0), (DVec3::new(0.75, 0.35, -0.56), 3.0, 60.0)];

/// Radiance from direction `d`, up to a factor.
fn radiance(d: DVec3) -> f64 {
    let rise = (0.5 + 0.5 * d.y).powi(2);
    let softbox = |(at, bright, edge): &(DVec3, f64, f64)| bright * d.dot(at.normalize()).max(0.0).powf(*edge);
    0.3 + 0.9 * rise + SOFTBOXES.iter().map(softbox).sum::<f64>()
}

/// The studio, whose mean radiance is that of daylight: white under it has 1 cd m^-2.
pub(in crate::scene) fn studio() -> Light {
    let [width, height] = SIZE;
    let direction = |column: u32, row: u32| {
        let (phi, theta) =
            (2.0 * PI * (f64::from(column) + 0.5) / f64::from(width), PI * (f64::from(row) + 0.5) / f64::from(height));
        DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let grey = |value: f64| [0.0, 0.0, 0.0, 2.0 * value as f32];
    let texels: Vec<[f32; 4]> =
        (0..height).flat_map(|row| (0..width).map(move |column| grey(radiance(direction(column, row))))).collect();
    let illuminant = upsample::white().scaled(1.0 / cie::xyz_of_unit(Observer::Cie1931)[1]);
    let map = EnvironmentMap { width, height, texels: EnvironmentTexels::Colors(texels), illuminant, to_local: DMat3::IDENTITY };
    let illuminant = map.illuminant.clone().scaled(1.0 / map.mean());
    Light::Image(Arc::new(EnvironmentMap { illuminant, ..map }))
}
