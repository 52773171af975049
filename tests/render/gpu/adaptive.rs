//! Samples go where they are of use, and the picture stays the same.

use super::support::*;
use crate::adapter;
use abbe::film::Film;
use abbe::integrator::Techniques;
use abbe::render::Integrator;
use abbe::scene::Scene;
use serde_json::json;

const BATCHES: u32 = 16;

/// A diffuse ball under two lamps before nothing, far from the box of all these scenes, which takes up a fifth of the picture.
fn ball() -> Scene {
    scene_of(json!({
        "film": {"width": 48, "height": 48},
        "camera": {"perspective": {"eye": [20, 0, 5], "target": [20.9, 0.7, 0], "vfov_deg": 45}},
        "materials": {"white": {"diffuse": {"reflectance": 0.7}}},
        "shapes": [
            {"sphere": {"center": [20, 0, 0], "radius": 1}, "material": "white"},
            {"disc": {"center": [20, 6, 0], "normal": [0, -1, 0], "radius": 2}, "emission": {"radiance": 5}},
            {"disc": {"center": [14, 0, 4], "normal": [1, 0, 0], "radius": 2}, "emission": {"radiance": 5}},
        ],
    }))
}

fn render(scene: &Scene, seed: u64, techniques: Techniques) -> Film {
    let mut integrator = adapter::with(scene, seed, techniques).unwrap();
    let mut film = Film::new(&scene.film);
    for batch in 0..BATCHES {
        let stats = integrator.render_batch(abbe::render::Batch::even(batch, 8), &mut film).unwrap();
        assert_eq!(stats.dropped(), 0);
    }
    film
}

/// Y of the pixels.
fn luminances(film: &Film) -> Vec<f64> {
    (0..film.pixels()).map(|pixel| film.xyz(pixel)[1]).collect()
}

#[test]
fn errors_are_smaller_where_part_of_the_picture_has_none() {
    let scene = ball();
    let even = Techniques { adaptive_sampling: false, ..Techniques::default() };
    let renders = |techniques: Techniques| -> Vec<Film> { (1..=4).map(|seed| render(&scene, seed, techniques)).collect() };
    let (adaptive, even) = (renders(Techniques::default()), renders(even));
    // Variance over renders, sums over pixels: estimated by nothing that sampling goes by.
    let variance = |films: &[Film]| -> f64 {
        let values: Vec<Vec<f64>> = films.iter().map(luminances).collect();
        let of_pixel = |pixel: usize| {
            let mean = values.iter().map(|v| v[pixel]).sum::<f64>() / values.len() as f64;
            values.iter().map(|v| (v[pixel] - mean).powi(2)).sum::<f64>()
        };
        (0..values[0].len()).map(of_pixel).sum()
    };
    let (ours, theirs) = (variance(&adaptive), variance(&even));
    // A fifth of the pixels can have up to 3 times the samples in 12 of the 16 batches: half of the variance at best.
    assert!(ours < 0.7 * theirs, "{ours:.3e} against {theirs:.3e}");
    // What the film says of itself falls likewise.
    let said = |films: &[Film]| films.iter().map(|film| film.relative_error().powi(2)).sum::<f64>();
    assert!(said(&adaptive) < 0.8 * said(&even), "{} against {}", said(&adaptive), said(&even));
    // And the sum over all pixels is the same, as exactly as it is known.
    let sum = |film: &Film| luminances(film).iter().sum::<f64>();
    let mean_and_error = |films: &[Film]| {
        let sums: Vec<f64> = films.iter().map(sum).collect();
        let mean = sums.iter().sum::<f64>() / 4.0;
        (mean, (sums.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 12.0).sqrt())
    };
    let ((a, error_a), (b, error_b)) = (mean_and_error(&adaptive), mean_and_error(&even));
    assert!((a - b).abs() < 6.0 * error_a.hypot(error_b) + 1e-9, "{a} +- {error_a} against {b} +- {error_b}");
    assert!(error_a < 0.01 * a && a > 0.0);
}
