//! The scenes that `abbe bench` has built in: what the speed of tracing and diffuse shading is measured on.

use crate::error::Result;
use crate::scene::{Geometry, LoadOptions, Mesh, Scene, Shape, load_str};
use glam::{DVec3, dvec3};
use serde_json::Value;
use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

/// What they are called.
pub const NAMES: [&str; 2] = ["cornell_box", "triangles_70k"];

/// The walls of a Cornell box, and a lamp.
const CORNELL_BOX: &str = r#"{
  "film": {"width": 512, "height": 512},
  "camera": {"perspective": {"eye": [0, 1, 4.3], "target": [0, 1, 0], "vfov_deg": 32}},
  "materials": {
    "white": {"diffuse": {"reflectance": 0.75}},
    "red": {"diffuse": {"reflectance": [[580, 0.08], [620, 0.65]]}},
    "blue": {"diffuse": {"reflectance": [[470, 0.6], [520, 0.08]]}}
  },
  "shapes": [
    {"quad": {"corner": [-1, 0, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}, "material": "white"},
    {"quad": {"corner": [-1, 2, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2]}, "material": "white"},
    {"quad": {"corner": [-1, 0, -1], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0]}, "material": "white"},
    {"quad": {"corner": [-1, 0, 1], "edge_u": [0, 0, -2], "edge_v": [0, 2, 0]}, "material": "blue"},
    {"quad": {"corner": [1, 0, -1], "edge_u": [0, 0, 2], "edge_v": [0, 2, 0]}, "material": "red"},
    {"quad": {"corner": [-0.2, 1.99, -0.2], "edge_u": [0.4, 0, 0], "edge_v": [0, 0, 0.4]}, "emission": {"radiance": 15}}
  ]
}"#;

/// The built-in scene called `name`, if it is one.
pub fn built_in(name: &Path, options: &LoadOptions) -> Option<Result<Scene>> {
    let name = name.to_str().filter(|name| NAMES.contains(name))?;
    let scene = if name == "triangles_70k" { triangles(70_000, options) } else { cornell_box(&Value::Null, options) };
    Some(scene.map(|scene| Scene { name: name.to_string(), ..scene }))
}

/// The box with what `more` adds, as scene files have it: lists grow, objects are merged, all else is replaced.
pub fn cornell_box(more: &Value, options: &LoadOptions) -> Result<Scene> {
    // A constant, which a test loads.
    let mut scene = serde_json::from_str(CORNELL_BOX).unwrap_or_default();
    merge(&mut scene, more);
    load_str(&scene.to_string(), Path::new("cornell_box"), Path::new("."), options)
}

/// The box with a ball of about so many triangles.
pub fn triangles(count: u32, options: &LoadOptions) -> Result<Scene> {
    let rows = (f64::from(count) * 0.284).sqrt().round() as u32;
    let geometry = Geometry::Mesh(Arc::new(wavy_ball(dvec3(0.0, 0.85, 0.0), 0.7, count.div_ceil(2 * (rows - 1)), rows)));
    let mut scene = cornell_box(&Value::Null, options)?;
    scene.shapes.push(Shape { name: "ball".to_string(), geometry, material: 0, interior: None, emission: None });
    Ok(scene)
}

fn merge(into: &mut Value, more: &Value) {
    match (into, more) {
        (Value::Object(a), Value::Object(b)) => b.iter().for_each(|(key, value)| match a.get_mut(key) {
            Some(known) => merge(known, value),
            None => {
                a.insert(key.clone(), value.clone());
            }
        }),
        (Value::Array(a), Value::Array(b)) => a.extend(b.iter().cloned()),
        (_, Value::Null) => {}
        (a, b) => *a = b.clone(),
    }
}

/// A ball with ripples of a tenth of its radius, of `2 columns (rows - 1)` triangles.
pub fn wavy_ball(center: DVec3, radius: f64, columns: u32, rows: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..columns {
            let (theta, phi) = (PI * f64::from(row) / f64::from(rows), TAU * f64::from(column) / f64::from(columns));
            let r = radius * (1.0 + 0.1 * (9.0 * theta).sin() * (8.0 * phi).sin());
            mesh.positions.push(center + r * dvec3(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |row: u32, column: u32| row * columns + column % columns;
            let (a, b, c, d) = (at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1));
            if row > 0 {
                mesh.triangles.push([a, c, b]);
            }
            if row + 1 < rows {
                mesh.triangles.push([b, c, d]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenes_are_what_they_are_called() {
        let triangles = |name: &str| -> usize {
            let scene = built_in(Path::new(name), &LoadOptions::default()).unwrap().unwrap();
            scene.shapes.iter().map(|s| if let Geometry::Mesh(m) = &s.geometry { m.triangles.len() } else { 0 }).sum()
        };
        assert_eq!(NAMES.map(triangles), [12, 70_012]);
        assert!(built_in(Path::new("scenes/newton.json"), &LoadOptions::default()).is_none());
    }
}
