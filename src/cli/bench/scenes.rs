//! The scenes that `abbe bench` has built in: what the speed of tracing and diffuse shading is measured on.

use crate::error::Result;
use crate::scene::{Geometry, LoadOptions, Mesh, Scene, Shape, load_str};
use glam::{DVec3, dvec3};
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
    Some(load_str(CORNELL_BOX, Path::new(name), Path::new("."), options).map(|mut scene| {
        scene.name = name.to_string();
        if name == "triangles_70k" {
            let geometry = Geometry::Mesh(Arc::new(wavy_ball(dvec3(0.0, 0.85, 0.0), 0.7, 250, 141)));
            scene.shapes.push(Shape { name: "ball".to_string(), geometry, material: 0, emission: None });
        }
        scene
    }))
}

/// A ball with ripples of a tenth of its radius, of `2 columns (rows - 1)` triangles.
fn wavy_ball(center: DVec3, radius: f64, columns: u32, rows: u32) -> Mesh {
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
