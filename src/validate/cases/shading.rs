//! Shading normals that contradict the geometry, and lose no light: in uniform light what is white or clear cannot be seen.

use super::uniform::{furnace, furnace_rows};
use super::{blocks, film};
use crate::film::Film;
use crate::scene::{Geometry, Mesh, Scene};
use crate::validate::{Case, Row, View};
use glam::{DVec3, dvec3};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::sync::Arc;

/// How far the normals of the tiles lean to the right, degrees.
const LEAN_DEG: [f64; 4] = [30.0, 50.0, 65.0, -65.0];
/// Where the tiles are seen from: so far to the right, degrees. The last of them is seen from behind its normal.
const VIEW_DEG: f64 = 40.0;

pub(super) fn cases() -> Vec<Case> {
    let glass = json!({"dielectric": {"ior": 1.5}});
    let mirror = |roughness: f64| json!({"conductor": {"reflectance": 1, "roughness": roughness}});
    let clear = "clear glass shaded smooth, in uniform light";
    vec![
        tiles("leaning-mirror", "white mirrors whose normals lean, in uniform light", mirror(0.0), 1),
        tiles("leaning-metal", "the same, rough", mirror(0.6), 48),
        tiles("leaning-paint", "white paint whose normals lean, in uniform light", json!({"diffuse": {"reflectance": 1}}), 32),
        tiles("leaning-pane", "panes whose normals lean, in uniform light", json!({"thin_dielectric": {"ior": 2}}), 1),
        smooth("smooth-cube", clear, &glass, cube, 16),
        smooth("smooth-ball", clear, &glass, ball, 16),
        smooth(
            "smooth-rough-ball",
            "rough glass shaded smooth, in uniform light",
            &json!({"dielectric": {"ior": 1.5, "roughness": 0.5}}),
            ball,
            96,
        ),
        smooth("smooth-mirror", "a coarse white mirror shaded round, in uniform light", &mirror(0.0), ball, 16),
        paint_under_the_sun(),
    ]
}

/// In place of the first shape a square of four tiles, side by side, each of them a fourth of the picture.
fn lay_tiles(scene: &mut Scene) {
    let width = 0.25 / VIEW_DEG.to_radians().cos();
    let mut mesh = Mesh::default();
    for (i, lean) in LEAN_DEG.iter().enumerate() {
        let (at, x) = (4 * i as u32, (i as f64 - 2.0) * width);
        mesh.positions.extend([dvec3(x, -1.0, 0.0), dvec3(x + width, -1.0, 0.0), dvec3(x + width, 1.0, 0.0), dvec3(x, 1.0, 0.0)]);
        mesh.normals.extend([dvec3(lean.to_radians().sin(), 0.0, lean.to_radians().cos()); 4]);
        mesh.triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
    }
    scene.shapes[0].geometry = Geometry::Mesh(Arc::new(mesh));
}

/// The tiles in this light.
fn view_of_tiles(material: Value, light: Value, spp: u32) -> View {
    let (sin, cos) = VIEW_DEG.to_radians().sin_cos();
    let scene = json!({
        "film": film(8, 8, 4),
        "camera": {"orthographic": {"eye": [5.0 * sin, 0, 5.0 * cos], "target": [0, 0, 0], "height": 1}},
        "materials": {"tile": material},
        "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "tile"}],
        "lights": [light],
    });
    View { change: Some(lay_tiles), ..View::new(scene, spp) }
}

/// A row for each tile.
fn rows_of_tiles(id: &str, exact: impl Fn(f64) -> f64) -> Vec<Row> {
    let row = |(i, &lean): (usize, &f64)| {
        let measure = move |f: &[Film]| blocks(&f[0], 2, 1.0).chunks(4).skip(i).step_by(4).flatten().copied().collect();
        Row::new(format!("{id}/{lean}"), exact(lean), 1e-2 * exact(lean), measure).floor(1e-3)
    };
    LEAN_DEG.iter().enumerate().map(row).collect()
}

fn tiles(id: &'static str, title: &'static str, material: Value, spp: u32) -> Case {
    let views = vec![view_of_tiles(material, json!({"constant": {"radiance": 1}}), spp)];
    Case { id, title, views, rows: rows_of_tiles(id, |_| 1.0) }
}

/// Grazing light, of which the surface throws on the facets what it does not show them: by the formula of [`crate::bsdf::facet`].
fn paint_under_the_sun() -> Case {
    let height = 10f64.to_radians();
    let light = json!({"sun": {"direction": [-height.cos(), 0, -height.sin()], "angle_deg": 0, "irradiance": PI}});
    let exact = move |lean: f64| {
        let cos = |side: f64| (height.cos() * lean.to_radians().sin() + side * height.sin() * lean.to_radians().cos()).max(0.0);
        0.5 * (cos(1.0) + cos(-1.0))
    };
    Case {
        id: "leaning-paint-sun",
        title: "paint whose normals lean, in grazing light",
        views: vec![view_of_tiles(json!({"diffuse": {"reflectance": 0.5}}), light, 256)],
        rows: rows_of_tiles("leaning-paint-sun", exact),
    }
}

/// What `shape` puts in place of a ball, seen from a corner.
fn smooth(id: &'static str, title: &'static str, material: &Value, shape: fn(&mut Scene), spp: u32) -> Case {
    let shapes = json!([{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]);
    let mut case = furnace(id, title, json!({"m": material}), shapes, spp);
    case.views[0].scene["camera"]["orthographic"]["eye"] = json!([3, 2, 4]);
    case.views[0].change = Some(shape);
    case.rows = furnace_rows(id);
    case
}

/// Puts a mesh in place of the first shape, its normals away from its middle.
fn shade_round(scene: &mut Scene, positions: Vec<DVec3>, quads: impl Iterator<Item = [u32; 4]>) {
    let mut mesh = Mesh { normals: positions.iter().map(|p| p.normalize()).collect(), positions, ..Mesh::default() };
    mesh.triangles =
        quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).filter(|[a, b, c]| a != b && b != c && a != c).collect();
    scene.shapes[0].geometry = Geometry::Mesh(Arc::new(mesh));
}

/// Eight vertices.
fn cube(scene: &mut Scene) {
    let corner = |i: u32| DVec3::from([4, 2, 1].map(|bit| if i & bit != 0 { 0.6 } else { -0.6 }));
    let faces = [[1, 5, 7, 3], [0, 2, 6, 4], [4, 6, 7, 5], [0, 1, 3, 2], [2, 3, 7, 6], [0, 4, 5, 1]];
    shade_round(scene, (0..8).map(corner).collect(), faces.into_iter());
}

/// Sixteen meridians and eight bands of latitude.
fn ball(scene: &mut Scene) {
    let vertex = |i: u32| {
        let (theta, phi) = (PI * f64::from(i / 16) / 8.0, 2.0 * PI * f64::from(i % 16) / 16.0);
        dvec3(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin())
    };
    // All of a pole's vertices are its first.
    let at = |band: u32, meridian: u32| 16 * band + if band.is_multiple_of(8) { 0 } else { meridian % 16 };
    let quads = (0..128).map(|i| (i / 16, i % 16)).map(|(b, m)| [at(b, m), at(b + 1, m), at(b + 1, m + 1), at(b, m + 1)]);
    shade_round(scene, (0..144).map(vertex).collect(), quads);
}
