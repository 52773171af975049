//! `abbe compare` on files whose differences are known.

use super::support::{Folder, fails, text, write_film};
use abbe::color::bins::bin_weights;
use abbe::scene::Bins;
use abbe::spectrum::library::Observer;
use serde_json::{Value, json};
use std::f64::consts::PI;

const SIZE: (u32, u32, u32) = (24, 16, 4);

/// The exit code and what `--json` says.
fn compare(folder: &Folder, arguments: &[&str]) -> (i32, Value) {
    let output = folder.run(&[&["compare", "--json"], arguments].concat());
    let code = output.status.code().unwrap();
    assert!(code < 2, "{}", text(&output.stderr));
    (code, serde_json::from_slice(&output.stdout).unwrap())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Standard normal numbers by their place (Box & Muller; SplitMix64).
fn normal(place: u64) -> f64 {
    let uniform = |k: u64| {
        let z = (2 * place + k).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (-2.0 * (1.0 - uniform(0)).ln()).sqrt() * (2.0 * PI * uniform(1)).cos()
}

/// Writes 24 batches of the radiance `mean(pixel)`, with independent noise of each pixel and with noise that all pixels share.
fn write_noisy(folder: &Folder, name: &str, seed: u64, (own, shared): (f64, f64), mean: &dyn Fn(usize) -> f64) {
    let batch = |i: u64| {
        move |p: usize, c: usize| {
            let key = ((seed * 64 + i) * 1024 + p as u64) * 16 + c as u64;
            let all = ((seed * 64 + i) * 1024 + 1023) * 16 + c as u64;
            mean(p) + own * normal(key) + shared * normal(all)
        }
    };
    let batches: Vec<_> = (0..24).map(batch).collect();
    let batches: Vec<&dyn Fn(usize, usize) -> f64> = batches.iter().map(|b| b as &dyn Fn(usize, usize) -> f64).collect();
    write_film(&folder.0.join(name), SIZE, &batches);
}

#[test]
fn a_file_agrees_with_itself_in_everything() {
    let folder = Folder::new("compare-same");
    write_noisy(&folder, "a.exr", 1, (0.1, 0.1), &|p| 1.0 + p as f64 / 100.0);
    let limits = ["--max-rel-mse", "0", "--max-delta-e", "0", "--max-flip", "0", "--z"];
    let (code, said) = compare(&folder, &[&["a.exr", "a.exr"], &limits[..]].concat());
    assert_eq!((code, &said["alike"], &said["failures"]), (0, &json!(true), &json!([])), "{said}");
    assert_eq!((number(&said["luminance"]["rmse"]), number(&said["flip"]["max"])), (0.0, 0.0));
    assert_eq!(said["bins"]["rmse"], json!([0.0, 0.0, 0.0, 0.0]));
    assert_eq!((number(&said["delta_e_2000"]["max"]), number(&said["z"]["worst"])), (0.0, 0.0));
}

/// All bins of a pixel err alike, since paths carry all wavelengths: luminance errs as they do, not less.
#[test]
fn the_references_own_error_of_luminance_is_taken_off_whole() {
    let folder = Folder::new("compare-net");
    let bins = Bins { min_nm: 380.0, max_nm: 780.0, count: SIZE.2 };
    let xyz = bin_weights(&bins, Observer::Cie1931).iter().fold([0.0; 3], |sum, w| [0, 1, 2].map(|i| sum[i] + w[i]));
    let of = |c: usize, radiance: f64| if c < SIZE.2 as usize { radiance } else { radiance * xyz[c - SIZE.2 as usize] };
    let batch = |i: u64| move |p: usize, c: usize| of(c, 1.0 + 0.5 * normal(1024 * i + p as u64));
    let batches: Vec<_> = (0..16).map(batch).collect();
    let batches: Vec<&dyn Fn(usize, usize) -> f64> = batches.iter().map(|b| b as &dyn Fn(usize, usize) -> f64).collect();
    write_film(&folder.0.join("noisy.exr"), SIZE, &batches);
    write_film(&folder.0.join("exact.exr"), SIZE, &[&|_, c| of(c, 1.0), &|_, c| of(c, 1.0)]);
    let net = number(&compare(&folder, &["exact.exr", "noisy.exr"]).1["luminance"]["relative_mse"]);
    let gross = number(&compare(&folder, &["noisy.exr", "exact.exr"]).1["luminance"]["relative_mse"]);
    assert!((gross / (0.25 / 16.0) - 1.0).abs() < 0.3, "{gross}");
    assert!(net.abs() < 0.15 * gross, "{net} of {gross}");
}

#[test]
fn errors_are_what_their_definitions_say() {
    let folder = Folder::new("compare-known");
    // Two values, 2 and 4; A is 10 % brighter, and 50 % in one pixel.
    let b = |p: usize, _: usize| if p.is_multiple_of(2) { 2.0 } else { 4.0 };
    let a = |p: usize, c: usize| if p == 5 { 1.5 * b(p, c) } else { 1.1 * b(p, c) };
    write_film(&folder.0.join("a.exr"), SIZE, &[&a, &a]);
    write_film(&folder.0.join("b.exr"), SIZE, &[&b, &b]);
    // At EV 0, 1 is white, and FLIP sees nothing beyond.
    let (code, said) = compare(&folder, &["a.exr", "b.exr", "--exposure", "-3"]);
    assert_eq!(code, 0, "nothing was asked for");
    let pixels = (SIZE.0 * SIZE.1) as usize;
    let mean = |f: &dyn Fn(f64, f64) -> f64| (0..pixels).map(|p| f(a(p, 0), b(p, 0))).sum::<f64>() / pixels as f64;
    let (rmse, floor) = (mean(&|a, b| (a - b).powi(2)).sqrt(), 0.01 * 9.0);
    let relative_mse = mean(&|a, b| (a - b).powi(2) / (b * b + floor));
    for bin in 0..4 {
        assert!((number(&said["bins"]["rmse"][bin]) - rmse).abs() < 1e-6, "{said}");
        assert!((number(&said["bins"]["relative_mse"][bin]) - relative_mse).abs() < 1e-6, "{said}");
    }
    // Every bin is off alike, so luminance is too.
    assert!((number(&said["luminance"]["relative_mse"]) - relative_mse).abs() < 1e-6, "{said}");
    let delta = &said["delta_e_2000"];
    assert!(number(&delta["max"]) > 3.0 * number(&delta["p95"]) && number(&delta["median"]) > 0.5, "{delta}");
    assert!(number(&said["flip"]["max"]) > number(&said["flip"]["mean"]), "{said}");
}

/// CIEDE2000 of equal energy at Y = 0.2 and Y = 0.1, white x 0.3127, y 0.3290.
const DELTA_E: f64 = 13.28202;

#[test]
fn delta_e_is_the_formulas_at_the_exposure() {
    let folder = Folder::new("compare-delta-e");
    let grey = |_: usize, _: usize| 0.2;
    let darker = |_: usize, _: usize| 0.1;
    write_film(&folder.0.join("a.exr"), SIZE, &[&darker, &darker]);
    write_film(&folder.0.join("b.exr"), SIZE, &[&grey, &grey]);
    // Equal energy of 0.2 and 0.1 at EV 0 is 20 and 10 % of white. Delta E2000 by colour-science 0.4.7 of these XYZ under sRGB's white.
    let (_, said) = compare(&folder, &["a.exr", "b.exr", "--exposure", "0"]);
    for key in ["mean", "median", "p95", "max"] {
        let found = number(&said["delta_e_2000"][key]);
        assert!((found - DELTA_E).abs() < 5e-3, "{key}: {found} is not {DELTA_E}");
    }
}

#[test]
fn limits_decide_the_exit_code() {
    let folder = Folder::new("compare-limits");
    write_noisy(&folder, "a.exr", 1, (0.05, 0.0), &|_| 1.0);
    write_noisy(&folder, "b.exr", 2, (0.05, 0.0), &|_| 1.02);
    for (option, generous, strict) in
        [("--max-rel-mse", "1e-2", "1e-5"), ("--max-delta-e", "10", "0.01"), ("--max-flip", "0.9", "0.001")]
    {
        assert_eq!(compare(&folder, &["a.exr", "b.exr", option, generous]).0, 0, "{option}");
        let (code, said) = compare(&folder, &["a.exr", "b.exr", option, strict]);
        assert_eq!((code, said["failures"].as_array().unwrap().len()), (1, 1), "{option}: {said}");
    }
    let output = folder.run(&["compare", "a.exr", "b.exr", "--max-rel-mse", "1e-5"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("not alike: relMSE of luminance"), "{}", text(&output.stdout));
    assert!(output.stderr.is_empty(), "a difference is a result, not an error");
}

#[test]
fn z_tells_differences_from_noise() {
    let folder = Folder::new("compare-z");
    let bright = |p: usize| if p.is_multiple_of(7) { 5.0 } else { 1.0 };
    write_noisy(&folder, "a.exr", 1, (0.2, 0.0), &bright);
    write_noisy(&folder, "b.exr", 2, (0.2, 0.0), &bright);
    // The error of a mean is 0.2 / sqrt(24 * 384), of a difference 0.003.
    write_noisy(&folder, "c.exr", 3, (0.2, 0.0), &|p| bright(p) + 0.03);
    let (code, said) = compare(&folder, &["a.exr", "b.exr", "--z"]);
    assert_eq!((code, &said["z"]["within"]), (0, &json!(true)), "{said}");
    assert!(number(&said["z"]["limit"]) > 3.6 && number(&said["z"]["limit"]) < 5.0, "{said}");
    let (code, said) = compare(&folder, &["c.exr", "a.exr", "--z"]);
    assert_eq!((code, &said["z"]["within"]), (1, &json!(false)), "{said}");
    assert!((number(&said["z"]["worst"]) - 0.03 / 0.003).abs() < 4.0, "{said}");
}

#[test]
fn noise_that_all_pixels_share_is_no_difference() {
    let folder = Folder::new("compare-shared");
    // Were the pixels' errors independent, that of the mean would be 20 times smaller than it is.
    let same = |_: usize| 1.0;
    write_noisy(&folder, "a.exr", 4, (0.0, 0.1), &same);
    write_noisy(&folder, "b.exr", 5, (0.0, 0.1), &same);
    let (code, said) = compare(&folder, &["a.exr", "b.exr", "--z"]);
    assert_eq!(code, 0, "{said}");
    let off = (number(&said["bins"]["mean_a"][0]) - number(&said["bins"]["mean_b"][0])).abs();
    assert!(off > 1e-3, "the test would not tell: {said}");
}

#[test]
fn z_needs_errors_of_one_file_at_least() {
    let folder = Folder::new("compare-no-errors");
    let render = |spp: &str, seed: &str, name: &str, more: &[&str]| {
        let arguments = ["render", "ball.json", "--device", "reference", "--spp", spp, "--seed", seed, "-o", name, "--quiet"];
        assert!(folder.run(&[&arguments[..], more].concat()).status.success());
    };
    render("16", "1", "plain.exr", &[]);
    render("16", "2", "known.exr", &["--aov", "error"]);
    render("4", "3", "few.exr", &["--aov", "error"]);
    assert_eq!(compare(&folder, &["plain.exr", "known.exr", "--z"]).0, 0);
    fails(&folder, &["compare", "few.exr", "few.exr", "--z"], &["--z", "16 batches"]);
    let fichet = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/fichet_emissive_20.exr");
    fails(&folder, &["compare", fichet, fichet, "--z"], &["--z", "neither"]);
    let (code, said) = compare(&folder, &[fichet, fichet]);
    assert_eq!((code, &said["z"]), (0, &Value::Null));
    assert!(said["z_not_run"].as_str().unwrap().contains("neither"), "{said}");
}

#[test]
fn the_picture_shows_which_is_brighter_where() {
    let folder = Folder::new("compare-picture");
    let b = |_: usize, _: usize| 1.0;
    let a = |p: usize, _: usize| [1.0, 1.5, 0.5, 1.2][p % 4];
    write_film(&folder.0.join("a.exr"), SIZE, &[&a, &a]);
    write_film(&folder.0.join("b.exr"), SIZE, &[&b, &b]);
    let draw = |more: &[&str]| {
        let said = compare(&folder, &[&["a.exr", "b.exr", "-o", "d.png"], more].concat()).1;
        (image::open(folder.0.join("d.png")).unwrap().into_rgb8(), number(&said["picture_scale"]))
    };
    let (luminance, scale) = draw(&[]);
    assert_eq!(luminance.dimensions(), (24, 16));
    let colors: Vec<[u8; 3]> = (0..4).map(|x| luminance.get_pixel(x, 0).0).collect();
    assert_eq!(colors, [[221, 221, 221], [180, 4, 38], [59, 76, 192], [205, 134, 148]], "same, brighter, darker, a bit brighter");
    let (paler, _) = draw(&["--scale", &(2.5 * scale).to_string()]);
    assert_eq!(paler.get_pixel(1, 0).0, colors[3]);
    let (delta_e, _) = draw(&["--picture", "delta-e"]);
    assert!(delta_e.get_pixel(2, 0).0[0] > delta_e.get_pixel(2, 0).0[2], "Delta E has no sign");
    assert_eq!(delta_e.get_pixel(0, 0).0, [221, 221, 221]);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = Folder::new("compare-wrong");
    let one = |_: usize, _: usize| 1.0;
    let broken = |p: usize, _: usize| if p == 3 { f64::NAN } else { 1.0 };
    write_film(&folder.0.join("a.exr"), SIZE, &[&one, &one]);
    write_film(&folder.0.join("wide.exr"), (25, 16, 4), &[&one, &one]);
    write_film(&folder.0.join("fine.exr"), (24, 16, 5), &[&one, &one]);
    write_film(&folder.0.join("broken.exr"), SIZE, &[&broken, &broken]);
    fails(&folder, &["compare", "a.exr", "wide.exr"], &["24x16", "25x16"]);
    fails(&folder, &["compare", "a.exr", "fine.exr"], &["4 wavelengths", "5 wavelengths"]);
    fails(&folder, &["compare", "a.exr", "broken.exr"], &["broken.exr", "not finite"]);
    let data = |name: &str| format!("{}/tests/data/fichet_{name}_20.exr", env!("CARGO_MANIFEST_DIR"));
    fails(&folder, &["compare", &data("emissive"), &data("reflective")], &["emissive", "reflective"]);
    assert_eq!(compare(&folder, &[&data("reflective"), &data("reflective"), "--max-rel-mse", "0"]).0, 0);
    fails(&folder, &["compare", "a.exr", "missing.exr"], &["missing.exr"]);
    fails(&folder, &["compare", "a.exr"], &["B.exr"]);
    fails(&folder, &["compare", "a.exr", "a.exr", "--max-delta-e=-1"], &["--max-delta-e"]);
    fails(&folder, &["compare", "a.exr", "a.exr", "-o", "d.jpg"], &[".png"]);
    fails(&folder, &["compare", "a.exr", "a.exr", "--picture", "delta-e"], &["--output"]);
    fails(&folder, &["compare", "a.exr", "a.exr", "-o", "nowhere/d.png"], &["nowhere"]);
}
