//! Brushed metal: how scenes and glTF files say so, and where its grain points.

use crate::gltf::{base64, document, load_document};
use crate::{load_text, scene_with};
use abbe::scene::{Geometry, Grain, Material, Mesh, Scene, direction_of_grain};
use glam::{DVec3, DVec4, dvec3};
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;

fn scene(metal: &str) -> abbe::Result<Scene> {
    load_text(&scene_with("materials", &format!(r#"{{"m": {{"conductor": {metal}}}}}"#)))
}

#[test]
fn a_scene_says_how_its_metal_is_brushed() {
    let s = scene(r#"{"metal": "Al", "alpha": 0.2, "anisotropy": {"strength": 0.5, "rotation_deg": 90}}"#).unwrap();
    assert_eq!(s.grains[&0], Grain { strength: 0.5, rotation: FRAC_PI_2 });
    let width = s.grains[&0].width(0.2);
    assert!((width.x - 0.4).abs() < 1e-12 && width.y == 0.2, "{width:?}");
    // Every level of a picture of roughness, of which none is smooth.
    let pictured = json!({
        "film": {"width": 8, "height": 8},
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}},
        "materials": {"m": {"conductor": {"metal": "Al", "roughness": {"texture": "sky.png"}, "anisotropy": {"strength": 0.5}}}},
        "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "m"}]});
    let s = load_text(&pictured.to_string()).unwrap();
    let Material::Graded { materials, .. } = &s.materials[0] else { panic!("one width") };
    for &i in materials {
        let Material::Conductor { alpha, .. } = s.materials[i] else { panic!("no metal") };
        assert!(alpha >= 1e-3 && s.grains.contains_key(&i), "{alpha}");
    }
    assert!(scene(r#"{"metal": "Al", "alpha": 0.2, "anisotropy": {"strength": 0}}"#).unwrap().grains.is_empty());
    for (bad, says) in [
        (r#"{"metal": "Al", "anisotropy": {"strength": 0.5}}"#, "a smooth surface has no grain"),
        (r#"{"metal": "Al", "alpha": 0.2, "anisotropy": {"strength": 1.5}}"#, "anisotropy.strength"),
        (r#"{"metal": "Al", "alpha": 0.2, "anisotropy": {}}"#, "strength"),
    ] {
        let error = scene(bad).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// A square with texture coordinates, and tangents where they are given.
fn square(metallic: f64, anisotropy: Value, tangent: Option<[f32; 4]>) -> Scene {
    let mut d = document();
    let positions = [0.0f32, 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    // u grows along +y, v along -x: the picture is seen mirrored.
    let uvs = [0.0f32, 1., 0., 0., 1., 0., 1., 1.];
    let normals = [0.0f32, 0., 1.].repeat(4);
    let all = [positions.to_vec(), uvs.to_vec(), normals, tangent.unwrap_or([0.0; 4]).repeat(4)];
    let mut bytes: Vec<u8> = all.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend([0u8, 1, 2, 0, 2, 3]);
    d["buffers"][0] =
        json!({"byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes))});
    let view = |at: usize, length: usize| json!({"buffer": 0, "byteOffset": at, "byteLength": length});
    d["bufferViews"] = json!([view(0, 48), view(192, 6), view(48, 32), view(80, 48), view(128, 64)]);
    let accessor = |view: u32, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": kind});
    d["accessors"] = json!([
        accessor(0, "VEC3"),
        {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"},
        accessor(2, "VEC2"),
        accessor(3, "VEC3"),
        accessor(4, "VEC4")]);
    let mut attributes = json!({"POSITION": 0, "TEXCOORD_0": 2, "NORMAL": 3});
    if tangent.is_some() {
        attributes["TANGENT"] = json!(4);
    }
    d["meshes"][0]["primitives"][0]["attributes"] = attributes;
    d["nodes"][1]["scale"] = json!([2, 2, 2]);
    d["materials"] = json!([{
        "pbrMetallicRoughness": {"metallicFactor": metallic, "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_anisotropy": anisotropy}}]);
    load_document("brushed", &d).unwrap_or_else(|e| panic!("{e}"))
}

fn mesh(s: &Scene) -> &Mesh {
    let Geometry::Mesh(mesh) = &s.shapes[0].geometry else { panic!("not a mesh") };
    mesh
}

#[test]
fn a_gltf_file_says_how_its_metal_is_brushed_and_where_its_tangents_point() {
    let brushed = json!({"anisotropyStrength": 0.5, "anisotropyRotation": 0.3});
    let s = square(1.0, brushed.clone(), Some([0.6, 0.8, 0.0, -1.0]));
    assert_eq!(s.notes, Vec::<String>::new());
    assert_eq!(s.grains[&s.shapes[0].material], Grain { strength: 0.5, rotation: 0.3 });
    let tangent = mesh(&s).tangent(0, dvec3(0.7, 0.4, -1.0));
    assert!((tangent - DVec4::new(0.6, 0.8, 0.0, -1.0)).length() < 1e-6, "{tangent}");
    // Without tangents, those of the texture coordinates.
    let s = square(1.0, brushed.clone(), None);
    assert_eq!(mesh(&s).tangents, [DVec4::new(0.0, 1.0, 0.0, -1.0); 4]);
    // What has no grain has no tangents either.
    let s = square(1.0, json!({"anisotropyRotation": 0.3}), Some([1.0, 0.0, 0.0, 1.0]));
    assert!(s.grains.is_empty() && mesh(&s).tangents.is_empty());
    let s = square(0.5, brushed, None);
    assert!(s.notes.iter().any(|n| n.contains("anisotropy of gloss on paint")), "{:?}", s.notes);
    assert_eq!(s.grains.len(), 1);
}

#[test]
fn a_grain_turns_counter_clockwise_as_seen_from_outside() {
    let points = |tangent: DVec4, ns: DVec3, along: DVec3| {
        let d = direction_of_grain(&Grain { strength: 1.0, rotation: FRAC_PI_2 }, ns, tangent);
        assert!((d - along).length() < 1e-12, "{d} instead of {along}");
    };
    points(DVec4::new(1.0, 0.0, 0.0, 1.0), DVec3::Z, DVec3::Y);
    // Where the picture is mirrored so is the turn.
    points(DVec4::new(1.0, 0.0, 0.0, -1.0), DVec3::Z, -DVec3::Y);
    // Without tangents from the level.
    points(DVec4::W, DVec3::Z, DVec3::Y);
    points(DVec4::W, DVec3::Y, DVec3::Y.cross(DVec3::Z.cross(DVec3::Y)));
}
