//! Frames of a sequence take turns on one device.

use super::support::*;
use abbe::film::Film;
use abbe::gpu::Gpu;
use abbe::integrator::{GpuIntegrator, Plan, Techniques};
use abbe::render::{Batch, Integrator};
use abbe::scene::{LoadOptions, load};
use std::sync::Arc;

#[test]
fn frames_share_the_kernels_of_a_device_and_are_what_they_are_without() {
    let gpu = Arc::new(Gpu::open(None).unwrap());
    let render = |frame: u32| {
        let options = LoadOptions { frame: Some(frame), width: Some(24), height: Some(16), ..LoadOptions::default() };
        let scene = load(&project().join("scenes/turning_prism.json"), &options).unwrap();
        let mut integrator = GpuIntegrator::on(gpu.clone(), &scene, 5, Plan::new(&scene, Techniques::default())).unwrap();
        let mut film = Film::new(&scene.film);
        integrator.render_batch(Batch::even(0, 4), &mut film).unwrap();
        let values: Vec<f64> = (0..film.pixels()).flat_map(|pixel| film.pixel(pixel).to_vec()).collect();
        (values, gpu.compilations())
    };
    // The first one is alone on the device.
    let (alone, compiled) = render(45);
    let (other, of_other) = render(0);
    let (after, of_after) = render(45);
    assert_eq!((of_other, of_after), (compiled, compiled));
    assert_eq!(alone, after);
    assert_ne!(alone, other);
}
