//! Adapters that bind less than the one at hand: core WebGPU has four storage textures and eight storage buffers in a stage, and its device refuses more.

use super::support::*;
use abbe::film::Film;
use abbe::film::aov::albedos;
use abbe::gpu::Gpu;
use abbe::integrator::{GpuIntegrator, Plan, Techniques};
use abbe::render::{Batch, Integrator, Renderer};
use abbe::scene::Scene;
use serde_json::json;
use std::sync::Arc;

/// Dispersive glass and a mirror, a smooth mesh and a picture: light is traced, merged and guided. Few wavelengths, since lavapipe takes its time to compile
/// what reads buffers.
fn scene() -> Scene {
    scene_of(json!({
        "film": {"bins": 4},
        "materials": {
            "flint": {"dielectric": {"ior": "N-SF11"}}, "mirror": {"conductor": {"metal": "Al"}},
            "picture": {"diffuse": {"reflectance": {"texture": "sky.png"}}},
        },
        "shapes": [
            {"sphere": {"center": [-0.6, 0.8, 0], "radius": 0.5}, "material": "flint"},
            {"sphere": {"center": [0.7, 0.8, 0], "radius": 0.5}, "material": "mirror"},
            {"quad": {"corner": [-1, 0, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}, "material": "picture"},
            {"mesh": {"file": "square.obj", "smooth": true}, "material": "wall"},
            {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.4}, "emission": {"radiance": 5}},
        ],
    }))
}

#[test]
fn an_adapter_that_binds_no_more_than_core_webgpu_gives_the_same_bits() {
    let scene = scene();
    let rendered = |gpu: Gpu| {
        let mut integrator = GpuIntegrator::on(Arc::new(gpu), &scene, 7, Plan::new(&scene, Techniques::default())).unwrap();
        let mut film = Film::new(&scene.film);
        integrator.render_batch(Batch::even(0, 4), &mut film).unwrap();
        assert!(integrator.budget().is_some_and(|b| b.probe.is_some()), "light paths are not guided");
        let bits: Vec<u64> = (0..film.pixels()).flat_map(|p| film.pixel(p).iter().map(|v| v.to_bits())).collect();
        (bits, integrator.aovs(&albedos(&scene), 0, 2).unwrap())
    };
    let core = wgpu::Limits::default();
    assert!(core.max_storage_textures_per_shader_stage < 8 && core.max_storage_buffers_per_shader_stage <= 8);
    let (bits, aovs) = rendered(Gpu::open(None).unwrap());
    let (bits_of_core, aovs_of_core) = rendered(Gpu::open_within(None, &core).unwrap());
    assert!(bits.iter().filter(|bits| f64::from_bits(**bits) > 0.0).count() > bits.len() / 2, "a black film");
    assert!(bits == bits_of_core, "bits differ");
    assert!(aovs == aovs_of_core, "what is seen first differs");
}

/// Adapters differ in the size of theirs.
#[test]
fn no_kernel_asks_for_subgroups() {
    for (name, source) in super::plan::kernels(&scene()) {
        assert!(!source.contains("subgroup"), "{name}");
    }
}
