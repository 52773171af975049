//! Colour: CIE sums, conversions, differences, bin weights and upsampling, against independent values.
//!
//! data/colour.json holds direct sums at 1 nm over 380 to 780 nm inclusive, of tables linearly interpolated: where the tolerance is tight,
//! the same sum is formed here; Abbe's own integral (exact, 360 to 830 nm) is held to the difference between standard methods.

use abbe::color::upsample;
use abbe::color::{bins, cie, convert};
use abbe::compare::lab;
use abbe::scene::Bins;
use abbe::spectrum::Spectrum;
use abbe::spectrum::library::{self, Observer};
use serde_json::Value;

const OBSERVERS: [(Observer, &str); 2] = [(Observer::Cie1931, "2"), (Observer::Cie1964, "10")];

fn reference() -> Value {
    serde_json::from_str(include_str!("../data/colour.json")).expect("colour.json is JSON")
}

fn triple(v: &Value) -> [f64; 3] {
    std::array::from_fn(|i| v[i].as_f64().expect("three numbers"))
}

fn direct_sum(s: impl Fn(f64) -> f64, observer: Observer) -> [f64; 3] {
    let cmf = library::observer(observer);
    let mut xyz = [0.0; 3];
    for nm in (380..=780).map(f64::from) {
        let bar = cmf.eval(nm);
        for i in 0..3 {
            xyz[i] += s(nm) * bar[i];
        }
    }
    xyz
}

fn scaled(xyz: [f64; 3], factor: f64) -> [f64; 3] {
    xyz.map(|v| v * factor)
}

fn assert_near(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{what}: {a:?} is not {b:?} to {tolerance}");
}

#[test]
fn illuminants_have_their_xyz() {
    let reference = reference();
    for (name, entry) in reference["illuminants"].as_object().expect("illuminants") {
        let s = library::illuminant(name).unwrap_or_else(|| panic!("{name} is missing"));
        for (observer, key) in OBSERVERS {
            let xyz = direct_sum(|nm| s.eval(nm), observer);
            let expected = triple(&entry[key]["XYZ"]);
            assert_near(&scaled(xyz, 100.0 / xyz[1]), &expected, 2e-6, &format!("{name}, {key} degrees"));
            // Above 780 nm E goes on and the others' tables end.
            let own = cie::xyz_of(&s, observer);
            let own_xy = cie::xy(own);
            assert_near(&own_xy, &cie::xy(expected), 2e-4, &format!("{name}, {key} degrees, own integral"));
        }
    }
}

#[test]
fn blackbodies_have_their_chromaticity_and_luminance() {
    let reference = reference();
    for (kelvin, entry) in reference["blackbody"].as_object().expect("blackbodies") {
        let s = Spectrum::Blackbody { kelvin: kelvin.parse().expect("a temperature"), scale: 1.0 };
        for (observer, key) in OBSERVERS {
            let xy = cie::xy(cie::xyz_of(&s, observer));
            let expected = [0, 1].map(|i| entry[key]["xy_360_830"][i].as_f64().expect("x and y"));
            assert_near(&xy, &expected, 2e-6, &format!("{kelvin} K, {key} degrees"));
        }
        let luminance = cie::K_M * direct_sum(|nm| s.eval(nm), Observer::Cie1931)[1];
        let expected = entry["2"]["luminance_cd_m2_380_780"].as_f64().expect("a luminance");
        assert!((luminance / expected - 1.0).abs() < 1e-6, "{kelvin} K: {luminance} is not {expected} cd/m^2");
    }
    let xy = |kelvin| cie::xy(cie::xyz_of(&Spectrum::Blackbody { kelvin, scale: 1.0 }, Observer::Cie1931));
    assert_near(&xy(2856.0), &[0.44754, 0.40743], 1e-4, "2856 K");
    assert_near(&xy(6500.0), &[0.31353, 0.32363], 1e-4, "6500 K");
}

#[test]
fn lines_have_the_observers_values_however_narrow() {
    let reference = reference();
    for (nm, entry) in reference["monochromatic"].as_object().expect("lines") {
        let center_nm: f64 = nm.parse().expect("a wavelength");
        for (observer, key) in OBSERVERS {
            assert_near(&library::observer(observer).eval(center_nm), &triple(&entry[key]["cmf"]), 1e-9, nm);
            // 0.1 nm lies across the kink of the table at a whole nm.
            for width_nm in [0.1, 1e-3] {
                let xyz = cie::xyz_of(&Spectrum::Band { center_nm, width_nm, height: 1.0 / width_nm }, observer);
                assert_near(
                    &scaled(xyz, 1.0 / cie::K_M),
                    &triple(&entry[key]["cmf"]),
                    3e-4,
                    &format!("{nm} nm, {width_nm} wide"),
                );
            }
        }
    }
}

#[test]
fn color_checker_patches_have_their_xyz_and_lab() {
    let reference = reference();
    let mut compared = 0;
    for (illuminant, patches) in reference["patches"]["ColorChecker N Ohta"].as_object().expect("illuminants") {
        let light = library::illuminant(illuminant).expect("an illuminant");
        for (name, entry) in patches.as_object().expect("patches") {
            let patch = library::reflectance(&format!("ColorChecker/{name}")).unwrap_or_else(|| panic!("{name} is missing"));
            for (observer, key) in OBSERVERS.into_iter().filter(|(_, key)| entry.get(key).is_some()) {
                let white = direct_sum(|nm| light.eval(nm), observer);
                let k = 100.0 / white[1];
                let xyz = scaled(direct_sum(|nm| light.eval(nm) * patch.eval(nm), observer), k);
                let what = format!("{name} under {illuminant}, {key} degrees");
                assert_near(&xyz, &triple(&entry[key]["XYZ"]), 2e-6, &what);
                let color = lab::lab_of_xyz(xyz, scaled(white, k));
                assert_near(&color, &triple(&entry[key]["Lab"]), 1e-5, &what);

                let lit = Spectrum::Product(Box::new((light.clone(), patch.clone())));
                let own = lab::lab_of_xyz(cie::xyz_of(&lit, observer), cie::xyz_of(&light, observer));
                assert!(lab::delta_e_2000(own, color) < 0.045, "{what}: own integral differs");
                compared += 1;
            }
            if illuminant == "D65" {
                let white = direct_sum(|nm| light.eval(nm), Observer::Cie1931)[1];
                let xyz = scaled(direct_sum(|nm| light.eval(nm) * patch.eval(nm), Observer::Cie1931), 1.0 / white);
                let rgb = convert::linear_srgb_of_xyz(xyz);
                let expected = &entry["2"]["sRGB"]["derived/none"];
                assert_near(&rgb, &triple(&expected["linear"]), 1e-6, name);
                let encoded = rgb.map(|v| convert::srgb_encode(v.clamp(0.0, 1.0)));
                assert_near(&encoded, &triple(&expected["encoded_clipped"]), 2e-6, name);
            }
        }
    }
    assert_eq!(compared, 24 * 7, "five illuminants, two of them for both observers");
}

#[test]
fn srgb_is_its_derived_matrix_and_inverts() {
    let reference = reference();
    for i in 0..3 {
        assert_near(&convert::XYZ_TO_RGB[i], &triple(&reference["_meta"]["M_derived"][i]), 1e-10, "XYZ to RGB");
    }
    let xyz = [0.3, 0.2, 0.7];
    assert_near(&convert::xyz_of_linear_srgb(convert::linear_srgb_of_xyz(xyz)), &xyz, 1e-14, "there and back");
    for v in [-0.5, 0.0, 0.001, 0.0031308, 0.02, 0.18, 1.0, 7.0] {
        let back = convert::srgb_decode(convert::srgb_encode(v));
        assert!((back - v).abs() < 2e-7, "{v} comes back as {back}");
    }
}

#[test]
fn ciede2000_is_that_of_sharma() {
    let data: Value = serde_json::from_str(include_str!("../data/ciede2000.json")).expect("ciede2000.json is JSON");
    let pairs = data["sharma"].as_array().expect("pairs");
    assert_eq!(pairs.len(), 34);
    for pair in pairs {
        let (a, b) = (triple(&pair["Lab1"]), triple(&pair["Lab2"]));
        let published = pair["dE00_published"].as_f64().expect("a difference");
        for d in [lab::delta_e_2000(a, b), lab::delta_e_2000(b, a)] {
            assert!((d - published).abs() <= 5e-5, "{a:?} {b:?}: {d} is not {published}");
        }
    }
}

/// Mean and greatest Delta E2000 over the ColorChecker under `lamp` of weights applied to exact means of bins over 380 to 780 nm.
fn color_checker_error(lamp: &str, bins: &Bins, weights: &[[f64; 3]]) -> (f64, f64) {
    let light = library::illuminant(lamp).expect("a lamp");
    let within = |s: Spectrum| {
        let window = Spectrum::Band { center_nm: 580.0, width_nm: 400.0, height: 1.0 };
        Spectrum::Product(Box::new((window, s)))
    };
    let white = cie::xyz_of(&within(light.clone()), Observer::Cie1931);
    let names = library::reflectance_names();
    let (mut sum, mut worst) = (0.0, 0.0f64);
    for name in &names {
        let lit = Spectrum::Product(Box::new((light.clone(), library::reflectance(name).expect("a patch"))));
        let mut xyz = [0.0; 3];
        for (i, weight) in weights.iter().enumerate() {
            let mean = lit.mean(bins.edge_nm(i as u32), bins.edge_nm(i as u32 + 1));
            for k in 0..3 {
                xyz[k] += weight[k] * mean;
            }
        }
        let exact = lab::lab_of_xyz(cie::xyz_of(&within(lit), Observer::Cie1931), white);
        let error = lab::delta_e_2000(lab::lab_of_xyz(xyz, white), exact);
        sum += error;
        worst = worst.max(error);
    }
    (sum / names.len() as f64, worst)
}

/// What a picture made from bin averages alone would use: the colour-matching functions integrated over each bin.
fn plain_weights(bins: &Bins) -> Vec<[f64; 3]> {
    (0..bins.count)
        .map(|i| {
            let (lo, hi) = (bins.edge_nm(i), bins.edge_nm(i + 1));
            cie::xyz_of(&Spectrum::Band { center_nm: 0.5 * (lo + hi), width_nm: hi - lo, height: 1.0 }, Observer::Cie1931)
        })
        .collect()
}

#[test]
fn more_bins_give_better_colours() {
    let bins = |count| Bins { min_nm: 380.0, max_nm: 780.0, count };
    let error = |lamp, count| color_checker_error(lamp, &bins(count), &bins::bin_weights(&bins(count), Observer::Cie1931));
    let at_20 = error("D65", 20).1;
    assert!(at_20 <= 0.04, "20 bins: {at_20}");
    let plain = color_checker_error("D65", &bins(20), &plain_weights(&bins(20))).1;
    assert!((0.5..0.9).contains(&plain), "plain bin averages: {plain}, so the comparison compares nothing");
    let bounds = [
        (4, 24.0),
        (6, 9.0),
        (8, 1.7),
        (10, 0.65),
        (16, 0.25),
        (20, 0.04),
        (32, 0.038),
        (40, 0.0075),
        (64, 0.0025),
        (80, 0.0025),
    ];
    for (count, bound) in bounds {
        let all = ["D65", "A", "D50", "E", "LED-B3", "FL11"].map(|lamp| error(lamp, count));
        let row: Vec<String> = all.iter().map(|(mean, max)| format!("{mean:.4} / {max:.4}")).collect();
        println!("| {count} | {} |", row.join(" | "));
        assert!(all[0].1 <= bound, "{count} bins: {}", all[0].1);
    }
    // The README's figures for lamps: smooth ones to 0.1 on average and 0.3 at most, one with lines to 2.5 on average.
    for lamp in ["D65", "A", "D50", "E"] {
        let (mean, max) = error(lamp, 20);
        assert!(mean <= 0.1 && max <= 0.3, "{lamp}: {mean} {max}");
    }
    assert!(error("FL11", 20).0 <= 2.5);
}

#[test]
fn bin_weights_keep_the_flat_spectrum_and_reproduce_lines_in_wavelength() {
    for (min_nm, max_nm) in [(380.0, 780.0), (360.0, 830.0), (300.0, 1000.0), (500.0, 600.0), (530.0, 530.5)] {
        for count in [1, 2, 3, 5, 20, 41, 100, 400] {
            let bins = Bins { min_nm, max_nm, count };
            let window = Spectrum::Band { center_nm: 0.5 * (min_nm + max_nm), width_nm: max_nm - min_nm, height: 1.0 };
            let table = |values: [f64; 2]| Spectrum::Table { nm: vec![min_nm, max_nm], values: values.to_vec(), extend: true };
            for (observer, _) in OBSERVERS {
                let weights = bins::bin_weights(&bins, observer);
                assert_eq!(weights.len(), count as usize);
                for (values, tolerance) in [([1.0, 1.0], 1e-8), ([0.0, 2.0], 1e-2)] {
                    if values[0] != values[1] && count < 2 {
                        continue; // one mean has no slope
                    }
                    let s = Spectrum::Product(Box::new((window.clone(), table(values))));
                    let exact = cie::xyz_of(&s, observer);
                    let mut xyz = [0.0; 3];
                    for (i, w) in weights.iter().enumerate() {
                        let mean = table(values).mean(bins.edge_nm(i as u32), bins.edge_nm(i as u32 + 1));
                        for k in 0..3 {
                            xyz[k] += w[k] * mean;
                        }
                    }
                    assert_near(&xyz, &exact, tolerance * exact[1], &format!("{count} bins over {min_nm} to {max_nm}"));
                }
            }
        }
    }
}

#[test]
fn bins_of_different_widths_give_colours_too() {
    let edges = [360.0, 400.0, 425.0, 433.3, 480.0, 481.0, 530.0, 570.0, 600.5, 640.0, 700.0, 830.0];
    let mean = |s: &Spectrum| -> Vec<f64> { edges.windows(2).map(|w| s.mean(w[0], w[1])).collect() };
    let sum = |weights: &[[f64; 3]], means: &[f64]| -> [f64; 3] {
        std::array::from_fn(|i| weights.iter().zip(means).map(|(w, m)| w[i] * m).sum())
    };
    let ramp = Spectrum::Table { nm: vec![360.0, 830.0], values: vec![0.2, 3.0], extend: true };
    let dome = Spectrum::Sigmoid { c: [-8.0, 7.0, -1.0], scale: 1.0 };
    for (observer, _) in OBSERVERS {
        let weights = bins::emission_weights(&edges, observer);
        for (s, tolerance) in [(&ramp, 1e-3), (&dome, 3e-3)] {
            let exact = cie::xyz_of(s, observer);
            assert_near(&sum(&weights, &mean(s)), &exact, tolerance * exact[1], "emission");
        }
        // Equal bins are those of a film.
        let film = Bins { min_nm: 380.0, max_nm: 780.0, count: 20 };
        let edges: Vec<f64> = (0..=20).map(|i| film.edge_nm(i)).collect();
        assert_eq!(bins::bin_weights(&film, observer), bins::emission_weights(&edges, observer));
    }
}

#[test]
fn reflectances_are_lit_by_every_line_of_a_lamp() {
    // Bins of 10 nm from 400 to 700, as spectrophotometers give them, under lamps with lines: the reflectance is smooth, the light need not be.
    let edges: Vec<f64> = (0..=31).map(|i| 395.0 + 10.0 * f64::from(i)).collect();
    for lamp in ["D65", "A", "FL11", "LED-RGB1"] {
        let light = library::illuminant(lamp).expect("a lamp");
        let weights = bins::reflection_weights(&edges, Observer::Cie1931, &light);
        let white = cie::xyz_of(&light, Observer::Cie1931);
        let total: [f64; 3] = std::array::from_fn(|i| weights.iter().map(|w| w[i]).sum());
        assert_near(&total, &white, 1e-6 * white[1], "a perfect reflector");
        for name in library::reflectance_names() {
            let patch = library::reflectance(name).expect("a patch");
            let means: Vec<f64> = edges.windows(2).map(|w| patch.mean(w[0], w[1])).collect();
            let xyz = std::array::from_fn(|i| weights.iter().zip(&means).map(|(w, m)| w[i] * m).sum());
            let exact = cie::xyz_of(&Spectrum::Product(Box::new((light.clone(), patch))), Observer::Cie1931);
            let d = lab::delta_e_2000(lab::lab_of_xyz(xyz, white), lab::lab_of_xyz(exact, white));
            assert!(d < 0.15, "{name} under {lamp}: {d}");
        }
    }
}

fn reflected(s: &Spectrum) -> [f64; 3] {
    let light = library::illuminant("D65").expect("D65");
    let white = cie::xyz_of(&light, Observer::Cie1931);
    let xyz = cie::xyz_of(&Spectrum::Product(Box::new((light, s.clone()))), Observer::Cie1931);
    convert::linear_srgb_of_xyz(scaled(xyz, 1.0 / white[1]))
}

fn lattice(n: u32) -> impl Iterator<Item = [f64; 3]> {
    let at = move |i: u32| f64::from(i) / f64::from(n - 1);
    (0..n * n * n).map(move |i| [at(i / n / n), at(i / n % n), at(i % n)])
}

#[test]
fn every_rgb_reflectance_comes_back_to_1e_3_and_keeps_energy() {
    for rgb in lattice(7).chain([[1.0, 0.0, 1e-4], [0.999, 1.0, 0.998], [1e-5, 0.0, 0.0], [0.5, 0.500001, 0.5]]) {
        let s = upsample::reflectance_from_linear_srgb(rgb).expect("a reflectance");
        assert!((300..=900).all(|nm| (0.0..=1.0).contains(&s.eval(f64::from(nm)))), "{rgb:?} leaves [0, 1]");
        assert_near(&reflected(&s), &rgb, 1e-3, "round trip");
    }
    assert_eq!(upsample::reflectance_from_linear_srgb([0.0; 3]), Ok(Spectrum::Constant(0.0)));
    assert_eq!(upsample::reflectance_from_linear_srgb([0.18; 3]), Ok(Spectrum::Constant(0.18)));
    for bad in [[1.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0]] {
        assert!(upsample::reflectance_from_linear_srgb(bad).is_err(), "{bad:?}");
    }
}

#[test]
fn texels_come_back_to_1e_3_too() {
    for rgb in lattice(12) {
        let s = Spectrum::Sigmoid { c: upsample::texel_coefficients(rgb), scale: 1.0 };
        assert_near(&reflected(&s), &rgb, 1e-3, "round trip");
    }
}

#[test]
fn rgb_light_has_its_colour_and_the_luminance_of_a_constant_radiance() {
    let unit = cie::xyz_of_unit(Observer::Cie1931)[1];
    for rgb in [[1.0, 1.0, 1.0], [2.5, 0.1, 0.0], [0.0, 0.0, 1e-3], [0.2, 70.0, 3.0], [1e6, 5e5, 1e5]] {
        let max = rgb.into_iter().fold(0.0, f64::max);
        let s = upsample::emission_from_linear_srgb(rgb).expect("a light");
        let (c, scale) = upsample::emission_texel(rgb);
        let texel = Spectrum::Product(Box::new((Spectrum::Sigmoid { c, scale }, upsample::white())));
        for s in [s, texel] {
            let back = convert::linear_srgb_of_xyz(scaled(cie::xyz_of(&s, Observer::Cie1931), 1.0 / unit));
            assert_near(&back, &rgb, 1e-3 * max, "round trip");
        }
    }
    assert_eq!(upsample::emission_from_linear_srgb([0.0; 3]), Ok(Spectrum::Constant(0.0)));
    for bad in [[-1.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
        assert!(upsample::emission_from_linear_srgb(bad).is_err(), "{bad:?}");
        let (c, scale) = upsample::emission_texel(bad);
        assert!(scale == 0.0 && c.iter().all(|v| v.is_finite()), "{bad:?}");
    }
}
