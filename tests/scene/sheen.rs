//! Sheen: how scenes and glTF files say what has it.

use crate::gltf::{document, load_document};
use crate::{load_text, scene_with};
use abbe::scene::{Material, Scene};
use serde_json::{Value, json};

fn scene(materials: &str) -> abbe::Result<Scene> {
    load_text(&scene_with("materials", materials))
}

#[test]
fn a_scene_says_what_has_sheen() {
    let s = scene(
        r#"{"m": {"sheen": {"of": "felt", "color": [[400, 0.2], [700, 0.8]], "roughness": 0.5}}, "felt": {"diffuse": {"reflectance": 0.3}}}"#,
    );
    let s = s.unwrap();
    let Material::Sheen { base, color, alpha } = &s.materials[0] else { panic!("no sheen") };
    assert!(*base == 1 && *alpha == 0.25 && (color.eval(550.0) - 0.5).abs() < 1e-12);
    // The narrowest that there is.
    let s = scene(
        r#"{"m": {"sheen": {"of": "n", "color": 1}}, "n": {"coated": {"of": "p", "ior": 1.5}}, "p": {"diffuse": {"reflectance": 0.3}}}"#,
    );
    assert!(matches!(s.unwrap().materials[0], Material::Sheen { base: 1, alpha: 0.005, .. }));
    for (bad, says) in [
        (r#"{"m": {"sheen": {"of": "g", "color": 1}}, "g": {"dielectric": {"ior": 1.5}}}"#, "sheen lies on paint, metal"),
        (r#"{"m": {"sheen": {"of": "m", "color": 1}}}"#, "contain each other"),
        (
            r#"{"m": {"coated": {"of": "n", "ior": 1.5}}, "n": {"sheen": {"of": "p", "color": 1}}, "p": {"diffuse": {"reflectance": 0.3}}}"#,
            "a coat lies on",
        ),
        (r#"{"m": {"sheen": {"of": "p", "color": 2}}, "p": {"diffuse": {"reflectance": 0.3}}}"#, "color"),
    ] {
        let error = scene(bad).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

fn gltf(pbr: Value, extensions: Value) -> Scene {
    let mut d = document();
    d["materials"] = json!([{"pbrMetallicRoughness": pbr, "extensions": extensions}]);
    load_document("sheen", &d).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn sheen_of_a_gltf_file_lies_over_all_but_glass() {
    let sheen =
        |color: f64| json!({"KHR_materials_sheen": {"sheenColorFactor": [color, color, color], "sheenRoughnessFactor": 0.6}});
    let s = gltf(json!({"metallicFactor": 0, "roughnessFactor": 0.5}), sheen(0.5));
    assert_eq!(s.notes, Vec::<String>::new());
    let Material::Sheen { base, color, alpha } = &s.materials[s.shapes[0].material] else { panic!("no sheen") };
    assert!((*alpha - 0.36).abs() < 1e-12 && (color.eval(500.0) - 0.5).abs() < 1e-3);
    assert!(matches!(s.materials[*base], Material::Coated { .. }));
    let s = gltf(json!({"metallicFactor": 1, "roughnessFactor": 0.5}), sheen(0.5));
    let Material::Sheen { base, .. } = s.materials[s.shapes[0].material] else { panic!("no sheen") };
    assert!(matches!(s.materials[base], Material::ColoredConductor { .. }));
    // Without colour there is none, and what is under it is what it would be.
    let s = gltf(json!({"metallicFactor": 0, "roughnessFactor": 0.5}), sheen(0.0));
    assert!(matches!(s.materials[s.shapes[0].material], Material::Coated { .. }));
    let mut glass = sheen(0.5);
    glass["KHR_materials_transmission"] = json!({"transmissionFactor": 1});
    glass["KHR_materials_volume"] = json!({"thicknessFactor": 1});
    let s = gltf(json!({"metallicFactor": 0, "roughnessFactor": 0}), glass);
    assert!(s.notes.iter().any(|n| n.contains("sheen on glass")), "{:?}", s.notes);
}
