//! Hard cases: where rounding, degenerate geometry or long paths would show.

use super::uniform::{furnace, furnace_rows};
use super::{LINES, all_bins, film, film_of_lines, landing, lines, mean, measuring};
use crate::film::Film;
use crate::integrator::Techniques;
use crate::scene::{Geometry, Mesh, Scene, read_mesh};
use crate::spectrum::library;
use crate::validate::optics::{Ray2, prism_tilt};
use crate::validate::{Case, Row, View};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

pub(super) fn cases() -> Vec<Case> {
    let glass = json!({"glass": {"dielectric": {"ior": 1.5}}});
    let ball = |radius: f64| json!([{"sphere": {"center": [0, 0, 0], "radius": radius}, "material": "glass"}]);
    vec![
        matched(),
        contact(),
        bubble(),
        seen_by(
            "tangent",
            "rays that graze a ball, within 1e-4 radii of its rim, in uniform light",
            json!({"orthographic": {"eye": [1, 0, 5], "target": [1, 0, 0], "height": 2e-4}}),
            &glass,
            ball(1.0),
        ),
        seen_by(
            "tiny-far",
            "a ball of glass 1e-3 m across seen from 100 m in uniform light",
            json!({"perspective": {"eye": [0, 0, 100], "target": [0, 0, 0], "vfov_deg": 6e-4}}),
            &glass,
            ball(5e-4),
        ),
        seen_by(
            "wide",
            "a ball of glass 1e4 m across in uniform light",
            json!({"orthographic": {"eye": [0, 0, 2e4], "target": [0, 0, 0], "height": 1.1e4}}),
            &glass,
            ball(5e3),
        ),
        cube(),
        fibre(),
        diamond(),
        three_prisms(),
        degenerate(),
        many_samples(),
    ]
}

/// The furnace with another camera.
fn seen_by(id: &'static str, title: &'static str, camera: Value, materials: &Value, shapes: Value) -> Case {
    let mut case = furnace(id, title, materials.clone(), shapes, 16);
    case.views[0].scene["camera"] = camera;
    case
}

fn matched() -> Case {
    let block = json!({"box": {"min": [-5, -5, -1], "max": [5, 5, 1]}, "material": "glass", "transform": {"axis": [1, 1, 0], "rotate_deg": 70}});
    let scene = json!({
        "film": film(8, 8, 4),
        "camera": {"orthographic": {"eye": [0, 0, 9], "target": [0, 0, 0], "height": 1}},
        "surroundings": {"ior": "N-BK7"},
        "materials": {"glass": {"dielectric": {"ior": "N-BK7"}}},
        "shapes": [block, {"disc": {"center": [0, 0, -9], "normal": [0, 0, 1], "radius": 0.8}, "emission": {"radiance": 1}}],
    });
    Case {
        id: "matched",
        title: "a lamp through a tilted block of the index of what surrounds it: radiance of the lamp, straight through",
        views: vec![View::new(scene, 16)],
        rows: vec![Row::new("matched/radiance", 1.0, 0.0, |f: &[Film]| blocks_of_bins(&f[0])).floor(1e-6)],
    }
}

/// Every bin of every pixel.
fn blocks_of_bins(film: &Film) -> Vec<f64> {
    super::blocks(film, 1, 1.0)
}

fn contact() -> Case {
    let half = |z0: f64, z1: f64, material: &str| json!({"box": {"min": [-9, -9, z0], "max": [9, 9, z1]}, "material": material});
    let scene = json!({
        "film": film(8, 8, 1),
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 1}},
        "materials": {"front": {"dielectric": {"ior": 1.5168}}, "back": {"dielectric": {"ior": 1.5168, "priority": 2}}},
        "shapes": [
            half(0.0, 0.4, "back"),
            half(0.4, 1.0, "front"),
            {"disc": {"center": [0, 0, -2], "normal": [0, 0, 1], "radius": 8}, "emission": {"radiance": 1}},
        ],
    });
    Case {
        id: "contact",
        title: "two slabs of one index with a face in common are one slab",
        views: vec![View::new(scene, 64)],
        rows: vec![Row::new("contact/radiance", 0.919083, 1e-3, |f: &[Film]| vec![mean(&f[0])]).floor(1e-6)],
    }
}

/// Water fills a beaker to its walls, with a bubble in it.
fn bubble() -> Case {
    let can = |radius: f64, y0: f64, y1: f64, material: &str| json!({"cylinder": {"base": [0, y0, 0], "top": [0, y1, 0], "radius": radius, "capped": true}, "material": material});
    let materials = json!({
        "glass": {"dielectric": {"ior": 1.5, "priority": 1}},
        "water": {"dielectric": {"ior": 1.33, "priority": 2}},
        "air": {"dielectric": {"ior": 1, "priority": 3}},
    });
    let shapes = json!([
        can(1.0, -1.0, 1.0, "glass"),
        can(0.9, -0.9, 0.6, "water"),
        can(0.9, 0.6, 1.0, "air"),
        {"sphere": {"center": [0.2, -0.1, 0.1], "radius": 0.3}, "material": "air"},
    ]);
    furnace("bubble", "a bubble in water in a beaker of glass, in uniform light", materials, shapes, 64)
}

/// A view of light that total reflection keeps in, by camera paths alone: light paths would stay in for ever. One path at a time, since lavapipe bounds
/// the turns of a shader's loops.
fn trapped(scene: Value) -> View {
    let techniques = Techniques { light_paths: false, merging: false, ..Techniques::default() };
    View { scales: false, techniques, ..View::new(scene, 1) }
}

/// Light that total reflection keeps in a cube until it meets a small lamp, after 220 reflections in the mean: a path in a hundred takes more than
/// 1,000.
fn cube() -> Case {
    let scene = json!({
        "film": film(4, 4, 2),
        "camera": {"perspective": {"eye": [0.2, 0.3, 0.1], "target": [1.2, 1.25, 1.1], "vfov_deg": 10}},
        "max_depth": 100000,
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "material": "glass"},
            {"sphere": {"center": [0.55, 0.62, 0.47], "radius": 0.05}, "emission": {"radiance": 1}},
        ],
    });
    Case {
        id: "cube",
        title: "a lamp in a cube of glass, by 220 total reflections in the mean, some by thousands: its radiance",
        views: vec![trapped(scene)],
        rows: vec![Row::new("cube/radiance", 1.0, 1e-4, |f: &[Film]| all_bins(&f[0])).floor(1e-4)],
    }
}

fn fibre() -> Case {
    let scene = json!({
        "film": film(8, 8, 2),
        "camera": {"perspective": {"eye": [0.01, 0, 0], "target": [1.01, 0.7, 0.1], "vfov_deg": 5}},
        "max_depth": 100000,
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"cylinder": {"base": [0, 0, 0], "top": [3, 0, 0], "radius": 0.001, "capped": true}, "material": "glass"},
            {"disc": {"center": [2.99, 0, 0], "normal": [-1, 0, 0], "radius": 0.002}, "emission": {"radiance": 1}},
        ],
    });
    Case {
        id: "fibre",
        title: "a lamp at the end of a fibre of 2 mm and 3 m, by more than 1,000 total reflections: its radiance",
        views: vec![trapped(scene)],
        rows: vec![Row::new("fibre/radiance", 1.0, 1e-4, |f: &[Film]| all_bins(&f[0])).floor(1e-4)],
    }
}

/// Puts the diamond that ships in place of the first shape.
fn cut_diamond(scene: &mut Scene) {
    let ply = include_bytes!("../../../scenes/diamond.ply");
    if let Ok(mesh) = read_mesh(Path::new("diamond.ply"), ply) {
        scene.shapes[0].geometry = Geometry::Mesh(Arc::new(mesh));
    }
}

fn diamond() -> Case {
    let materials = json!({"glass": {"dielectric": {"ior": "diamond"}}});
    let stone = json!([{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"}]);
    let mut case = furnace("diamond", "a brilliant-cut diamond in uniform light", materials, stone, 144);
    case.views[0].change = Some(cut_diamond);
    case.views[0].scene["camera"] = json!({"orthographic": {"eye": [2, 4, 3], "target": [0, 0, 0], "height": 1.1}});
    case
}

/// A white pencil through three prisms, one after the other, each at minimum deviation for d.
fn three_prisms() -> Case {
    const FAR: f64 = 20.0;
    let n = LINES.map(|(_, nm)| library::glass("N-BK7").map_or(f64::NAN, |ior| ior.eval(nm)));
    let tilt = prism_tilt(n[1]);
    let (mut shapes, mut faces) = (Vec::new(), Vec::new());
    // Where the d ray enters each prism, turned by what it was deviated before.
    let (mut at, mut turned) = ([0.0, 0.0], 0.0f64);
    for _ in 0..3 {
        let rotate = |v: [f64; 2]| [v[0] * turned.cos() + v[1] * turned.sin(), v[1] * turned.cos() - v[0] * turned.sin()];
        let add = |a: [f64; 2], v: [f64; 2]| [a[0] + v[0], a[1] + v[1]];
        // In its own frame the d ray passes along +x, from the middle of one side to that of the other.
        let half = 0.5 * 0.75f64.sqrt();
        let corner = add(at, rotate([0.25, -half]));
        let (sin, cos) = (0.5, 0.75f64.sqrt());
        let out = add(at, rotate([0.5, 0.0]));
        faces.push((at, rotate([-cos, sin]), true));
        faces.push((out, rotate([-cos, -sin]), false));
        shapes.push(json!({
            "prism": {"polygon": [[-0.5, 0], [0.5, 0], [0, 0.75f64.sqrt()]], "length": 1},
            "material": "glass",
            "transform": {"axis": [0, 0, 1], "rotate_deg": -turned.to_degrees(), "translate": [corner[0], corner[1], 0]},
        }));
        // Half of the deviation behind it, half before the next.
        let leaving = turned + tilt;
        at = add(out, [leaving.cos(), -leaving.sin()]);
        turned += 2.0 * tilt;
    }
    let start = Ray2 { at: [-tilt.cos(), -tilt.sin()], along: [tilt.cos(), tilt.sin()] };
    let through = |n: f64| {
        let cross = |ray: Ray2, (point, normal, enters): &([f64; 2], [f64; 2], bool)| {
            ray.refracted_at(*point, *normal, if *enters { n } else { 1.0 / n })
        };
        faces.iter().fold(start, cross)
    };
    let rays = n.map(through);
    // A sensor across the way of d; its columns run to the left of it.
    let d = rays[1];
    let left = [-d.along[1], d.along[0]];
    let middle = [0, 1].map(|a| d.at[a] + FAR * d.along[a]);
    let lands = rays.map(|ray| {
        let to = [middle[0] - ray.at[0], middle[1] - ray.at[1]];
        let t = (to[0] * d.along[0] + to[1] * d.along[1]) / (ray.along[0] * d.along[0] + ray.along[1] * d.along[1]);
        (0..2).map(|a| (ray.at[a] + t * ray.along[a] - middle[a]) * left[a]).sum::<f64>()
    });
    let width = 3.0 * lands[0].abs();
    let corner = [0, 1].map(|a| middle[a] - 0.5 * width * left[a]);
    let scene = json!({
        "film": film_of_lines(1024, 1),
        "camera": {"irradiance_plane": {
            "origin": [corner[0], corner[1], 0.5], "edge_u": [width * left[0], width * left[1], 0], "edge_v": [0, 0, -1],
        }},
        "max_depth": 6,
        "materials": {"glass": {"dielectric": {"ior": "N-BK7"}}},
        "shapes": shapes,
        "lights": [{"beam": {
            "origin": [start.at[0], start.at[1], 0], "direction": [start.along[0], start.along[1], 0],
            "radius": 0.002, "irradiance": lines(&LINES.map(|(_, nm)| nm)),
        }}],
    });
    let row = |line: usize| {
        Row::new(format!("three-prisms/{}", LINES[line].0), lands[line], 2e-5, move |f: &[Film]| {
            vec![width * (landing(&f[0], line, 0, f[0].pixels()) - 0.5)]
        })
        .floor(2e-5)
    };
    Case {
        id: "three-prisms",
        title: "where light lands, m, 20 m behind three prisms of N-BK7 in a row",
        views: vec![measuring(scene, 8, 4.0)],
        rows: (0..3).map(row).collect(),
    }
}

/// Adds to the first shape, a mesh, what no mesh should have: triangles of no area and thin as needles, and normals of no length.
fn spoil(scene: &mut Scene) {
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { return };
    let mut mesh = Mesh { normals: vec![DVec3::ZERO; mesh.positions.len()], ..(**mesh).clone() };
    // A face is replaced by a fan of needles around a point very close to one of its edges.
    let [a, b, c] = mesh.triangles.swap_remove(0);
    let [pa, pb, pc] = [a, b, c].map(|i| mesh.positions[i as usize]);
    let near = mesh.positions.len() as u32;
    mesh.positions.push(pa.lerp(pb, 0.3) + (pc - pa) * 1e-7);
    mesh.normals.push(DVec3::ZERO);
    mesh.triangles.extend([[a, b, near], [b, c, near], [c, a, near]]);
    // No area: a point, a doubled edge, three points in a line.
    mesh.triangles.extend([[a, a, a], [a, b, a], [a, near, near]]);
    let middle = mesh.positions.len() as u32;
    mesh.positions.push(pb.lerp(pc, 0.5));
    mesh.normals.push(DVec3::ZERO);
    mesh.triangles.push([b, middle, c]);
    scene.shapes[0].geometry = Geometry::Mesh(Arc::new(mesh));
}

fn degenerate() -> Case {
    let materials = json!({"glass": {"dielectric": {"ior": 1.5}}});
    let shapes = json!([{
        "box": {"min": [-0.8, -0.7, -0.6], "max": [0.7, 0.8, 0.9]},
        "material": "glass",
        "transform": {"axis": [1, 2, 3], "rotate_deg": 40},
    }]);
    let id = "degenerate";
    let mut case = furnace(
        id,
        "needles, triangles of no area and normals of no length in a block of glass, in uniform light",
        materials,
        shapes,
        16,
    );
    case.views[0].change = Some(spoil);
    case.rows = furnace_rows(id);
    case
}

/// So many samples in one pixel that sums in single precision lose digits; 2^24, at which they would stall, at a budget of 64.
fn many_samples() -> Case {
    let scene = json!({
        "film": film(1, 1, 1),
        "camera": {"orthographic": {"eye": [0, 0, 1], "target": [0, 0, 0], "height": 1}},
        "lights": [{"constant": {"radiance": 0.3}}],
    });
    Case {
        id: "many-samples",
        title: "2^18 samples of radiance 0.3 in one pixel for each unit of budget",
        views: vec![View::new(scene, (1 << 18) / 24 + 1)],
        rows: vec![Row::new("many-samples/radiance", 0.3, 1e-6, |f: &[Film]| vec![mean(&f[0])]).floor(1e-6)],
    }
}
