//! Metal with a grain: what Mitsuba says of it, sampling against densities, reciprocity, and energy in every direction.

use super::{Random, chi_square, tilted};
use abbe::bsdf::conductor::{Lobe, RoughConductor};
use abbe::bsdf::energy::EnergyTable;
use abbe::bsdf::ggx::{self, Width};
use abbe::bsdf::sample_cosine;
use glam::{DVec3, dvec3};
use serde_json::Value;
use std::f64::consts::PI;

const WIDTHS: [Width; 4] =
    [Width { x: 0.4, y: 0.1 }, Width { x: 1.0, y: 0.3 }, Width { x: 0.7, y: 0.05 }, Width { x: 0.5, y: 0.01 }];

#[test]
fn facets_are_spread_and_seen_as_mitsuba_has_it() {
    let data: Value = serde_json::from_str(include_str!("../../data/mitsuba_brushed.json")).unwrap();
    let rows = data["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 18);
    for row in rows {
        let list = |key: &str| row[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
        let direction = |key| DVec3::from_slice(&list(key)).normalize();
        let (wo, wi, width) = (direction("wi"), direction("wo"), Width { x: list("width")[0], y: list("width")[1] });
        let m = (wo + wi).normalize();
        // Its shadowing is a product of both sides', ours takes them together.
        let value = ggx::d(width, m) * ggx::g1(width, wo) * ggx::g1(width, wi) / (4.0 * wo.z);
        let pdf = ggx::pdf_vndf(width, wo, m) / (4.0 * wo.dot(m));
        for (ours, theirs) in [(value, &row["value"]), (pdf, &row["pdf"])] {
            let theirs = theirs.as_f64().unwrap();
            // Theirs is in single precision.
            assert!((ours - theirs).abs() < 2e-4 * theirs, "{row}: {ours}");
        }
    }
}

#[test]
fn directions_are_sampled_with_the_density_that_is_claimed() {
    // No narrower than the grid of the test's quadrature can tell.
    for width in [Width { x: 0.8, y: 0.25 }, Width { x: 0.3, y: 0.9 }] {
        let table = EnergyTable::brushed(width);
        for mu in [0.15, 0.7] {
            let (wo, b) = (tilted(mu), RoughConductor { alpha: width, energy: &table });
            chi_square(
                &format!("vndf {width:?}"),
                |m| ggx::pdf_vndf(width, wo, m),
                |r| Some(ggx::sample_vndf(width, wo, r.array())),
            );
            chi_square(&format!("brushed {width:?} {mu}"), |w| b.pdf(wo, w), |r| b.sample(wo, r.array()).map(|s| s.wi));
        }
    }
}

#[test]
fn brushed_metal_is_reciprocal() {
    let mut random = Random(17);
    for width in WIDTHS {
        let table = EnergyTable::brushed(width);
        let metal = RoughConductor { alpha: width, energy: &table };
        let reflectance = |lobe| match lobe {
            Lobe::Single(cos) => 0.3 + 0.5 * cos,
            Lobe::Multiple => 0.7,
        };
        for _ in 0..200 {
            let (a, b) = (sample_cosine(random.array()), sample_cosine(random.array()));
            let (x, y) = (metal.eval(a, b, reflectance) / b.z, metal.eval(b, a, reflectance) / a.z);
            assert!((x - y).abs() <= 1e-9 * (x + y), "{width:?}: {x} against {y}");
        }
    }
}

/// A perfect mirror with a grain reflects all light, whatever direction it comes from.
#[test]
fn energy_lost_to_single_scattering_is_given_back_in_every_direction() {
    for width in WIDTHS {
        let table = EnergyTable::brushed(width);
        let metal = RoughConductor { alpha: width, energy: &table };
        for mu in [0.1f64, 0.3, 0.7, 0.95] {
            for azimuth in [0.0f64, 0.4, 0.8, 1.1, 1.3, 1.5, 0.5 * PI, 2.5, 4.0] {
                let wo = dvec3(azimuth.cos() * (1.0 - mu * mu).sqrt(), azimuth.sin() * (1.0 - mu * mu).sqrt(), mu);
                let mut random = Random(9);
                const N: usize = 100_000;
                let (mut sum, mut squares) = (0.0, 0.0);
                for _ in 0..N {
                    let w = metal.sample(wo, random.array()).map_or(0.0, |s| s.weight);
                    sum += w;
                    squares += w * w;
                }
                let mean = sum / N as f64;
                let error = ((squares / N as f64 - mean * mean) / N as f64).sqrt();
                println!("{width:?} mu {mu} azimuth {azimuth:.2}: {:.5} +- {error:.5}", mean - 1.0);
                assert!((mean - 1.0).abs() < 4e-3 + 4.0 * error, "{width:?} mu {mu} azimuth {azimuth}: {mean} +- {error}");
            }
        }
    }
}

/// A grain of the same width in all directions is none.
#[test]
fn a_grain_of_one_width_is_none() {
    let (mut random, alpha) = (Random(4), 0.3);
    let (even, plain) = (EnergyTable::brushed(alpha.into()), EnergyTable::conductor(alpha));
    assert!((even.mean[0] - plain.mean[0]).abs() < 2e-4, "{} {}", even.mean[0], plain.mean[0]);
    for _ in 0..200 {
        let w: DVec3 = sample_cosine(random.array());
        let (a, b) = (even.missing_towards(w), plain.missing_towards(w));
        assert!((a - b).abs() < 1e-3, "{w}: {a} {b}");
    }
}
