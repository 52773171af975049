//! The spectra library: indices of refraction against the makers' and refractiveindex.info's values, and what happens to bad input.

use abbe::color::lamp;
use abbe::spectrum::library::{self, Observer};
use abbe::spectrum::{Formula, Ior, Spectrum};
use flate2::read::GzDecoder;
use serde_json::Value;
use std::io::Read;

fn reference() -> Value {
    serde_json::from_str(include_str!("../data/glass.json")).expect("glass.json is JSON")
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[test]
fn catalogue_glasses_have_their_published_index_and_abbe_number() {
    // n_F, n_d, n_C and V_d as the makers print them.
    for (name, n, vd) in [
        ("N-BK7", [1.522376, 1.516800, 1.514322], 64.17),
        ("N-SF11", [f64::NAN, 1.784720, f64::NAN], 25.68),
        ("silica", [f64::NAN, 1.458464, f64::NAN], 67.82),
    ] {
        let ior = library::glass(name).expect(name);
        for (nm, n) in [486.1327, 587.5618, 656.2725].into_iter().zip(n) {
            assert!(n.is_nan() || (ior.eval(nm) - n).abs() < 5.5e-7, "{name} at {nm} nm: {} is not {n}", ior.eval(nm));
        }
        assert!((ior.vd() - vd).abs() < 5.5e-3, "{name}: V_d {} is not {vd}", ior.vd());
    }
}

#[test]
fn every_reference_glass_agrees_at_the_fraunhofer_lines() {
    let reference = reference();
    let mut compared = 0;
    for (name, glass) in reference["materials"].as_object().expect("materials") {
        let mut ior = library::glass(name).unwrap_or_else(|| panic!("{name} is not in the library"));
        for (key, extrapolate) in [("n", false), ("n_extrapolated", true)] {
            ior.extrapolate = extrapolate;
            for (line, n) in glass[key].as_object().into_iter().flatten() {
                let nm = reference["_meta"]["lines_nm"][line].as_f64().expect("a line");
                let n = n.as_f64().expect("an index");
                // Air's n - 1 is 3e-4, so it needs more digits than a glass.
                let tolerance = if name.starts_with("air") { 1e-9 } else { 1e-6 };
                assert!((ior.eval(nm) - n).abs() < tolerance, "{name} at {nm} nm: {} is not {n}", ior.eval(nm));
                compared += 1;
            }
        }
        ior.extrapolate = true;
        let vd = glass["Vd"].as_f64().expect("Vd");
        assert!((ior.vd() - vd).abs() < 2e-5 * vd, "{name}: V_d {} is not {vd}", ior.vd());
    }
    assert!(compared >= 160, "only {compared} indices compared");
}

#[test]
fn the_cauchy_fit_and_its_error_are_the_least_squares_ones() {
    let reference = reference();
    for (terms, key) in [(2, "cauchy2"), (3, "cauchy3")] {
        for (name, glass) in reference["materials"].as_object().expect("materials") {
            let fit = &glass[key];
            let range = numbers(&fit["fit_range_um"]);
            let ior = library::glass(name).expect(name);
            let (coefs, error) = ior.cauchy_fit(terms, range[0] * 1e3, range[1] * 1e3);
            for (a, b) in coefs.iter().zip(numbers(&fit["coef_um"])) {
                assert!((a - b).abs() < 1e-4, "{name}: coefficient {a} is not {b}");
            }
            let expected = fit["max_abs_err"].as_f64().expect("an error");
            assert!((error - expected).abs() < 0.05 * expected + 1e-9, "{name}: error {error} is not {expected}");
        }
    }
    let sf10 = library::glass("SF10").expect("SF10");
    assert!((sf10.cauchy_fit(2, 380.0, 780.0).1 - 4e-3).abs() < 5e-4);
    assert!((sf10.cauchy_fit(3, 380.0, 780.0).1 - 6e-4).abs() < 5e-5);
}

#[test]
fn the_abbe_number_formula_follows_bk7_at_f_and_c() {
    let ior = Ior::from_abbe_number(1.5168, 64.17);
    let bk7 = library::glass("N-BK7").expect("N-BK7");
    for nm in [486.1327, 656.2725] {
        let off = (ior.eval(nm) - bk7.eval(nm)).abs();
        assert!(off < 6.5e-5, "off by {off} at {nm} nm");
    }
    assert!((ior.nd() - 1.5168).abs() < 1e-6 && (ior.vd() - 64.17).abs() < 0.05, "{} {}", ior.nd(), ior.vd());
    assert_eq!(Ior::from_abbe_number(1.5, f64::INFINITY), Ior::constant(1.5));
}

#[test]
fn outside_its_range_a_glass_is_refused_by_range_and_remedy_unless_extrapolated() {
    let mut sf11 = library::glass("SF11").expect("SF11");
    let message = sf11.check_range(380.0, 780.0).expect_err("SF11 begins at 390 nm");
    assert!(message.contains("390") && message.contains("\"extrapolate\": true"), "{message}");
    assert_eq!(sf11.eval(380.0), sf11.eval(390.0), "held at the end");
    assert!(sf11.check_range(390.0, 780.0).is_ok());
    sf11.extrapolate = true;
    assert!(sf11.check_range(380.0, 780.0).is_ok());
    assert!(sf11.eval(380.0) > sf11.eval(390.0));
}

#[test]
fn poles_and_impossible_indices_are_refused() {
    // A resonance at 500 nm; one so strong below the range that n^2 < 0; numbers that are none; Cauchy below zero.
    for (ior, word) in [
        (Ior::sellmeier(&[1.0], &[0.25]), "pole at 500.00"),
        (Ior::sellmeier(&[1.0], &[0.65]), "no positive index"),
        (Ior::sellmeier(&[f64::NAN], &[0.01]), "no positive index"),
        (Ior::constant(-1.5), "no positive index"),
        (Ior::cauchy(&[-1.0, 0.01]), "no positive index"),
        (Ior::cauchy(&[]), "no positive index"),
        (Ior::new(Formula::Gas { a0: 0.0, b: vec![0.1], c: vec![4.0] }), "pole at 500.00"),
        (Ior::new(Formula::Polynomial { c0: 2.0, resonances: vec![], terms: vec![[-10.0, 2.0]] }), "no positive index"),
    ] {
        let message = ior.check_range(380.0, 780.0).expect_err("a bad formula");
        assert!(message.contains(word) && message.contains("; "), "{ior:?}: {message}");
    }
    assert!(Ior::sellmeier(&[1.0], &[0.01]).check_range(380.0, 780.0).is_ok());
    for points in [&[][..], &[(400.0, 1.5), (400.0, 1.5)], &[(500.0, 1.5), (400.0, 1.5)], &[(f64::NAN, 1.5)], &[(400.0, 0.0)]] {
        assert!(Ior::table(points).is_err(), "{points:?}");
    }
    assert_eq!(Ior::table(&[(400.0, 1.5), (600.0, 1.4)]).expect("a table").eval(500.0), 1.45);
}

#[test]
fn constancy_is_exact() {
    let constant = |ior: &Ior| ior.is_constant_over(380.0, 780.0);
    assert!(constant(&Ior::constant(1.5)));
    assert!(constant(&Ior::sellmeier(&[1.25, 0.0], &[0.0, 0.01])));
    assert!(constant(&Ior::cauchy(&[1.5, 0.0])));
    assert!(constant(&Ior::new(Formula::Polynomial { c0: 2.0, resonances: vec![], terms: vec![[0.25, 0.0], [0.0, 2.0]] })));
    assert!(!constant(&Ior::cauchy(&[1.5, 1e-300])));
    assert!(!constant(&Ior::sellmeier(&[1.25, 1e-12], &[0.0, 0.01])));
    assert!(!constant(&library::glass("N-BK7").expect("N-BK7")));
    let step = Ior::table(&[(400.0, 1.5), (500.0, 1.5), (600.0, 1.6)]).expect("a table");
    assert!(step.is_constant_over(380.0, 500.0) && !step.is_constant_over(380.0, 501.0) && !step.is_constant_over(380.0, 700.0));
}

#[test]
fn every_glass_of_the_library_is_physical_over_its_range() {
    let names = library::glass_names();
    assert!(names.len() > 3000, "{} names", names.len());
    // Those of the database are held to its package.
    for name in
        names.into_iter().filter(|name| library::glass_head(name).is_some_and(|head| head.iter().any(|(w, _)| w == "title")))
    {
        let ior = library::glass(name).unwrap_or_else(|| panic!("{name} has no index"));
        let (lo, hi) = (ior.range_nm.0.max(380.0), ior.range_nm.1.min(780.0));
        ior.check_range(lo, hi).unwrap_or_else(|problem| panic!("{name}: {problem}"));
        let mut last = f64::INFINITY;
        for nm in (lo.ceil() as u32..=hi as u32).map(f64::from) {
            let n = ior.eval(nm);
            // Normal dispersion; tables are rounded and noisy in the last digit.
            assert!((1.0..4.0).contains(&n) && n < last + 2e-3, "{name} has index {n} at {nm} nm");
            last = n;
        }
        if let Some(absorption) = library::glass_absorption(name) {
            let worst = (400..=700).map(|nm| absorption.eval(f64::from(nm))).fold(0.0, f64::max);
            assert!((0.0..2e4).contains(&worst), "{name} absorbs {worst} per metre");
        }
    }
    for usual in ["N-BK7", "n-bk7", "SF10", "N-SF11", "diamond", "water", "fused silica", "silica", "sapphire", "ice", "CaF2"] {
        let ior = library::glass(usual).unwrap_or_else(|| panic!("{usual} is missing"));
        assert!(ior.check_range(380.0, 780.0).is_ok(), "{usual} does not cover the default film");
    }
    assert_eq!(library::glass("air"), library::glass(" AIR "));
    assert_eq!(library::glass("air").expect("air").eval(500.0), 1.0);
    assert!(library::glass("unobtainium").is_none());
}

#[test]
fn schott_absorption_is_four_pi_k_over_lambda() {
    // k(400 nm) = 1.0227e-8 in the catalogue.
    let sigma = library::glass_absorption("N-BK7").expect("N-BK7 has k").eval(400.0);
    assert!((sigma - 4.0 * std::f64::consts::PI * 1.0227e-8 / 400e-9).abs() < 1e-6 * sigma, "{sigma}");
    assert!(library::glass_absorption("diamond").is_none());
    let water = library::glass_absorption("water").expect("water has k").eval(700.0);
    assert!((0.5..0.8).contains(&water), "water absorbs {water} per metre at 700 nm");
}

#[test]
fn metals_reflect_as_they_look() {
    let reflectance = |name: &str, nm: f64| {
        let (eta, k) = library::metal(name).unwrap_or_else(|| panic!("{name} is missing"));
        let (n, k) = (eta.eval(nm), k.eval(nm));
        ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
    };
    assert!(reflectance("Ag", 550.0) > 0.95 && reflectance("aluminium", 550.0) > 0.9);
    assert!(reflectance("gold", 450.0) < 0.5 && reflectance("gold", 650.0) > 0.9);
    assert!(reflectance("copper", 450.0) < 0.65 && reflectance("copper", 650.0) > 0.9);
    let (eta, k) = library::metal("Al").expect("Al");
    assert_eq!((eta.eval(550.0), k.eval(550.0)), (0.958569, 6.686968));
    for name in library::metal_names() {
        for nm in [380.0, 500.0, 780.0] {
            let r = reflectance(name, nm);
            assert!((0.1..1.0).contains(&r), "{name} reflects {r} at {nm} nm");
        }
    }
}

#[test]
fn every_data_file_says_its_source_licence_units_and_range() {
    fn walk(dir: &std::path::Path, count: &mut usize) {
        for entry in std::fs::read_dir(dir).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(&path, count);
                continue;
            }
            let bytes = std::fs::read(&path).expect("a file");
            let mut text = String::new();
            match path.extension().is_some_and(|e| e == "gz") {
                true => GzDecoder::new(&bytes[..]).read_to_string(&mut text).expect("a text"),
                false => (&bytes[..]).read_to_string(&mut text).expect("a text"),
            };
            for word in ["# source: ", "# licence: ", "# units: ", "range"] {
                assert!(text.contains(word), "{} lacks \"{word}\"", path.display());
            }
            let cie = ["illuminant", "observer"].iter().any(|folder| path.components().any(|c| c.as_os_str() == *folder));
            assert_eq!(cie, text.contains("(c) CIE"), "the notice of {}", path.display());
            *count += 1;
        }
    }
    let mut count = 0;
    walk(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("spectra"), &mut count);
    assert!(count > 250, "{count} files");
}

#[test]
fn illuminants_and_reflectances_are_found_by_name() {
    for name in ["A", "D50", "D55", "D65", "D75", "E", "FL1", "fl12", "LED-B1", "LED-V2", "LED-RGB1", "HP1"] {
        let s = library::illuminant(name).unwrap_or_else(|| panic!("{name} is missing"));
        assert!(s.integral(400.0, 700.0) > 0.0, "{name} is dark");
    }
    assert_eq!(library::illuminant("D65").expect("D65").eval(560.0), 100.0);
    assert_eq!(library::illuminant("D65").expect("D65").eval(900.0), 0.0);
    assert!(library::illuminant("D66").is_none());
    assert_eq!(library::reflectance_names().len(), 24);
    let dark = library::reflectance("colorchecker/dark skin").expect("a patch");
    assert!((0.0..0.1).contains(&dark.eval(450.0)) && dark.eval(700.0) > dark.eval(450.0));
    let cmf = library::observer(Observer::Cie1931);
    assert_eq!((cmf.nm.len(), cmf.eval(555.0)[1], cmf.eval(359.9), cmf.eval(830.1)), (471, 1.0, [0.0; 3], [0.0; 3]));
}

/// Values over that at 560 nm by colour-science 0.4.7 (`CCT_to_xy_CIE_D`, `sd_CIE_illuminant_D_series` without rounded M1 and M2).
#[test]
fn daylight_is_as_the_cie_has_it() {
    for (kelvin, values) in [
        (4000.0, [0.139527, 0.633882, 0.844858, 1.082714, 1.214455, 0.99868]),
        (5000.0, [0.244571, 0.87198, 0.957008, 0.977057, 0.916529, 0.783101]),
        (6504.0, [0.499953, 1.170272, 1.093634, 0.900024, 0.716, 0.633758]),
        (9300.0, [0.924243, 1.555691, 1.267212, 0.842656, 0.588505, 0.532795]),
        (20000.0, [1.660908, 2.143433, 1.529102, 0.795246, 0.519165, 0.466272]),
    ] {
        let spectrum = lamp::daylight(kelvin);
        for (nm, value) in [380.0, 450.0, 500.0, 600.0, 700.0, 780.0].into_iter().zip(values) {
            assert!((spectrum.eval(nm) - value).abs() < 2e-6, "{kelvin} K at {nm} nm: {} is not {value}", spectrum.eval(nm));
        }
    }
}

/// Chromaticity by a sum over the printed observer, every 0.1 nm.
fn xy(spectrum: &Spectrum) -> [f64; 2] {
    let cmf = library::observer(Observer::Cie1931);
    let nm = (0..4700).map(|i| 360.05 + 0.1 * f64::from(i));
    let sum = nm.fold([0.0; 3], |sum, nm| std::array::from_fn(|k| sum[k] + spectrum.eval(nm) * cmf.eval(nm)[k]));
    let all: f64 = sum.iter().sum();
    [sum[0] / all, sum[1] / all]
}

#[test]
fn lamps_by_their_colour_have_it() {
    // Blackbodies by Planck's law with c2 of 0.014388 m K; the first is close to illuminant A.
    for kelvin in [1800.0, 2856.0, 4000.0, 5000.0, 6500.0, 10_000.0] {
        let planck = |nm: f64| (nm / 560.0).powi(-5) / ((0.01438776877e9 / (nm * kelvin)).exp() - 1.0);
        let nm: Vec<f64> = (0..=4700).map(|i| 360.0 + 0.1 * f64::from(i)).collect();
        let black = Spectrum::Table { values: nm.iter().map(|&nm| planck(nm)).collect(), nm, extend: false };
        let ([x, y], [x0, y0]) = (xy(&lamp::white_led(kelvin)), xy(&black));
        assert!((x - x0).hypot(y - y0) < 2e-5, "{kelvin} K: {x}, {y} is not {x0}, {y0}");
    }
    for [x, y] in [[1.0 / 3.0, 1.0 / 3.0], [0.4476, 0.4074], [0.2, 0.25], [0.6, 0.35], [0.3, 0.58], [0.17, 0.06]] {
        let [x1, y1] = xy(&lamp::of_chromaticity([x, y]).unwrap());
        assert!((x - x1).hypot(y - y1) < 1e-3, "{x1}, {y1} is not {x}, {y}");
    }
    // Beyond the spectral colours, next to one, and no chromaticities at all.
    for wrong in [[0.1, 0.9], [0.08, 0.83], [0.7, 0.4], [-0.1, 0.5], [0.5, 0.0], [f64::NAN, 0.3]] {
        assert!(lamp::of_chromaticity(wrong).is_err(), "{wrong:?}");
    }
}
