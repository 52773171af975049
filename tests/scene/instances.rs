//! Meshes that stand in many places are stored once.

use crate::{load_text, scene_with};
use abbe::gpu::Gpu;
use abbe::gpu::scene::GpuScene;
use abbe::scene::{Geometry, Instance, LoadOptions, Scene, load, load_str};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A sheet of 2 x 32 x 32 triangles as an OBJ file in a folder of its own.
fn sheet(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("abbe-instances-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut text = String::new();
    for i in 0..33 {
        for j in 0..33 {
            text += &format!("v {} {} {}\n", f64::from(i) / 32.0, f64::from(j) / 32.0, f64::from(i * j % 5) / 64.0);
        }
    }
    for i in 0..32 {
        for j in 0..32 {
            let at = 33 * i + j + 1;
            text += &format!("f {} {} {}\nf {0} {2} {}\n", at, at + 33, at + 34, at + 1);
        }
    }
    std::fs::write(folder.join("sheet.obj"), text).unwrap();
    folder
}

fn load_in(folder: &Path, shapes: Value, groups: Value) -> Scene {
    let scene = json!({
        "film": {"width": 8, "height": 8},
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}},
        "materials": {"m": {"diffuse": {"reflectance": 0.5}}},
        "groups": groups,
        "shapes": shapes,
    });
    load_str(&scene.to_string(), Path::new("test.json"), folder, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn instances(scene: &Scene) -> Vec<&Instance> {
    scene.shapes.iter().filter_map(|s| if let Geometry::Instance(i) = &s.geometry { Some(i) } else { None }).collect()
}

#[test]
fn a_mesh_in_many_places_is_stored_once_and_stands_where_a_copy_would() {
    let folder = sheet("places");
    let groups = json!({"one": [{"mesh": {"file": "sheet.obj"}, "material": "m"}]});
    // Every third is mirrored.
    let place = |i: i32| json!({"translate": [i % 40, 0.5, i / 40], "rotate_deg": [i, 2 * i, 0], "scale": [1, 0.5, if i % 3 == 0 { -1 } else { 1 }]});
    let many: Vec<Value> = (0..2400).map(|i| json!({"instance": "one", "transform": place(i)})).collect();
    let scene = load_in(&folder, json!(many), groups.clone());
    let found = instances(&scene);
    assert_eq!(found.len(), 2400);
    // One mesh, and one for mirrored places.
    assert!(found.iter().enumerate().all(|(i, f)| Arc::ptr_eq(f.mesh(), found[usize::from(i % 3 != 0)].mesh())));
    for i in [0, 1, 1234] {
        let single = load_in(&folder, json!([many[i]]), groups.clone());
        let Geometry::Mesh(own) = &single.shapes[0].geometry else { panic!("a mesh in one place is its own") };
        let carried = found[i].flattened();
        assert_eq!(own.triangles, carried.triangles);
        let far = own.positions.iter().zip(&carried.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(far < 1e-13, "{far}");
        let b = found[i].bounds();
        assert!(carried.positions.iter().all(|p| p.cmpge(b.min - DVec3::splat(1e-12)).all() && p.cmple(b.max + 1e-12).all()));
    }
    // The adapter has it once, too.
    let gpu = Gpu::open(None).unwrap();
    let all = GpuScene::new(&gpu, &scene, true).unwrap().bytes;
    let one = GpuScene::new(&gpu, &load_in(&folder, json!([many[0]]), groups), true).unwrap().bytes;
    assert!(all < 8 * one, "{all} bytes, {one} for a single place");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn few_places_small_meshes_and_lamps_are_meshes_of_their_own() {
    let folder = sheet("few");
    let sheet = json!({"mesh": {"file": "sheet.obj"}, "material": "m"});
    let few = load_in(&folder, json!([sheet, sheet, sheet]), json!({}));
    assert!(instances(&few).is_empty());
    let lamps: Vec<Value> = (0..600).map(|_| json!({"mesh": {"file": "sheet.obj"}, "emission": {"radiance": 1}})).collect();
    assert!(instances(&load_in(&folder, json!(lamps), json!({}))).is_empty());
    std::fs::remove_dir_all(folder).unwrap();
    let small: Vec<Value> = (0..3000).map(|_| json!({"mesh": {"file": "square.obj"}, "material": "m"})).collect();
    assert!(instances(&load_text(&scene_with("shapes", &json!(small).to_string())).unwrap()).is_empty());
}

#[test]
fn nodes_of_a_gltf_file_share_their_mesh_and_a_file_included_again_is_not_read_again() {
    let folder = sheet("gltf");
    let obj = std::fs::read_to_string(folder.join("sheet.obj")).unwrap();
    let numbers = |kind: &str| -> Vec<f64> {
        obj.lines().filter_map(|l| l.strip_prefix(kind)).flat_map(str::split_whitespace).map(|w| w.parse().unwrap()).collect()
    };
    let (positions, indices) = (numbers("v "), numbers("f "));
    let mut bytes: Vec<u8> = positions.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
    bytes.extend(indices.iter().flat_map(|i| (*i as u16 - 1).to_le_bytes()));
    std::fs::write(folder.join("sheet.bin"), &bytes).unwrap();
    let split = positions.len() * 4;
    let nodes: Vec<Value> = (0..600).map(|i| json!({"mesh": 0, "translation": [i, 0, 0]})).collect();
    let document = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": (0..600).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": "stone"}],
        "buffers": [{"uri": "sheet.bin", "byteLength": bytes.len()}],
        "bufferViews": [{"buffer": 0, "byteLength": split}, {"buffer": 0, "byteOffset": split, "byteLength": indices.len() * 2}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": positions.len() / 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": indices.len(), "type": "SCALAR"}],
    });
    let path = folder.join("sheets.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let alone = instances(&scene);
    assert_eq!(alone.len(), 600);
    assert!(alone.iter().all(|i| Arc::ptr_eq(i.mesh(), alone[0].mesh())));
    let twice =
        json!([{"gltf": {"file": "sheets.gltf"}}, {"gltf": {"file": "sheets.gltf"}, "transform": {"translate": [0, 9, 0]}}]);
    let scene = load_in(&folder, twice, json!({}));
    let both = instances(&scene);
    assert_eq!(both.len(), 1200);
    assert!(both.iter().all(|i| Arc::ptr_eq(i.mesh(), both[0].mesh())));
    assert_eq!(both[600].bounds().min - both[0].bounds().min, DVec3::Y * 9.0);
    assert_eq!(scene.shapes[0].material, scene.shapes[600].material);
    // With other materials it is another.
    let other =
        json!([{"gltf": {"file": "sheets.gltf"}}, {"gltf": {"file": "sheets.gltf", "override": {"stone": {"use": "m"}}}}]);
    let scene = load_in(&folder, other, json!({}));
    assert!(scene.shapes[0].material != scene.shapes[600].material);
    std::fs::remove_dir_all(&folder).unwrap();
}
