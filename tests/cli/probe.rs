//! `abbe probe` on files whose contents are known.

use super::support::{Folder, fails, text, write_film};
use abbe::color::bins::bin_weights;
use abbe::output::SpectralImage;
use abbe::scene::Bins;
use abbe::spectrum::library::Observer;
use serde_json::{Value, json};

/// Four pixels in two rows. Bin b of pixel p is 10 p + b on average; its two batches differ by `p + 1` from that, so that is its own error.
fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    let value = |pixel: usize, channel: usize| (10 * pixel + channel) as f64;
    let low = |p: usize, c: usize| value(p, c) - (p + 1) as f64;
    let high = |p: usize, c: usize| value(p, c) + (p + 1) as f64;
    write_film(&folder.0.join("four.exr"), (2, 2, 4), &[&low, &high]);
    folder
}

fn probe(folder: &Folder, arguments: &[&str]) -> Vec<Value> {
    let output = folder.run(&[&["probe", "four.exr", "--json"], arguments].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_pixel_shows_its_spectrum_errors_and_xyz() {
    let folder = folder("probe-pixel");
    let one = &probe(&folder, &["1,1"])[0];
    assert_eq!(one["nm"], json!([430.0, 530.0, 630.0, 730.0]));
    assert_eq!(one["mean"], json!([30.0, 31.0, 32.0, 33.0]));
    let file = SpectralImage::read(folder.0.join("four.exr")).unwrap();
    let errors = [430, 530, 630, 730].map(|nm| f64::from(file.other(&format!("error.{nm},000000nm")).unwrap()[3]));
    for (shown, error) in one["error"].as_array().unwrap().iter().zip(errors) {
        assert!((shown.as_f64().unwrap() - error).abs() < 1e-12, "{shown} {error}");
    }
    assert!(errors.iter().all(|e| (3.5..4.0).contains(e)), "{errors:?}: the pixel's own is 4, those around are less");
    // Of the file's channels, not of the bins.
    assert_eq!(one["xyz"], json!([34.0, 35.0, 36.0]));
    let xy: Vec<f64> = one["xy"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!((xy[0] - 34.0 / 105.0).abs() < 1e-12 && (xy[1] - 35.0 / 105.0).abs() < 1e-12, "{xy:?}");
}

#[test]
fn a_region_shows_the_mean_and_its_error() {
    let folder = folder("probe-region");
    let both = probe(&folder, &["0,0,2,2", "1,0,1,2"]);
    assert_eq!(both[0]["mean"], json!([15.0, 16.0, 17.0, 18.0]));
    let error = both[0]["error"][2].as_f64().unwrap();
    assert!((error - (1.0f64 + 4.0 + 9.0 + 16.0).sqrt() / 4.0).abs() < 1e-7, "{error}");
    // Columns are x: pixels 1 and 3.
    assert_eq!(both[1]["mean"], json!([20.0, 21.0, 22.0, 23.0]));
    assert_eq!(both[1]["pixels"], 2);
}

#[test]
fn without_xyz_channels_the_bins_give_them() {
    let folder = Folder::new("probe-foreign");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/fichet_emissive_20.exr");
    let output = folder.run(&["probe", file, "0,0", "--json"]);
    let one: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap();
    assert!(one[0]["error"].is_null());
    let weights = bin_weights(&Bins { min_nm: 380.0, max_nm: 780.0, count: 20 }, Observer::Cie1931);
    for i in 0..3 {
        let xyz: f64 = weights.iter().enumerate().map(|(b, w)| w[i] * one[0]["mean"][b].as_f64().unwrap()).sum();
        assert!((one[0]["xyz"][i].as_f64().unwrap() / xyz - 1.0).abs() < 1e-9, "{}", one[0]);
    }
}

#[test]
fn colours_are_described_where_they_have_any() {
    let folder = Folder::new("probe-colours");
    // Pixels: like a blackbody of 2856 K, a green, a purple, equal energy, black.
    let colours = [[1.09845, 1.0, 0.35596], [0.5, 1.0, 1.0 / 6.0], [2.0, 1.0, 2.0], [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]];
    let batch = |p: usize, c: usize| if c < 3 { colours[p][1] } else { colours[p][c - 3] };
    write_film(&folder.0.join("colours.exr"), (5, 1, 3), &[&batch, &batch]);
    let said = |at: &str| text(&folder.run(&["probe", "colours.exr", at]).stdout);
    for (at, has, has_not) in [
        ("0,0", &["colour temperature 2856 K", "dominant wavelength 583"][..], &["purple"][..]),
        ("1,0", &["dominant wavelength 547.9"], &["colour temperature"]),
        ("2,0", &["purple, complementary to 521"], &["colour temperature", "dominant"]),
        ("3,0", &["colour temperature 54"], &["dominant", "purple"]),
        ("4,0", &["XYZ 0.0"], &["colour temperature", "dominant", "purple", "  x "]),
    ] {
        let said = said(at);
        has.iter().for_each(|part| assert!(said.contains(part), "{at}: no '{part}' in {said}"));
        has_not.iter().for_each(|part| assert!(!said.contains(part), "{at}: '{part}' in {said}"));
    }
}

#[test]
fn the_plot_has_a_step_for_every_bin_over_the_visible_colours() {
    let folder = folder("probe-plot");
    probe(&folder, &["0,1", "-o", "one.svg"]);
    let svg = std::fs::read_to_string(folder.0.join("one.svg")).unwrap();
    let line = svg.lines().find(|line| line.starts_with("<polyline")).unwrap();
    assert_eq!(line.matches(',').count(), 8, "{line}");
    assert!(svg.contains("<linearGradient") && svg.contains("four.exr at 0,1"));
    probe(&folder, &["0,1", "1,1", "-o", "two.svg"]);
    let svg = std::fs::read_to_string(folder.0.join("two.svg")).unwrap();
    assert_eq!(svg.matches("<polyline").count(), 2);
    assert!(!svg.contains("<linearGradient"), "which of two curves would the colours belong to?");
}

#[test]
fn regions_outside_and_other_nonsense_are_refused() {
    let folder = folder("probe-wrong");
    fails(&folder, &["probe", "four.exr", "2,0"], &["2,0", "2x2", "1,1"]);
    fails(&folder, &["probe", "four.exr", "1,1,1,2"], &["1,1,1,2"]);
    fails(&folder, &["probe", "four.exr", "0,0", "4294967295,0,4294967295,1"], &["4294967295"]);
    fails(&folder, &["probe", "four.exr", "one"], &["x,y"]);
    fails(&folder, &["probe", "four.exr"], &["REGION"]);
    fails(&folder, &["probe", "ball.json", "0,0"], &["ball.json", "EXR"]);
    fails(&folder, &["probe", "four.exr", "0,0", "-o", "nowhere/p.svg"], &["nowhere"]);
}
