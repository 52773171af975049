//! Uniform light: whatever only bends it cannot be seen, and a closed box of diffuse light is the same everywhere.

use super::{all_bins, blocks, film};
use crate::film::Film;
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};
use std::f64::consts::PI;

pub(super) fn cases() -> Vec<Case> {
    let glass = |ior: Value, alpha: f64| json!({"dielectric": {"ior": ior, "alpha": alpha}});
    let ball = json!({"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"});
    let cube = json!({"box": {"min": [-0.8, -0.7, -0.6], "max": [0.7, 0.8, 0.9]}, "material": "glass"});
    let nested = json!([
        {"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "water"},
        {"sphere": {"center": [0.3, 0.3, 0], "radius": 0.6}, "material": "glass"},
        {"sphere": {"center": [0.1, 0, 0.2], "radius": 0.3}, "material": "bubble"},
    ]);
    let volumes = json!({
        "water": {"dielectric": {"ior": 1.33, "priority": 1}},
        "glass": {"dielectric": {"ior": 1.5, "priority": 2}},
        "bubble": {"dielectric": {"ior": 1, "priority": 3}},
    });
    let flint = json!({"cauchy": [1.6, 0.03]});
    vec![
        furnace("furnace-smooth", "smooth glass", json!({"glass": glass(json!(1.5), 0.0)}), json!([ball]), 16),
        furnace("furnace-dispersive", "dispersive glass with edges", json!({"glass": glass(flint, 0.0)}), json!([cube]), 256),
        furnace("furnace-rough", "rough glass", json!({"glass": glass(json!(1.5), 0.4)}), json!([ball]), 64),
        furnace("furnace-nested", "a bubble of air in glass in water", volumes, nested, 16),
        closed_box(),
        irradiance_in_closed_box(),
    ]
}

/// What is seen in uniform light of radiance 1: every bin of the film, and of its 16 blocks.
pub(super) fn furnace(id: &'static str, title: &'static str, materials: Value, shapes: Value, spp: u32) -> Case {
    let scene = json!({
        "film": film(16, 16, 4),
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2.2}},
        "max_depth": 2000,
        "materials": materials,
        "shapes": shapes,
        "lights": [{"constant": {"radiance": 1}}],
    });
    Case { id, title, views: vec![View::new(scene, spp)], rows: furnace_rows(id) }
}

/// Rows of a view that sees radiance 1 everywhere.
pub(super) fn furnace_rows(id: &str) -> Vec<Row> {
    vec![
        Row::new(format!("{id}/bins"), 1.0, 2e-3, |f: &[Film]| all_bins(&f[0])).floor(1e-3),
        Row::new(format!("{id}/blocks"), 1.0, 1e-2, |f: &[Film]| blocks(&f[0], 4, 1.0)).floor(1e-3),
    ]
}

/// A box whose walls reflect and emit one half.
fn box_of_light(camera: Value) -> Value {
    json!({
        "film": film(8, 8, 2),
        "camera": camera,
        "materials": {"wall": {"diffuse": {"reflectance": 0.5}}},
        "shapes": [{
            "box": {"min": [-1, -1, -1], "max": [1, 1, 1]},
            "material": "wall",
            "emission": {"radiance": 0.5, "two_sided": true},
        }],
    })
}

fn closed_box() -> Case {
    let camera = json!({"perspective": {"eye": [0.1, 0.1, 0.1], "target": [1, 0.3, -0.2], "vfov_deg": 80}});
    let row = Row::new("closed-box/radiance", 1.0, 1e-3, |f: &[Film]| all_bins(&f[0]));
    Case {
        id: "closed-box",
        title: "a closed box whose walls reflect and emit one half: radiance 1 everywhere",
        views: vec![View::new(box_of_light(camera), 256)],
        rows: vec![row.floor(1e-5)],
    }
}

fn irradiance_in_closed_box() -> Case {
    let camera = json!({"irradiance_sphere": {"center": [-0.02, 0.03, 0.04], "radius": 0.9}});
    let row = Row::new("closed-box-flux/total", PI, 3e-3, |f: &[Film]| all_bins(&f[0]));
    Case {
        id: "closed-box-flux",
        title: "irradiance on a sphere in that box: pi everywhere",
        views: vec![View::new(box_of_light(camera), 256)],
        rows: vec![row.floor(1e-5)],
    }
}
