//! What passes count when asked to, and that they count nothing otherwise.

use super::support::*;
use crate::adapter;
use abbe::film::Film;
use abbe::integrator::{Plan, Techniques};
use abbe::render::Integrator;
use abbe::scene::Scene;
use abbe::stats::{BatchStats, Counts};
use serde_json::{Value, json};
use std::process::Command;

const SPP: u32 = 4;

fn render(scene: &Scene, plan: Plan) -> (Film, BatchStats) {
    let mut integrator = adapter::with_plan(scene, 1, plan).unwrap();
    integrator.set_light_paths(0.5);
    let mut film = Film::new(&scene.film);
    let stats = integrator.render_batch(abbe::render::Batch::even(0, SPP), &mut film).unwrap();
    (film, stats)
}

#[test]
fn counts_add_up_and_change_nothing_else() {
    let scene = scene_of(json!({
        "materials": {"mirror": {"conductor": {"metal": "Al"}}},
        "shapes": [
            {"sphere": {"center": [0, 0.8, 0], "radius": 0.5}, "material": "mirror"},
            {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.4}, "emission": {"radiance": 5}},
        ],
    }));
    let plan = Plan::new(&scene, Techniques::default());
    let (plain, uncounted) = render(&scene, plan.clone());
    assert_eq!((uncounted.camera_counts, uncounted.light_counts), (Counts::default(), Counts::default()));

    let (film, stats) = render(&scene, plan.counted());
    assert!((0..film.pixels()).all(|p| film.pixel(p) == plain.pixel(p)), "counting changed the picture");
    assert_eq!((stats.rays, stats.camera_rays), (uncounted.rays, uncounted.camera_rays));
    let paths = film.pixels() as u64 * u64::from(SPP);
    for (counts, paths, rays) in
        [(stats.camera_counts, paths, stats.camera_rays), (stats.light_counts, paths / 2, stats.rays - stats.camera_rays)]
    {
        assert_eq!(counts.ended.iter().sum::<u64>(), paths, "each path ends once: {counts:?}");
        assert!(counts.nodes >= rays, "each ray tests the root: {counts:?}, {rays} rays");
        // 12 triangles, a sphere and a disc.
        assert!(counts.primitives > rays && counts.primitives <= 14 * rays, "{counts:?}, {rays} rays");
    }
    // Nothing leaves the box, so that only a lamp that is met at once ends a path without an event.
    assert!(stats.camera_counts.ended[0] * 20 < paths && stats.camera_counts.ended[4..].iter().sum::<u64>() > paths / 2);
}

#[test]
fn bench_says_where_the_time_goes() {
    let output = Command::new(env!("CARGO_BIN_EXE_abbe"))
        .args(["bench", "--counts", "cornell_box", "--size", "16x16", "--json"])
        .env("XDG_RUNTIME_DIR", std::env::temp_dir())
        .output()
        .unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row: Value = serde_json::from_str(stdout.trim()).unwrap();
    let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    assert_eq!((row["case"].as_str(), row["pass"].as_str()), (Some("cornell_box"), Some("camera")));
    assert!(number("nodes_per_ray") >= 1.0 && number("primitives_per_ray") <= 12.0, "{row}");
    let bytes = 80.0 * number("nodes_per_ray") + 48.0 * number("primitives_per_ray");
    assert!((number("bytes_per_ray") / bytes - 1.0).abs() < 1e-12, "{row}");
    assert!(number("share_of_time") > 0.0 && number("share_of_time") <= 1.0, "{row}");
    // By the adapter's clock, if it has one, paths take longer than adding their samples to the film, and there are no light paths here.
    let shares = &row["share_of_clock"];
    let share = |name: &str| shares[name].as_f64().unwrap();
    assert!(
        shares.is_null() || share("camera paths") > share("film") && share("film") > 0.0 && share("light paths") == 0.0,
        "{row}"
    );
    assert!(number("longest_dispatch_seconds") > 0.0, "{row}");
    let alive: Vec<f64> = row["alive_after_events"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(alive[0] == 1.0 && alive.is_sorted_by(|a, b| a >= b) && alive[2] < 1.0, "{alive:?}");
}
