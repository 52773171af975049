//! Wavelengths that share a way where dispersion parts them (shaders/path/hero.wgsl): less noise, and the same mean, ends of the film's range included.

use super::support::*;
use crate::adapter;
use abbe::film::Film;
use abbe::integrator::Techniques;
use abbe::render::{Batch, Integrator};
use abbe::scene::{LoadOptions, Scene, load_str};
use serde_json::{Value, json};
use std::path::Path;

fn alone() -> Techniques {
    Techniques { wavelength_sharing: false, ..Techniques::default() }
}

/// A ball of strongly dispersive glass on a floor, in even light or under a lamp.
fn ball(size: u32, bins: u32, light: Value) -> Scene {
    let mut scene = json!({
        "film": {"width": size, "height": size, "bins": bins, "range_nm": [380, 780]},
        "camera": {"perspective": {"eye": [0, 0.65, 4], "target": [0, 0.65, 0], "up": [0, 1, 0], "vfov_deg": 20}},
        "materials": {"glass": {"dielectric": {"ior": {"cauchy": [1.6, 0.03]}}}, "floor": {"diffuse": {"reflectance": 0.5}}},
        "shapes": [
            {"sphere": {"center": [0, 0.65, 0], "radius": 0.55}, "material": "glass"},
            {"disc": {"center": [0, 0, 0], "normal": [0, 1, 0], "radius": 3}, "material": "floor"},
        ],
    });
    match light.get("emission") {
        Some(_) => scene["shapes"].as_array_mut().unwrap().push(light),
        None => scene["lights"] = json!([light]),
    }
    load_str(&scene.to_string(), Path::new("ball.json"), project(), &LoadOptions::default()).unwrap()
}

fn lamp() -> Value {
    json!({"disc": {"center": [0.8, 2.5, 0.5], "normal": [0, -1, 0], "radius": 0.3}, "emission": {"radiance": 5}})
}

/// Means of the bins in every batch.
fn means(scene: &Scene, techniques: Techniques, batches: u32, spp: u32) -> Vec<Vec<f64>> {
    let mut integrator = adapter::with(scene, 7, techniques).unwrap();
    (0..batches)
        .map(|i| {
            let mut film = Film::new(&scene.film);
            integrator.render_batch(Batch::even(i, spp), &mut film).unwrap();
            (0..film.bins()).map(|b| (0..film.pixels()).map(|p| film.pixel(p)[b]).sum::<f64>() / film.pixels() as f64).collect()
        })
        .collect()
}

/// Mean of a bin over batches, and the variance of that.
fn mean_of(batches: &[Vec<f64>], bin: usize) -> (f64, f64) {
    let n = batches.len() as f64;
    let mean = batches.iter().map(|b| b[bin]).sum::<f64>() / n;
    (mean, batches.iter().map(|b| (b[bin] - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
}

#[test]
fn the_mean_of_every_wavelength_is_as_if_it_were_alone() {
    // The amount of light must not depend on how far apart ways are: with groups of wavelengths the first bin was 2.8 % too dark here, and the last 1.4 % too bright.
    let scene = ball(16, 4, json!({"constant": {"radiance": 1}}));
    let [shared, apart] = [Techniques::default(), alone()].map(|techniques| means(&scene, techniques, 24, 96));
    for bin in 0..4 {
        let ((a, of_a), (b, of_b)) = (mean_of(&shared, bin), mean_of(&apart, bin));
        let error = (of_a + of_b).sqrt();
        println!("bin {bin}: {a:.4} shared, {b:.4} alone, {:.2} % +- {:.2} %", 100.0 * (a / b - 1.0), 100.0 * error / b);
        assert!(error < 0.006 * b, "bin {bin}: too noisy to tell");
        // 1e-3 for four comparisons, of 46 degrees of freedom.
        assert!((a - b).abs() < 3.9 * error, "bin {bin}: {a} shared, {b} alone, error {error}");
    }
}

#[test]
fn bins_have_less_noise_where_wavelengths_share_ways() {
    let scene = ball(32, 20, lamp());
    // Sums over pixels of what batches differ by: over all bins, and over the first and the last.
    let noise = |techniques: Techniques| -> [f64; 2] {
        let mut integrator = adapter::with(&scene, 3, techniques).unwrap();
        let mut film = Film::new(&scene.film);
        for i in 0..16 {
            integrator.render_batch(Batch::even(i, 8), &mut film).unwrap();
        }
        let of_bin = |p: usize, b: usize| (film.standard_error(p, b) / (film.pixel(p)[b] + 1e-3)).powi(2).min(1.0);
        let sum = |bins: &[usize]| (0..film.pixels()).map(|p| bins.iter().map(|b| of_bin(p, *b)).sum::<f64>()).sum();
        [sum(&(0..film.bins()).collect::<Vec<_>>()), sum(&[0, film.bins() - 1])]
    };
    let [shared, apart] = [Techniques::default(), alone()].map(noise);
    for (bins, shared, apart) in [("all bins", shared[0], apart[0]), ("first and last", shared[1], apart[1])] {
        println!("{bins}: squared errors {shared:.3e} shared, {apart:.3e} alone: {:.2}", shared / apart);
        assert!(shared < 0.6 * apart, "{bins}: {shared:.3e} against {apart:.3e}");
    }
}
