//! Scenes from small JSON, and small kernels run on the adapter.

pub use crate::random::Random;

use abbe::gpu::{Gpu, Kernel, Resource, layout, shader};
use abbe::scene::{LoadOptions, Scene, load, load_str};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use wgpu::naga;

pub fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A scene from JSON, as small as it may be: a diffuse box in front of a camera, changed and added to by `more`.
pub fn scene_of(more: Value) -> Scene {
    let mut scene = json!({
        "film": {"width": 24, "height": 16, "bins": 20},
        "camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 1, 0], "vfov_deg": 40}},
        "materials": {"wall": {"diffuse": {"reflectance": 0.7}}},
        "shapes": [{"box": {"min": [-3, 0, -3], "max": [3, 4, 5]}, "material": "wall"}],
    });
    merge(&mut scene, more);
    let base = project().join("tests/data/scenes");
    load_str(&scene.to_string(), Path::new("test.json"), &base, &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{scene}: {e}"))
}

/// Adds to lists and objects, replaces all else; an object with one new key of several is replaced where it names one choice.
pub fn merge(into: &mut Value, more: Value) {
    match (into, more) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, value) in b {
                if key == "camera" {
                    a.insert(key, value);
                } else {
                    merge(a.entry(key).or_insert(Value::Null), value);
                }
            }
        }
        (Value::Array(a), Value::Array(b)) => a.extend(b),
        (a, b) => *a = b,
    }
}

/// All scenes that ship.
pub fn shipped_scenes() -> Vec<(PathBuf, Scene)> {
    let mut all = Vec::new();
    for folder in ["scenes", "scenes/compare"] {
        for entry in std::fs::read_dir(project().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "json") && !path.to_string_lossy().ends_with(".schema.json") {
                let scene = load(&path, &LoadOptions::default()).unwrap();
                all.push((path, scene));
            }
        }
    }
    assert!(all.len() >= 16);
    all
}

/// Parses and validates with no capability beyond core WebGPU.
pub fn validate(name: &str, source: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    let (flags, none) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    let valid = naga::valid::Validator::new(flags, none).validate(&module);
    valid.unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
    module
}

/// What stands before every kernel: shared numbers, records and their loaders.
pub fn prelude() -> String {
    layout::wgsl_prelude()
}

/// WGSL whose tables are declared as in `shaders/`.
pub fn with_tables(source: &str) -> String {
    source.lines().map(|line| shader::declaration(line, false).unwrap() + "\n").collect()
}

/// Text of one file of `shaders/`, with what it includes.
pub fn shader_file(path: &str, features: &BTreeMap<&str, bool>) -> String {
    shader::assemble(path, "", features).unwrap()
}

/// Runs `source`, whose storage buffer `out` holds `words` words, over `groups` workgroups, and returns `out`.
pub fn run_kernel(gpu: &Gpu, source: String, resources: &[(&str, &Resource)], words: usize, groups: u32) -> Vec<u32> {
    let kernel = Kernel::compile(gpu, "test", source).unwrap();
    let out = gpu.empty_storage("out", 4 * words as u64).unwrap();
    let bindings = kernel.bind(gpu, &[resources, &[("out", &out)]].concat()).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    kernel.dispatch(&mut encoder, &bindings, groups);
    gpu.queue.submit([encoder.finish()]);
    gpu.read(&out, 4 * words as u64).unwrap()
}
