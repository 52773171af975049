//! Sheen: the published formula where it makes no light, reciprocity, and energy.

use super::Random;
use abbe::bsdf::sample_cosine;
use abbe::bsdf::sheen::{LEAST, Sheen};
use glam::{DVec3, dvec3};
use serde_json::Value;
use std::f64::consts::PI;

const WIDTHS: [f64; 5] = [LEAST, 0.02, 0.09, 0.3, 1.0];

#[test]
fn sheen_is_the_published_formula_where_that_makes_no_light() {
    let data: Value = serde_json::from_str(include_str!("../../data/sheen.json")).unwrap();
    let (mut as_published, number) = (0, |row: &Value, key: &str| row[key].as_f64().unwrap());
    let mut known: Vec<(f64, Sheen)> = Vec::new();
    let mut of_width = |alpha: f64| {
        let at = known.iter().position(|(a, _)| *a == alpha).unwrap_or_else(|| {
            known.push((alpha, Sheen::new(alpha, 1.0)));
            known.len() - 1
        });
        known[at].1.clone()
    };
    for row in data["rows"].as_array().unwrap() {
        let direction = |key: &str| {
            let [x, y, z] = [0, 1, 2].map(|i| row[key][i].as_f64().unwrap());
            dvec3(x, y, z).normalize()
        };
        let (sheen, wo, wi) = (of_width(number(row, "alpha")), direction("wi"), direction("wo"));
        let limit = sheen.albedo(wo.z).max(sheen.albedo(wi.z)).max(1.0);
        as_published += u32::from(limit == 1.0);
        let (ours, theirs) = (sheen.eval(wo, wi) / wi.z * limit, number(row, "value"));
        assert!((ours - theirs).abs() <= 1e-6 * theirs, "{row}: {ours}");
    }
    assert!(as_published >= 16, "{as_published}");
    // The table is linear between its nodes, the last of which lies before normal incidence, where the fit is steep.
    for row in data["albedos"].as_array().unwrap() {
        let (ours, theirs) = (of_width(number(row, "alpha")).albedo(number(row, "cos")), number(row, "albedo"));
        let limit = if number(row, "cos") == 1.0 { 5e-3 } else { 7e-4 };
        assert!((ours - theirs).abs() < limit, "{row}: {ours}");
    }
}

#[test]
fn sheen_is_reciprocal_and_so_is_what_it_leaves() {
    let mut random = Random(19);
    for alpha in WIDTHS {
        let sheen = Sheen::new(alpha, 0.8);
        for _ in 0..200 {
            let (a, b): (DVec3, DVec3) = (sample_cosine(random.array()), sample_cosine(random.array()));
            let (x, y) = (sheen.eval(a, b) / b.z, sheen.eval(b, a) / a.z);
            assert!((x - y).abs() <= 1e-9 * (x + y), "{alpha}: {x} against {y}");
            assert_eq!(sheen.over(a.z, b.z), sheen.over(b.z, a.z));
        }
    }
}

/// White under white sheen reflects no more than all light, and not much less; black under it what the table says where that is below 1.
#[test]
fn sheen_makes_no_light_over_white() {
    for alpha in WIDTHS {
        let sheen = Sheen::new(alpha, 1.0);
        for mu in [0.003f64, 0.01, 0.03, 0.1, 0.3, 0.7, 1.0] {
            let wo = dvec3((1.0 - mu * mu).sqrt(), 0.0, mu);
            // The midpoint rule over a square of the root of the cosine and the azimuth.
            const STEPS: usize = 400;
            let (mut own, mut below) = (0.0, 0.0);
            for i in 0..STEPS {
                let x = (i as f64 + 0.5) / STEPS as f64;
                let (z, r) = (x * x, (1.0 - x.powi(4)).sqrt());
                below += 4.0 * x * z * sheen.over(mu, z) / STEPS as f64;
                for k in 0..STEPS {
                    let phi = PI * (k as f64 + 0.5) / STEPS as f64;
                    own += 4.0 * PI * x * sheen.eval(wo, dvec3(r * phi.cos(), r * phi.sin(), z)) / (STEPS * STEPS) as f64;
                }
            }
            println!("alpha {alpha} mu {mu}: own {own:.4}, below {below:.4}, together {:.4}", own + below);
            assert!(own + below < 1.0 + 5e-4, "alpha {alpha} mu {mu}: {own} and {below}");
            assert!(own + below > 0.7, "alpha {alpha} mu {mu}: {own} and {below}");
            if sheen.albedo(mu) < 0.9 && alpha > 0.1 {
                assert!((own - sheen.albedo(mu)).abs() < 5e-3, "alpha {alpha} mu {mu}: {own} instead of {}", sheen.albedo(mu));
            }
        }
    }
}
