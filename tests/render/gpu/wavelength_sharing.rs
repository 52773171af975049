//! Wavelengths that share a way where dispersion parts them (shaders/path/hero.wgsl): less noise, and the same mean, ends of the film's range included.

use super::support::*;
use crate::adapter;
use abbe::color::cie::K_M;
use abbe::film::Film;
use abbe::integrator::{Techniques, mean_squared_radius};
use abbe::render::{Batch, Integrator};
use abbe::scene::{LoadOptions, Scene, load_str};
use abbe::spectrum::library::{Observer, observer};
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

/// Holds the means of these bins to those of wavelengths that share no ways; the difference has to be known to `most_error`.
fn assert_means_are_as_if_alone(scene: &Scene, spp: u32, bins: &[usize], most_error: f64) {
    let [shared, apart] = [Techniques::default(), alone()].map(|techniques| means(scene, techniques, 24, spp));
    for &bin in bins {
        let ((a, of_a), (b, of_b)) = (mean_of(&shared, bin), mean_of(&apart, bin));
        let error = (of_a + of_b).sqrt();
        println!("bin {bin}: {a:.4} shared, {b:.4} alone, {:.2} % +- {:.2} %", 100.0 * (a / b - 1.0), 100.0 * error / b);
        assert!(error < most_error * b, "bin {bin}: too noisy to tell");
        // 1e-3 for four comparisons, of 46 degrees of freedom.
        assert!((a - b).abs() < 3.9 * error, "bin {bin}: {a} shared, {b} alone, error {error}");
    }
}

#[test]
fn the_mean_of_every_wavelength_is_as_if_it_were_alone() {
    // The amount of light must not depend on how far apart ways are: with groups of wavelengths the first bin was 2.8 % too dark here, and the last 1.4 % too bright.
    assert_means_are_as_if_alone(&ball(16, 4, json!({"constant": {"radiance": 1}})), 96, &[0, 1, 2, 3], 0.006);
}

#[test]
fn wavelengths_share_no_ways_with_those_that_the_light_does_not_have() {
    // The light, all of it through the ball, has nothing in bin 3: no path goes by it, so that a share of its ways would be lost. When as many were counted as without the gap,
    // bin 1 was 26 % too dark.
    let light = json!([[380, 1], [529.9, 1], [530, 0], [580, 0], [580.1, 1], [780, 1]]);
    let spot =
        json!({"spot": {"position": [0, 3, 0], "direction": [0, -1, 0], "inner_deg": 6, "outer_deg": 8, "intensity": light}});
    assert_means_are_as_if_alone(&ball(16, 8, spot), 48, &[1, 2, 4, 5], 0.05);
}

/// A caustic on a table, photographed: a spot's light through a ball of strongly dispersive glass.
fn photographed() -> Scene {
    let scene = json!({
        "film": {"width": 18, "height": 12, "bins": 8, "range_nm": [380, 780]},
        "camera": {"lens": {"eye": [0, 0.28, 1.1], "target": [0, 0.07, 0], "prescription": "achromat", "film": [0.036, 0.024]}},
        "materials": {"glass": {"dielectric": {"ior": {"cauchy": [1.6, 0.03]}}}, "table": {"diffuse": {"reflectance": 0.8}}},
        "shapes": [
            {"sphere": {"center": [0, 0.3, 0], "radius": 0.05}, "material": "glass"},
            {"quad": {"corner": [-2, 0, 1], "edge_u": [4, 0, 0], "edge_v": [0, 0, -3]}, "material": "table"},
        ],
        "lights": [{"spot": {"position": [0, 0.6, 0], "direction": [0, -1, 0], "inner_deg": 7, "outer_deg": 9, "intensity": 1}}],
    });
    load_str(&scene.to_string(), Path::new("photographed.json"), project(), &LoadOptions::default()).unwrap()
}

#[test]
fn a_lens_catches_all_that_lands_apart() {
    // When what lands beside the hero went on in the hero's direction, past the lens, a tenth of the light was missing.
    assert_means_are_as_if_alone(&photographed(), 16, &[1, 2, 3, 4, 5, 6], 0.02);
}

#[test]
fn x_y_z_are_of_the_light_in_the_bins_where_it_lands_apart() {
    // Y by the observer's mean over each bin. When X, Y, Z of what ends before the last bin got lost,
    // four fifths of it were missing here.
    let scene = photographed();
    let mut integrator = adapter::with(&scene, 7, Techniques::default()).unwrap();
    let mut film = Film::new(&scene.film);
    integrator.render_batch(Batch::even(0, 128), &mut film).unwrap();
    let seen = |bin: usize| {
        (0..50).map(|i| observer(Observer::Cie1931).eval(380.5 + 50.0 * bin as f64 + f64::from(i))[1]).sum::<f64>() * K_M
    };
    let (mut y, mut of_bins) = (0.0, 0.0);
    for p in 0..film.pixels() {
        y += film.xyz(p)[1];
        of_bins += (0..film.bins()).map(|b| film.pixel(p)[b] * seen(b)).sum::<f64>();
    }
    println!("Y {y:.1}, of the bins {of_bins:.1}");
    assert!((y / of_bins - 1.0).abs() < 0.02, "{y} {of_bins}");
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

/// Where a ray along x, `height` above the axis of a ball of radius 0.5 and of this index around the origin, meets the plane `x`: twice refracted by Snell's law, in the plane of
/// the axis.
fn behind_ball(height: f64, index: f64, x: f64) -> f64 {
    let (outside, inside) = ((height / 0.5).asin(), (height / 0.5 / index).asin());
    // Where it leaves, by its angle from the x axis, and which way.
    let leaves = std::f64::consts::PI - outside - (std::f64::consts::PI - 2.0 * inside);
    let slope = (-2.0 * (outside - inside)).tan();
    0.5 * leaves.sin() + (x - 0.5 * leaves.cos()) * slope
}

#[test]
fn wavelengths_of_a_light_path_land_where_snells_law_sends_them() {
    // A thin beam through a ball onto a wall, where neighbouring bins are a fifth to nine tenths of a pixel apart: they share ways, and must not share places. When all landed where their
    // hero did, the second bin was 0.14 pixels wide, not 0. Behind a pane light paths are merged, and the kernel widens all.
    let (size, height, wall, view) = (24_u32, 0.3, 2.0, 0.6);
    let (rows, pixels) = (size as usize, f64::from(size) / view);
    let index = |nm: f64| 1.6 + 0.03 / (1e-3 * nm).powi(2);
    let middle = behind_ball(height, index(550.0), wall);
    for (is_behind_pane, depth) in [(false, 3), (true, 5)] {
        let mut scene = json!({
            "film": {"width": size, "height": size, "bins": 20, "range_nm": [380, 780]},
            "camera": {"orthographic": {"eye": [1.5, middle, 0], "target": [2, middle, 0], "up": [0, 1, 0], "height": view}},
            "max_depth": depth,
            "materials": {
                "glass": {"dielectric": {"ior": {"cauchy": [1.6, 0.03]}}},
                "pane": {"thin_dielectric": {"ior": 1.5}},
                "wall": {"diffuse": {"reflectance": 0.5}},
            },
            "lights": [{"beam": {"origin": [-2, height, 0], "direction": [1, 0, 0], "radius": 1e-4, "irradiance": 1}}],
            "shapes": [
                {"sphere": {"center": [0, 0, 0], "radius": 0.5}, "material": "glass"},
                {"disc": {"center": [wall, 0, 0], "normal": [-1, 0, 0], "radius": 3}, "material": "wall"},
            ],
        });
        let mut kernel = 0.0;
        if is_behind_pane {
            let pane = json!({"disc": {"center": [1.6, middle, 0], "normal": [-1, 0, 0], "radius": 0.5}, "material": "pane"});
            scene["shapes"].as_array_mut().unwrap().push(pane);
            // A disc of 1.4 pixels at first has a quarter of its squared radius along each axis.
            kernel = 1.4 * 1.4 / 4.0 * mean_squared_radius(16);
        }
        let scene = load_str(&scene.to_string(), Path::new("beam.json"), project(), &LoadOptions::default()).unwrap();
        let mut integrator = adapter::with(&scene, 5, Techniques::default()).unwrap();
        let mut film = Film::new(&scene.film);
        integrator.render_batch(Batch::even(0, 16), &mut film).unwrap();
        for bin in 0..20 {
            // Moments of the bin's picture along the height, in pixels from its middle.
            let (mut light, mut first, mut second) = (0.0, 0.0, 0.0);
            for row in 0..rows {
                let of_row: f64 = (0..rows).map(|column| film.pixel(row * rows + column)[bin]).sum();
                let y = rows as f64 / 2.0 - row as f64 - 0.5;
                light += of_row;
                first += of_row * y;
                second += of_row * y * y;
            }
            assert!(light > 0.0, "bin {bin} is dark");
            let (mean, variance) = (first / light, second / light - (first / light).powi(2));
            let places: Vec<f64> = (0..100)
                .map(|i| {
                    let nm = 380.0 + 20.0 * (bin as f64 + (f64::from(i) + 0.5) / 100.0);
                    let place = (behind_ball(height, index(nm), wall) - middle) * pixels;
                    // The pixel that it falls into; a kernel covers several.
                    if is_behind_pane { place } else { place.floor() + 0.5 }
                })
                .collect();
            let expected = places.iter().sum::<f64>() / 100.0;
            let spread = places.iter().map(|y| (y - expected).powi(2)).sum::<f64>() / 100.0;
            let expected_variance = spread + kernel + if is_behind_pane { 1.0 / 12.0 } else { 0.0 };
            println!(
                "pane {is_behind_pane}, bin {bin}: at {mean:.3}, wide {:.3}; by Snell's law {expected:.3}, {:.3}",
                variance.sqrt(),
                expected_variance.sqrt()
            );
            assert!((mean - expected).abs() < 0.15, "bin {bin}: at {mean}, not {expected}");
            let too_wide = variance.sqrt() - expected_variance.sqrt();
            assert!(too_wide.abs() < 0.12, "bin {bin}: wider by {too_wide}");
        }
    }
}
