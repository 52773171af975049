//! The same request gives the same bits.

use super::support::*;
use crate::adapter;
use crate::sweep;
use abbe::film::Film;
use abbe::film::aov::albedos;
use abbe::output::SpectralImage;
use abbe::render::{Integrator, Renderer};
use abbe::scene::Scene;
use abbe::stats::BatchStats;
use serde_json::json;
use std::process::Command;

/// A caustic of dispersive glass in fog beside a mirror: both passes, and every kind of event.
fn rich_scene() -> Scene {
    scene_of(json!({
        "media": {"fog": {"sigma_s": [[400, 0.1], [700, 0.05]], "sigma_a": 0.01, "g": 0.5}},
        "surroundings": {"ior": 1, "medium": "fog"},
        "materials": {"flint": {"dielectric": {"ior": "N-SF11"}}, "mirror": {"conductor": {"metal": "Al"}}},
        "shapes": [
            {"sphere": {"center": [-0.6, 0.8, 0], "radius": 0.5}, "material": "flint"},
            {"sphere": {"center": [0.7, 0.8, 0], "radius": 0.5}, "material": "mirror"},
            {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.4}, "emission": {"radiance": 5}},
        ],
    }))
}

/// Two batches; the film's values as bits, and the counts without the clock.
fn render(scene: &Scene, seed: u64, spp: u32, most_groups: Option<u32>) -> (Vec<u64>, BatchStats) {
    render_batches(scene, seed, 2, spp, most_groups)
}

/// Some batches, those from the fifth on with sample counts that the ones before led to.
fn render_batches(scene: &Scene, seed: u64, batches: u32, spp: u32, most_groups: Option<u32>) -> (Vec<u64>, BatchStats) {
    let mut integrator = adapter::integrator(scene, seed).unwrap();
    assert!(integrator.plan().light.is_some());
    most_groups.iter().for_each(|&groups| integrator.limit_dispatches(groups));
    let mut film = Film::new(&scene.film);
    let mut stats = BatchStats::default();
    for batch in 0..batches {
        stats += integrator.render_batch(abbe::render::Batch::even(batch, spp), &mut film).unwrap();
    }
    // What an invocation has depends on its share.
    (stats.camera_time, stats.light_time, stats.longest_dispatch, stats.most_rays) = Default::default();
    ((0..film.pixels()).flat_map(|p| film.pixel(p).iter().map(|v| v.to_bits()).collect::<Vec<_>>()).collect(), stats)
}

#[test]
fn the_same_seed_gives_the_same_bits_however_the_work_is_split() {
    let scene = rich_scene();
    let first = render(&scene, 1, 17, None);
    assert!(first.0.iter().filter(|&&bits| f64::from_bits(bits) > 0.0).count() * 10 > first.0.len() * 9);
    assert_eq!(first.1.dropped(), 0);
    assert!(first.1.camera_rays > 0 && first.1.camera_rays < first.1.rays);
    for groups in [1, 5].into_iter().take(sweep::count(1)) {
        assert!(first == render(&scene, 1, 17, Some(groups)), "dispatches of {groups} workgroups differ");
    }
    let aovs = |groups| {
        let mut integrator = adapter::integrator(&scene, 1).unwrap();
        integrator.limit_dispatches(groups);
        integrator.aovs(&albedos(&scene), 0, 16).unwrap()
    };
    assert!(aovs(1 << 16) == aovs(1), "AOVs differ");
    // Of more blocks with fewer samples an invocation takes several; those at the rim are not whole.
    let mut wide = scene.clone();
    (wide.film.width, wide.film.height) = (100, 83);
    assert!(
        render_batches(&wide, 1, 5, 2, None) == render_batches(&wide, 1, 5, 2, Some(7)),
        "several blocks for an invocation, or adaptive samples, differ"
    );
    let other = render(&scene, 2, 17, None);
    let same = first.0.iter().zip(&other.0).filter(|(a, b)| a == b).count();
    assert!(same * 100 < first.0.len(), "{same} values of another seed are the same");
}

#[test]
fn what_else_the_machine_does_does_not_show() {
    // Threads leave visible points in any order, all the more if they are interrupted: neither sums nor what the guide learns may depend on it.
    let (_, mut scene) = shipped_scenes().into_iter().find(|(name, _)| name.ends_with("compare/pool.json")).unwrap();
    (scene.film.width, scene.film.height) = (32, 32);
    let first = render(&scene, 3, 2, None);
    let done = std::sync::atomic::AtomicBool::new(false);
    let others = std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let others: Vec<_> = (0..sweep::count(1).min(16)).map(|_| render(&scene, 3, 2, None)).collect();
        done.store(true, std::sync::atomic::Ordering::Relaxed);
        others
    });
    for other in others {
        assert!(first == other, "{} values differ", first.0.iter().zip(&other.0).filter(|(a, b)| a != b).count());
    }
}

#[test]
fn shaders_with_all_checks_on_give_the_same_picture() {
    let folder = std::env::temp_dir().join(format!("abbe-checked-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let render = |name: &str, checks: bool| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_abbe"));
        command.args(["render", "--size", "24x24", "--spp", "16", "--quiet", "-o"]).arg(folder.join(name));
        command.arg(project().join("scenes/compare/cornell_spheres.json"));
        command.env_remove("ABBE_CHECKED_SHADERS");
        if checks {
            command.env("ABBE_CHECKED_SHADERS", "1");
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        SpectralImage::read(folder.join(name)).unwrap().data
    };
    let (plain, checked) = (render("plain.exr", false), render("checked.exr", true));
    let _ = std::fs::remove_dir_all(&folder);
    assert!(plain.iter().any(|&v| v > 0.0));
    assert!(plain == checked, "an index out of range reads something else with checks on");
}
