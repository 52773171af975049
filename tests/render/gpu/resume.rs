//! A render that was stopped goes on bit by bit.

use super::support::*;
use crate::sweep;
use abbe::film::Film;
use abbe::gpu::Gpu;
use abbe::integrator::{GpuIntegrator, Plan, Techniques};
use abbe::render::{Batch, Checkpointable, Halt, Integrator, Rendering, Stop};
use abbe::scene::Scene;
use abbe::state::{Persistent, State};
use serde_json::json;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

/// A caustic seen in a mirror, on a film with blocks that are noisier than others: light is traced, merged and guided, and samples are adaptive.
fn scene() -> Scene {
    scene_of(json!({
        "materials": {"flint": {"dielectric": {"ior": "N-SF11"}}, "mirror": {"conductor": {"metal": "Al"}}},
        "shapes": [
            {"sphere": {"center": [-0.6, 0.8, 0], "radius": 0.5}, "material": "flint"},
            {"sphere": {"center": [0.7, 0.8, 0], "radius": 0.5}, "material": "mirror"},
            {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.4}, "emission": {"radiance": 5}},
        ],
    }))
}

/// All that a render leaves behind, without what the clock says.
fn saved(rendering: &Rendering, integrator: &mut dyn Integrator) -> Vec<u8> {
    let mut rendering = rendering.clone();
    let (stats, none) = (&mut rendering.stats, Duration::ZERO);
    (rendering.elapsed, stats.camera_time, stats.light_time, stats.longest_dispatch) = (none, none, none, none);
    let mut bytes = Vec::new();
    let mut state = State::saving(&mut bytes);
    Checkpointable::new(&mut rendering, integrator).persist(&mut state).unwrap();
    state.finish().unwrap();
    bytes
}

fn restored(bytes: &[u8], rendering: &mut Rendering, integrator: &mut GpuIntegrator) -> std::io::Result<()> {
    let mut bytes = bytes;
    let mut state = State::restoring(&mut bytes);
    Checkpointable::new(rendering, integrator).persist(&mut state)?;
    state.finish()
}

#[test]
fn a_render_goes_on_from_any_batch_as_if_it_had_never_stopped() {
    let scene = scene();
    let gpu = Arc::new(Gpu::open(None).unwrap());
    let all = Techniques::default();
    let variants = [all, Techniques { merging: false, ..all }, Techniques { guiding: false, adaptive_sampling: false, ..all }];
    for techniques in variants.into_iter().take(sweep::count(1)) {
        let plan = Plan::new(&scene, techniques);
        let open = || GpuIntegrator::on(gpu.clone(), &scene, 7, plan.clone()).unwrap();
        // Past the second probe, and into batches with samples that blocks share out.
        let stop = Stop { spp: Some(64), ..Stop::default() };
        let (mut whole, mut integrator, mut states) = (Rendering::new(Film::new(&scene.film)), open(), Vec::new());
        let observe = &mut |_: &_, state: &mut Checkpointable<'_>| {
            let (rendering, integrator) = state.settled();
            states.push(saved(rendering, integrator));
            ControlFlow::Continue(())
        };
        whole.render(&mut integrator, &stop, observe).unwrap();
        assert_eq!(states.len(), 28);
        // Every batch is rendered anew from the state before it, the last one first: what is not restored is that of a later batch.
        let mut integrator = open();
        for (i, [before, after]) in states.iter().zip(&states[1..]).map(|(a, b)| [a, b]).enumerate().rev() {
            let mut rendering = Rendering::new(Film::new(&scene.film));
            restored(before, &mut rendering, &mut integrator).unwrap();
            rendering.render(&mut integrator, &stop, &mut |_, _| ControlFlow::Break(())).unwrap();
            assert!(saved(&rendering, &mut integrator) == *after, "batch {} differs after a restart ({techniques:?})", i + 1);
        }
        assert!(integrator.budget().is_some_and(|b| b.probe.is_some()) || !techniques.guiding);
    }
}

#[test]
fn an_interrupted_batch_of_many_tiles_is_gone_on_with() {
    // More bins, so that a film of few pixels is rendered in tiles.
    let mut scene = scene();
    (scene.film.width, scene.film.height, scene.film.bins.count) = (640, 96, 400);
    let gpu = Arc::new(Gpu::open(None).unwrap());
    let plan = Plan::new(&scene, Techniques { light_paths: false, merging: false, guiding: false, ..Techniques::default() });
    let open = || GpuIntegrator::on(gpu.clone(), &scene, 7, plan.clone()).unwrap();
    let mut whole = Film::new(&scene.film);
    let mut integrator = open();
    assert!(integrator.tile_count() > 1, "{} tiles", integrator.tile_count());
    integrator.render_batch(Batch::nth(0, whole.pixels()), &mut whole).unwrap();

    let mut rendering = Rendering::new(Film::new(&scene.film));
    let (mut integrator, halt) = (open(), Halt::default());
    integrator.heed(&halt);
    // The request comes while some tile is under way; which one does not matter.
    let stopper = std::thread::spawn({
        let halt = halt.clone();
        move || {
            std::thread::sleep(std::time::Duration::from_millis(300));
            halt.request();
        }
    });
    let ended =
        rendering.render(&mut integrator, &Stop { spp: Some(1), ..Stop::default() }, &mut |_, _| ControlFlow::Continue(()));
    stopper.join().unwrap();
    let bytes = saved(&rendering, &mut integrator);
    let (mut again, mut integrator) = (Rendering::new(Film::new(&scene.film)), open());
    restored(&bytes, &mut again, &mut integrator).unwrap();
    again.render(&mut integrator, &Stop { spp: Some(1), ..Stop::default() }, &mut |_, _| ControlFlow::Continue(())).unwrap();
    assert!((0..whole.pixels()).all(|p| whole.pixel(p) == again.film.pixel(p)), "interrupted: {}", ended.is_err());
}

#[test]
fn a_damaged_or_foreign_state_is_an_error() {
    let scene = scene();
    let plan = Plan::new(&scene, Techniques { light_paths: false, merging: false, guiding: false, ..Techniques::default() });
    let gpu = Arc::new(Gpu::open(None).unwrap());
    let mut integrator = GpuIntegrator::on(gpu, &scene, 7, plan).unwrap();
    let mut rendering = Rendering::new(Film::new(&scene.film));
    rendering.render(&mut integrator, &Stop { spp: Some(1), ..Stop::default() }, &mut |_, _| ControlFlow::Continue(())).unwrap();
    let bytes = saved(&rendering, &mut integrator);
    restored(&bytes, &mut rendering, &mut integrator).unwrap();
    for at in [0, 9, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x40;
        assert!(restored(&damaged, &mut rendering, &mut integrator).is_err(), "byte {at}");
        assert!(restored(&bytes[..at], &mut rendering, &mut integrator).is_err(), "the first {at} bytes");
    }
    let mut other = Rendering::new(Film::new(&abbe::scene::FilmSettings { width: 25, ..scene.film.clone() }));
    assert!(restored(&bytes, &mut other, &mut integrator).is_err());
}
