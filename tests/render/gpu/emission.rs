//! Where light paths begin (shaders/light): a lamp is as good a source of them far away as it is near.

use super::support::*;
use crate::adapter;
use abbe::film::Film;
use abbe::integrator::Techniques;
use abbe::render::{Batch, Integrator};
use abbe::scene::{LoadOptions, load_str};
use serde_json::json;
use std::path::Path;

/// Mean radiance of the film, and its standard error, of a glass ball of 2 cm on a floor. The lamp is a sphere at this distance, m, and of the same size
/// to the ball at any.
fn ball_under_a_lamp(distance: f64) -> (f64, f64) {
    let at = [0.37, 0.92, 0.13].map(|x| x * distance);
    let scene = json!({
        "film": {"width": 16, "height": 16, "bins": 1, "range_nm": [500, 510]},
        "camera": {"perspective": {"eye": [0, 0.05, 0.08], "target": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40}},
        "materials": {"glass": {"dielectric": {"ior": 1.5}}, "floor": {"diffuse": {"reflectance": 0.7}}, "black": {"diffuse": {"reflectance": 0}}},
        "shapes": [
            {"sphere": {"center": [0, 0, 0], "radius": 0.01}, "material": "glass"},
            {"disc": {"center": [0, -0.0125, 0], "normal": [0, 1, 0], "radius": 0.06}, "material": "floor"},
            {"sphere": {"center": at, "radius": 0.01 * distance}, "material": "black", "emission": {"radiance": 1000}},
        ],
    });
    let scene = load_str(&scene.to_string(), Path::new("lamp.json"), project(), &LoadOptions::default()).unwrap();
    // The mirrored lamp is left out.
    let techniques = Techniques { bsdf_sampling: false, ..Techniques::default() };
    let mut integrator = adapter::with(&scene, 5, techniques).unwrap();
    let means: Vec<f64> = (0..16)
        .map(|i| {
            let mut film = Film::new(&scene.film);
            integrator.render_batch(Batch::even(i, 32), &mut film).unwrap();
            (0..film.pixels()).map(|p| film.pixel(p)[0]).sum::<f64>() / film.pixels() as f64
        })
        .collect();
    let mean = means.iter().sum::<f64>() / 16.0;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 15.0;
    (mean, (variance / 16.0).sqrt())
}

#[test]
fn a_lamp_far_away_is_as_good_as_one_that_is_near() {
    let (near, far) = (ball_under_a_lamp(10.0), ball_under_a_lamp(100.0));
    println!("10 m: {near:?}, 100 m: {far:?}");
    // The ball's caustic is 2 % of all light.
    let error = 4.0 * near.1.hypot(far.1) + 0.002 * near.0;
    assert!((far.0 - near.0).abs() < error, "10 m: {near:?}, 100 m: {far:?}");
}
