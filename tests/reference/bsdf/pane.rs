//! Thin panes: the sum over bounces, and rough ones: reciprocity, energy, and sampling by their densities.

use super::{Random, chi_square, tilted};
use abbe::bsdf::conductor::RoughConductor;
use abbe::bsdf::energy::EnergyTable;
use abbe::bsdf::ggx::Width;
use abbe::bsdf::pane::{Pane, PaneFilm, RoughPane};
use abbe::bsdf::thin_film::Stack;
use abbe::bsdf::{fresnel, sample_cosine};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;

fn clear(eta: f64) -> Pane {
    Pane { eta, depth: 0.0, film: None }
}

/// Light followed through the pane bounce by bounce.
fn followed(face: f64, way: f64) -> [f64; 2] {
    let (mut out, mut inside) = ([face, 0.0], 1.0 - face);
    for bounce in 0..2000 {
        inside *= way;
        out[(bounce + 1) % 2] += inside * (1.0 - face);
        inside *= face;
    }
    out
}

#[test]
fn panes_reflect_and_let_through_what_light_does_that_is_followed_bounce_by_bounce() {
    let mut random = Random(41);
    for _ in 0..500 {
        let [n, cos, depth, waves] = random.array();
        let (eta, depth) = (1.0 + 2.0 * n, 3.0 * depth);
        let cos_t = fresnel::cos_transmitted(cos, eta).expect("from outside light enters");
        let film = Stack { near: 1.0, film: 1.3, waves, far: (eta, 0.0) };
        for (pane, face) in [
            (Pane { depth, ..clear(eta) }, fresnel::dielectric(cos, eta)),
            (Pane { depth, film: Some(PaneFilm::OnFaces(film)), ..clear(eta) }, film.reflectance(cos)),
        ] {
            let (ours, exact) = (pane.shares(cos), followed(face, (-depth / cos_t).exp()));
            assert!((0..2).all(|i| (ours[i] - exact[i]).abs() < 1e-9), "{pane:?} at {cos}: {ours:?}, not {exact:?}");
        }
        let [reflected, through] = clear(eta).shares(cos);
        assert!((reflected - fresnel::thin_pane(cos, eta)).abs() < 1e-12 && (reflected + through - 1.0).abs() < 1e-12);
    }
    // From within the denser medium all is reflected beyond the critical angle.
    assert_eq!(clear(1.0 / 1.5).shares(0.3), [1.0, 0.0]);
}

/// Widths along x and y with their tables.
fn facets() -> Vec<(Width, EnergyTable)> {
    let even = [0.05, 0.3, 1.0].map(|a| (a.into(), EnergyTable::conductor(a)));
    let brushed = Width { x: 0.7, y: 0.1 };
    even.into_iter().chain([(brushed, EnergyTable::brushed(brushed))]).collect()
}

#[test]
fn rough_panes_are_reciprocal_and_clear_ones_lose_no_light() {
    let mut random = Random(42);
    for (width, energy) in &facets() {
        let rough = RoughPane { facets: RoughConductor { alpha: *width, energy } };
        let film = PaneFilm::Whole(Stack { near: 1.0, film: 1.4, waves: 0.8, far: (1.0, 0.0) });
        for pane in [clear(1.5), Pane { film: Some(film), ..clear(1.4) }, Pane { depth: 0.7, ..clear(1.8) }] {
            for _ in 0..200 {
                let (a, b): (DVec3, DVec3) = (sample_cosine(random.array()), sample_cosine(random.array()));
                // What comes through from behind sees the pane turned upside down.
                let turned = |w: DVec3| dvec3(w.x, w.y, -w.z);
                let same = |x: f64, y: f64| assert!((x - y).abs() <= 1e-9 * (x + y), "{width:?}: {x} against {y}");
                same(rough.eval(a, b, &pane) / b.z, rough.eval(b, a, &pane) / a.z);
                same(rough.eval(a, turned(b), &pane) / b.z, rough.eval(b, turned(a), &pane) / a.z);
            }
        }
        const N: usize = 100_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..N {
            let wo = sample_cosine(random.array());
            let half = rough.sample(wo, |_| 0.5, random.array());
            let weight = half.map_or(0.0, |(wi, weight, cos)| 2.0 * weight * clear(1.5).shares(cos)[usize::from(wi.z < 0.0)]);
            sum += weight;
            squares += weight * weight;
        }
        let mean = sum / N as f64;
        let error = ((squares / N as f64 - mean * mean) / N as f64).sqrt();
        assert!((mean - 1.0).abs() < 1e-3 + 4.0 * error && error < 0.01, "{width:?}: {mean} +- {error}");
    }
}

#[test]
fn rough_panes_are_sampled_with_their_density_and_weigh_what_they_scatter() {
    let mut random = Random(43);
    for (width, energy) in facets().iter().skip(1) {
        let rough = RoughPane { facets: RoughConductor { alpha: *width, energy } };
        let (pane, reflection) = (clear(1.7), |cos: f64| 0.2 + 0.3 * cos);
        let wo = tilted(0.6);
        chi_square(
            &format!("rough pane {width:?}"),
            |w| rough.pdf(wo, w, reflection),
            |r| rough.sample(wo, reflection, r.array()).map(|s| s.0),
        );
        for side in [1.0, -1.0] {
            const N: usize = 200_000;
            let (mut sum, mut difference, mut squares) = (0.0, 0.0, 0.0);
            for _ in 0..N {
                let share = |cos: f64| pane.shares(cos)[usize::from(side < 0.0)];
                let q = |cos: f64| if side > 0.0 { reflection(cos) } else { 1.0 - reflection(cos) };
                let sampled = rough.sample(wo, reflection, random.array()).filter(|s| s.0.z * side > 0.0);
                let by_weight = sampled.map_or(0.0, |(wi, weight, cos)| weight * share(cos) / q(cos) * wi.x.abs());
                let wi = sample_cosine(random.array());
                let by_value = rough.eval(wo, dvec3(wi.x, wi.y, wi.z * side), &pane) * PI / wi.z * wi.x.abs();
                sum += by_value;
                difference += by_weight - by_value;
                squares += (by_weight - by_value).powi(2);
            }
            let error = squares.sqrt() / N as f64;
            assert!(difference.abs() / (N as f64) < 4.0 * error, "{width:?}, side {side}: {} +- {error}", difference / N as f64);
            assert!(error < 0.02 * sum / N as f64, "an error of {error} is too large to tell anything");
        }
    }
}
