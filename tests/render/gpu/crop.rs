//! A part of a picture: the bits of the whole where nothing is learned from the picture, else what it has within errors.

use super::support::*;
use crate::adapter;
use abbe::compare::difference::threshold;
use abbe::film::Film;
use abbe::integrator::{GpuIntegrator, Plan, Techniques};
use abbe::render::{Batch, Integrator, Rendering, Stop};
use abbe::scene::{FilmSettings, Scene, Tile};
use serde_json::json;
use std::ops::ControlFlow;

/// A caustic beside glass, seen in a mirror too, of so many pixels.
fn scene(width: u32, height: u32, crop: Option<Tile>) -> Scene {
    let mut scene = scene_of(json!({
        "materials": {"glass": {"dielectric": {"ior": 1.5}}, "mirror": {"conductor": {"metal": "Al"}}},
        "shapes": [
            {"sphere": {"center": [-0.6, 0.8, 0], "radius": 0.5}, "material": "glass"},
            {"sphere": {"center": [0.7, 0.8, 0], "radius": 0.5}, "material": "mirror"},
            {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.4}, "emission": {"radiance": 5}},
        ],
    }));
    scene.film = FilmSettings { width, height, crop, ..scene.film };
    scene
}

const UNLEARNED: Techniques = Techniques {
    bsdf_sampling: true,
    next_event_estimation: true,
    light_paths: true,
    merging: true,
    guiding: false,
    adaptive_sampling: false,
    wavelength_sharing: true,
};

fn open(scene: &Scene, seed: u64, techniques: Techniques) -> GpuIntegrator {
    GpuIntegrator::on(adapter::gpu(), scene, seed, Plan::new(scene, techniques)).unwrap()
}

#[test]
fn a_part_has_the_bits_of_the_whole_and_one_that_learns_agrees_with_it() {
    // Not of whole blocks. The visible points of so many pixels do not fit one window of 16 passes, those of the part do.
    let part = Tile { x: 43, y: 50, width: 29, height: 21 };
    let rendered = |crop| {
        let scene = scene(160, 144, crop);
        let mut integrator = open(&scene, 3, UNLEARNED);
        integrator.set_light_paths(0.3);
        let mut film = Film::new(&scene.film);
        for batch in [Batch::nth(0, 160 * 144), Batch { index: 1, first_pass: 1, spp: 16, sequence: 0, first_sample: 1 }] {
            integrator.render_batch(batch, &mut film).unwrap();
        }
        (film, integrator)
    };
    let ((whole, _), (kept, integrator)) = (rendered(None), rendered(Some(part)));
    assert_eq!(kept.pixels(), 29 * 21);
    for (kept_pixel, pixel) in part.numbers(160).enumerate() {
        assert_eq!(kept.pixel(kept_pixel), whole.pixel(pixel), "pixel {pixel}");
    }
    assert!(kept.mean_of(0) > 0.0);
    let plan = abbe::render::Renderer::describe(&integrator);
    // 23040 pixels over 609, and 0.3 of that.
    assert!(plan.contains("29x21 pixels from 43,50 of 160x144") && plan.contains("37.8 N"), "{plan}");
    assert!(plan.contains("all those of the whole picture, 11.35 for each of the part"), "{plan}");

    // The caustic and its like in the mirror, by a guide and a budget of their own, and as the whole has them.
    let part = Tile { x: 8, y: 20, width: 40, height: 24 };
    let scene = scene(64, 64, Some(part));
    let mut means = Vec::new();
    for (seed, techniques) in [(1, Techniques::default()), (2, UNLEARNED)] {
        let mut integrator = open(&scene, seed, techniques);
        if techniques == UNLEARNED {
            integrator.set_light_paths(0.5);
        }
        let mut rendering = Rendering::new(Film::new(&scene.film));
        let stop = Stop { spp: Some(192), ..Stop::default() };
        rendering.render(&mut integrator, &stop, &mut |_, _| ControlFlow::Continue(())).unwrap();
        let budget = integrator.budget().unwrap();
        assert_eq!(budget.probe.is_some(), techniques != UNLEARNED);
        means.push(rendering.film);
    }
    let [learned, plain] = &means[..] else { unreachable!() };
    let bins = learned.bins();
    for bin in 0..bins {
        let (a, b) = (learned.mean_of(bin), plain.mean_of(bin));
        let error = learned.mean_standard_error(bin).hypot(plain.mean_standard_error(bin));
        assert!(error < 0.01 * b, "bin {bin}: an error of {error:.3e} for {b:.3e} is too large to tell");
        let z = (a - b) / error;
        assert!(z.abs() < threshold(bins, 31.0), "bin {bin}: {a:.5e} for {b:.5e}, {z:.2} standard errors");
    }
}
