//! Promises that hold for any scene, on random ones of fixed seeds: in uniform light nothing lossless can be seen, the GPU agrees with the reference,
//! light finds its way back, and what the greatest depth takes is counted.

use crate::adapter;
use crate::random::Random;
use crate::sweep;
use abbe::compare::difference::threshold;
use abbe::film::Film;
use abbe::integrator::Techniques;
use abbe::reference::ReferenceIntegrator;
use abbe::render::Integrator;
use abbe::scene::{Estimator, LoadOptions, Scene, load_str};
use abbe::stats::BatchStats;
use abbe::validate::figure::Figure;
use serde_json::{Value, json};
use std::path::Path;

const BATCHES: u32 = 24;

fn within(random: &mut Random, lo: f64, hi: f64) -> f64 {
    lo + (hi - lo) * random.next()
}

/// Four solids (no more volumes are kept track of) that overlap as they like: balls, blocks and prisms of glass, smooth and frosted, with dispersion and without, and fog that only scatters.
fn solids(random: &mut Random) -> (Value, Value) {
    let (mut materials, mut shapes) = (json!({}), Vec::new());
    for i in 0..4 {
        let name = format!("solid {i}");
        let n = within(random, 1.1, 2.0);
        materials[&name] = match i {
            0 => json!({"dielectric": {"ior": {"cauchy": [n, 0.02]}, "priority": 1 + i}}),
            1 => json!({"dielectric": {"ior": n, "alpha": within(random, 0.1, 0.8), "priority": 1 + i}}),
            // Where glass overlaps it there is glass: a boundary does not refract, whatever the index behind it.
            2 => json!({"boundary": {"medium": "fog", "priority": 0}}),
            _ => json!({"dielectric": {"ior": n, "priority": 1 + i}}),
        };
        let translate = [0; 3].map(|_| within(random, -0.5, 0.5));
        let geometry = match i % 3 {
            0 => json!({"sphere": {"center": [0, 0, 0], "radius": within(random, 0.2, 0.5)}}),
            1 => json!({"box": {"min": [-0.3, -0.2, -0.4], "max": [0.3, 0.3, 0.2]}}),
            _ => json!({"prism": {"polygon": [[-0.5, -0.3], [0.5, -0.3], [0, 0.5]], "length": 0.7}}),
        };
        let mut shape = geometry;
        shape["material"] = json!(name);
        let angles = [0; 3].map(|_| within(random, 0.0, 360.0));
        shape["transform"] = json!({"rotate_deg": angles, "translate": translate});
        shapes.push(shape);
    }
    (materials, shapes.into())
}

fn scene(seed: u64, more: Value) -> Scene {
    let (materials, shapes) = solids(&mut Random(seed));
    let mut value = json!({
        "film": {"width": 8, "height": 8, "range_nm": [400, 700], "bins": 4},
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}},
        "max_depth": 2000,
        "media": {"fog": {"sigma_s": 1.5, "g": 0.3}},
        "materials": materials,
        "shapes": shapes,
        "lights": [],
    });
    for (key, items) in more.as_object().expect("an object") {
        match (value[key].as_array_mut(), items) {
            (Some(list), Value::Array(items)) => list.extend(items.iter().cloned()),
            _ => value[key] = items.clone(),
        }
    }
    load_str(&value.to_string(), Path::new("random"), Path::new("."), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Means of every bin over the film, batch by batch.
fn batches(integrator: &mut dyn Integrator, scene: &Scene, spp: u32) -> (Vec<Figure>, BatchStats) {
    let mut stats = BatchStats::default();
    let means: Vec<Vec<f64>> = (0..BATCHES)
        .map(|index| {
            let mut film = Film::new(&scene.film);
            stats += integrator.render_batch(abbe::render::Batch::even(index, spp), &mut film).expect("a batch");
            (0..film.bins()).map(|bin| film.mean_of(bin)).collect()
        })
        .collect();
    assert_eq!(stats.dropped(), 0, "{stats:?}");
    ((0..means[0].len()).map(|bin| Figure::of(&means.iter().map(|m| m[bin]).collect::<Vec<_>>())).collect(), stats)
}

#[test]
fn random_solids_in_uniform_light_cannot_be_seen() {
    for seed in (1..=2).take(sweep::count(1)) {
        let scene = scene(seed, json!({"lights": [{"constant": {"radiance": 1}}]}));
        let mut gpu = adapter::integrator(&scene, seed).expect("an adapter");
        for f in batches(&mut gpu, &scene, 64).0 {
            println!("seed {seed}: {f:?}");
            assert!((f.mean - 1.0).abs() < threshold(8, f.dof) * f.error + 1e-3, "seed {seed}: {f:?}");
            assert!(f.error < 0.01, "seed {seed}: {f:?} tells nothing");
        }
    }
}

#[test]
fn random_solids_under_a_lamp_are_what_the_reference_sees() {
    for seed in [4] {
        let lamp = json!({"shapes": [{"sphere": {"center": [1, 3, 2], "radius": 1.5}, "emission": {"radiance": 1}}],
            "lights": [{"constant": {"radiance": 0.2}}]});
        let scene = scene(seed, lamp);
        let mut gpu = adapter::integrator(&scene, seed).expect("an adapter");
        let ours = batches(&mut gpu, &scene, 128).0;
        let mut reference = ReferenceIntegrator::new(&scene, Estimator::Backward, seed).expect("a scene it can see");
        let theirs = batches(&mut reference, &scene, 32).0;
        for (ours, theirs) in ours.iter().zip(&theirs) {
            let error = ours.error.hypot(theirs.error);
            println!("seed {seed}: {ours:?}, reference {theirs:?}");
            let limit = threshold(4, f64::from(BATCHES - 1));
            assert!((ours.mean - theirs.mean).abs() < limit * error, "seed {seed}: {ours:?}, reference {theirs:?}");
            assert!(error < 0.02 * theirs.mean, "seed {seed}: an error of {error} tells nothing");
        }
    }
}

/// A small square close to the solids and a large one farther away: flux from the one to the other and back. Seen to fail with radiance behind glass off
/// by half in the camera pass.
#[test]
#[ignore = "long: in tools/soak"]
fn random_solids_let_as_much_light_through_both_ways() {
    let half = |upper: bool| -> f64 { if upper { 0.3 } else { 2.0 } };
    let square = |upper: bool, off: f64| {
        let (y, a) = (if upper { 1.3 - off } else { off - 1.6 }, half(upper));
        let z = if upper { -a } else { a };
        json!({"corner": [-a, y, z], "edge_u": [2.0 * a, 0, 0], "edge_v": [0, 0, -2.0 * z]})
    };
    for seed in (1..=2).take(sweep::count(1)) {
        let flux = |from_above: bool| {
            let sensor = square(!from_above, 1e-5);
            let scene = scene(
                seed,
                json!({
                    "camera": {"irradiance_plane": {"origin": sensor["corner"], "edge_u": sensor["edge_u"], "edge_v": sensor["edge_v"]}},
                    "shapes": [{"quad": square(from_above, 0.0), "emission": {"radiance": 1}}],
                }),
            );
            let mut gpu = adapter::integrator(&scene, seed + u64::from(from_above)).expect("an adapter");
            let area = (2.0 * half(!from_above)).powi(2);
            let scaled = |f: &Figure| Figure { mean: area * f.mean, error: area * f.error, ..*f };
            batches(&mut gpu, &scene, 128).0.iter().map(scaled).collect::<Vec<_>>()
        };
        for (down, up) in flux(true).iter().zip(&flux(false)) {
            let error = down.error.hypot(up.error);
            println!("seed {seed}: {down:?}, {up:?}");
            assert!((down.mean - up.mean).abs() < threshold(8, f64::from(BATCHES - 1)) * error, "seed {seed}: {down:?}, {up:?}");
            assert!(error < 0.01 * up.mean, "seed {seed}: an error of {error} tells nothing");
        }
    }
}

/// Light trapped in a cube reaches a lamp or the greatest depth: the shares add up to 1, but for paths that reach the lamp with their last event and
/// count for both.
#[test]
fn what_the_greatest_depth_takes_from_a_chain_is_counted() {
    let scene = json!({
        "film": {"width": 8, "height": 8, "range_nm": [400, 700], "bins": 2},
        "camera": {"perspective": {"eye": [0.2, 0.3, 0.1], "target": [1.2, 1.25, 1.1], "vfov_deg": 10}},
        "max_depth": 100,
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "material": "glass"},
            {"sphere": {"center": [0.55, 0.62, 0.47], "radius": 0.05}, "emission": {"radiance": 1}},
        ],
    });
    let scene = load_str(&scene.to_string(), Path::new("cube"), Path::new("."), &LoadOptions::default()).expect("a scene");
    let techniques = Techniques { light_paths: false, merging: false, ..Techniques::default() };
    let mut gpu = adapter::with(&scene, 1, techniques).expect("an adapter");
    let (bins, stats) = batches(&mut gpu, &scene, 4);
    let truncated = stats.truncated as f64 / stats.paths as f64;
    assert!(truncated > 0.1, "{stats:?}");
    for bin in bins {
        let sum = bin.mean + truncated;
        assert!(sum > 1.0 - 1e-4 && sum < 1.005, "{bin:?} and {truncated}");
    }
}
