//! The ColorChecker through the whole chain: a lamp, patches on the GPU, the film, the spectral EXR, and back to colours.

use crate::adapter;
use abbe::compare::lab::{delta_e_2000, lab_of_xyz};
use abbe::film::Film;
use abbe::output::exr::Aovs;
use abbe::output::{Provenance, SpectralImage, write_exr};
use abbe::render::{Integrator, Rendering, Stop};
use abbe::scene::{LoadOptions, Scene, load_str};
use abbe::spectrum::Spectrum;
use abbe::spectrum::library::{self, Observer};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::path::Path;

const COLUMNS: usize = 6;
const ILLUMINANCE_LX: f64 = 1000.0;

fn reference() -> Value {
    serde_json::from_str(include_str!("../data/colour.json")).expect("colour.json is JSON")
}

fn triple(v: &Value) -> [f64; 3] {
    std::array::from_fn(|i| v[i].as_f64().expect("three numbers"))
}

/// All patches side by side under parallel light, one to a pixel: nothing about them is left to chance but wavelengths.
fn chart(lamp: &str, bins: u32) -> Scene {
    let light = json!({"spectrum": {"illuminant": lamp}, "illuminance_lx": ILLUMINANCE_LX});
    chart_under(json!({"sun": {"direction": [0, 0, -1], "angle_deg": 0, "irradiance": light}}), 1, bins)
}

/// Likewise under any light, `size` pixels along each side.
fn chart_under(light: Value, size: usize, bins: u32) -> Scene {
    let names: Vec<&str> = library::reflectance_names().into_iter().filter(|name| name.starts_with("ColorChecker/")).collect();
    assert_eq!(names.len(), 24);
    let material = |name: &&str| (name.to_string(), json!({"diffuse": {"reflectance": {"reflectance": name}}}));
    let materials: serde_json::Map<String, Value> = names.iter().map(material).collect();
    let quad = |(i, name): (usize, &&str)| {
        let corner = [(i % COLUMNS) as f64 - 3.0, 1.0 - (i / COLUMNS) as f64, 0.0];
        json!({"quad": {"corner": corner, "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": name})
    };
    let scene = json!({
        "film": {"width": size * COLUMNS, "height": size * 4, "bins": bins},
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 4}},
        "materials": materials,
        "shapes": names.iter().enumerate().map(quad).collect::<Vec<_>>(),
        "lights": [light],
    });
    load_str(&scene.to_string(), Path::new("chart.json"), Path::new("."), &LoadOptions::default()).expect("a scene")
}

/// XYZ as the tables have them: a perfect reflector has Y = 100.
fn relative(xyz: [f64; 3]) -> [f64; 3] {
    xyz.map(|v| v * 100.0 * PI / ILLUMINANCE_LX)
}

/// Lab of every patch, and the white.
type Expected = Box<dyn Fn(&str) -> ([f64; 3], [f64; 3])>;

/// What the tables of other people say; for lamps that they lack direct sums.
fn expected(lamp: &str) -> Expected {
    let reference = reference();
    let patches = reference["patches"]["ColorChecker N Ohta"][lamp].clone();
    if patches.is_object() {
        let white = triple(&reference["illuminants"][lamp]["2"]["XYZ"]);
        return Box::new(move |name| (triple(&patches[name]["2"]["Lab"]), white));
    }
    by_sums(lamp)
}

/// Direct sums over the film's 380 to 780 nm, in steps of 0.1 nm.
fn by_sums(lamp: &str) -> Expected {
    let light = library::illuminant(lamp).expect("a lamp");
    let sum = |s: &dyn Fn(f64) -> f64| -> [f64; 3] {
        let cmf = library::observer(Observer::Cie1931);
        let steps = (0..4000).map(|i| 380.05 + 0.1 * f64::from(i));
        steps.fold([0.0; 3], |xyz, nm| std::array::from_fn(|i| xyz[i] + s(nm) * cmf.eval(nm)[i]))
    };
    let white = sum(&|nm| light.eval(nm));
    let white_100 = white.map(|v| 100.0 * v / white[1]);
    Box::new(move |name| {
        let patch = library::reflectance(&format!("ColorChecker/{name}")).expect("a patch");
        let xyz = sum(&|nm| light.eval(nm) * patch.eval(nm)).map(|v| 100.0 * v / white[1]);
        (lab_of_xyz(xyz, white_100), white_100)
    })
}

/// Delta E2000 of every patch: from the film's XYZ, and from the file's bins.
fn differences(lamp: &str, bins: u32) -> [Vec<f64>; 2] {
    let (scene, expected) = (chart(lamp, bins), expected(lamp));
    let mut film = Film::new(&scene.film);
    let mut integrator = adapter::integrator(&scene, 1).expect("an adapter");
    integrator.render_batch(abbe::render::Batch::even(0, 4096), &mut film).expect("a batch");

    let path = std::env::temp_dir().join(format!("abbe-patches-{lamp}-{bins}-{}.exr", std::process::id()));
    write_exr(&path, &film, &Provenance::default(), Aovs::default()).expect("a file");
    let mut image = SpectralImage::read(&path).expect("a file");
    std::fs::remove_file(&path).expect("a file");
    let stored = image.xyz(Observer::Cie1931, &Spectrum::Constant(1.0)).expect("colours").xyz;
    image.others.clear();
    let bins = image.xyz(Observer::Cie1931, &Spectrum::Constant(1.0)).expect("colours").xyz;
    [stored, bins].map(|xyz| {
        let names = library::reflectance_names().into_iter().filter_map(|name| name.strip_prefix("ColorChecker/"));
        let difference = |(name, xyz): (&str, &[f32; 3])| {
            let (lab, white) = expected(name);
            delta_e_2000(lab_of_xyz(relative(xyz.map(f64::from)), white), lab)
        };
        names.zip(&xyz).map(difference).collect()
    })
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn every_patch_has_its_colour_under_every_lamp() {
    for lamp in ["D65", "A", "D50", "LED-B3", "E"] {
        let [film, bins] = differences(lamp, 20);
        println!("{}", row(lamp, &film, &bins));
        assert!(greatest(&film) <= 0.05, "{lamp}: {film:?}");
        // The peak of a blue LED is as narrow as a bin.
        let (on_average, at_most) = if lamp == "LED-B3" { (0.2, 0.5) } else { (0.1, 0.3) };
        assert!(mean(&bins) <= on_average && greatest(&bins) <= at_most, "{lamp}: {bins:?}");
    }
}

#[test]
fn a_lamp_with_lines_is_exact_on_the_film_and_fair_from_the_bins() {
    let [film, bins] = differences("FL11", 20);
    println!("{}", row("FL11", &film, &bins));
    assert!(greatest(&film) <= 0.05, "{film:?}");
    assert!(mean(&bins) <= 2.5, "{bins:?}");
    assert!(mean(&bins) > 0.3, "so few bins cannot tell lines apart: the comparison compares nothing");
}

#[test]
fn under_an_even_sky_wavelengths_alone_are_random_and_well_spread() {
    let sky = json!({"spectrum": {"illuminant": "FL11"}, "luminance_cd_m2": ILLUMINANCE_LX / PI});
    let size = 4;
    let scene = chart_under(json!({"constant": {"radiance": sky}}), size, 20);
    let (expected, names) = (by_sums("FL11"), library::reflectance_names());
    let names: Vec<&str> = names.into_iter().filter_map(|name| name.strip_prefix("ColorChecker/")).collect();
    // Errors fall as n^-2 with what is random, also where some blocks have more samples than others.
    for (spp, on_average, at_most) in [(64, 0.015, 0.05), (512, 0.005, 0.02)] {
        let mut rendering = Rendering::new(Film::new(&scene.film));
        let mut integrator = adapter::integrator(&scene, 1).expect("an adapter");
        let stop = Stop { spp: Some(spp), ..Stop::default() };
        rendering.render(&mut integrator, &stop, &mut |_, _| ControlFlow::Continue(())).expect("a picture");
        let of_pixel = |pixel: usize| {
            let (x, y) = (pixel % (size * COLUMNS), pixel / (size * COLUMNS));
            let (lab, white) = expected(names[y / size * COLUMNS + x / size]);
            delta_e_2000(lab_of_xyz(relative(rendering.film.xyz(pixel)), white), lab)
        };
        let differences: Vec<f64> = (0..rendering.film.pixels()).map(of_pixel).collect();
        println!("{spp} samples: {:.4} mean {:.4} max", mean(&differences), greatest(&differences));
        assert!(mean(&differences) < on_average && greatest(&differences) < at_most, "{spp} samples: {differences:?}");
    }
}

fn row(what: &str, film: &[f64], bins: &[f64]) -> String {
    let [film, bins] = [film, bins].map(|v| format!("{:.4} mean {:.4} max", mean(v), greatest(v)));
    format!("{what}: film {film}, bins {bins}")
}

/// Not a test: prints the README's table.
#[test]
#[ignore = "prints the README's table: cargo test --release --test render patches -- --ignored --nocapture"]
fn table_of_bin_counts() {
    const LAMPS: [&str; 6] = ["D65", "A", "D50", "E", "LED-B3", "FL11"];
    println!("| bins | {} |\n|---|{}", LAMPS.join(" | "), "---|".repeat(LAMPS.len()));
    let mut worst_film = 0.0f64;
    for bins in [4, 5, 8, 10, 16, 20, 32, 40, 80] {
        let cells = LAMPS.map(|lamp| {
            let [film, bins] = differences(lamp, bins);
            worst_film = worst_film.max(greatest(&film));
            format!("{} / {}", digits(mean(&bins)), digits(greatest(&bins)))
        });
        println!("| {bins} | {} |", cells.join(" | "));
    }
    println!("from the film's XYZ at most {worst_film:.3}");
}

/// Two significant digits, down to a thousandth.
fn digits(v: f64) -> String {
    let decimals = (1 - v.max(1e-3).log10().floor() as i32).clamp(0, 3);
    format!("{v:.*}", decimals as usize)
}
