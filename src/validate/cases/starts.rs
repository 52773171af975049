//! Sensors and lamps that reach across the boundary of a volume, and such as lie in a surface.

use super::{film, mean, measuring};
use crate::film::Film;
use crate::integrator::Techniques;
use crate::validate::{Case, Row, View};
use glam::{DMat3, dvec3};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::ops::Range;

pub(super) fn cases() -> Vec<Case> {
    vec![across(), lamp_across(), sensor_touching(), lamp_touching()]
}

/// Of index 1, absorbing.
fn absorber(per_metre: f64, priority: u32) -> Value {
    json!({"dielectric": {"ior": 1, "absorption": per_metre, "priority": priority}})
}

/// A scene with other values for some keys, lists being gone on with.
fn with(mut scene: Value, rest: Value) -> Value {
    for (key, value) in rest.as_object().into_iter().flatten() {
        match (scene[key].as_array_mut(), value.as_array()) {
            (Some(all), Some(more)) => all.extend_from_slice(more),
            _ => scene[key] = value.clone(),
        }
    }
    scene
}

/// Half of space from z = -1 to 1, absorbing 1 per metre; within it a smaller one absorbs 2 per metre.
fn half_space(camera: Value, rest: Value) -> Value {
    let scene = json!({
        "film": film(8, 8, 1),
        "camera": camera,
        "materials": {"a": absorber(1.0, 1), "b": absorber(2.0, 2)},
        "shapes": [
            {"box": {"min": [-200, -200, -1], "max": [0, 200, 1]}, "material": "a"},
            {"box": {"min": [-0.5, -100, -0.5], "max": [0, 100, 0.5]}, "material": "b"},
        ],
    });
    with(scene, rest)
}

fn sky() -> Value {
    json!({"lights": [{"constant": {"radiance": 1}}]})
}

/// Mean of some of 8 columns, or of rows.
fn columns(film: &Film, which: Range<usize>) -> f64 {
    let count = 8.0 * which.len() as f64;
    which.flat_map(|x| (0..8).map(move |y| film.bin(8 * y + x, 0))).sum::<f64>() / count
}

fn rows(film: &Film, which: Range<usize>) -> f64 {
    let count = 8.0 * which.len() as f64;
    which.flat_map(|y| (0..8).map(move |x| film.bin(8 * y + x, 0))).sum::<f64>() / count
}

fn across() -> Case {
    let plane = |z: f64| json!({"irradiance_plane": {"origin": [-1, -1, z], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0]}});
    let beam = |z: f64| json!({"reference": "forward", "lights": [{"beam": {"origin": [0, 0, z], "direction": [0, 0, -1], "radius": 2, "irradiance": 1}}]});
    let view_plane = json!({"orthographic": {"eye": [0, 0, 0], "target": [0, 0, -1], "height": 2}});
    let lens = json!({"perspective": {
        "eye": [0, 0, 0.75], "target": [0, 0, -10], "vfov_deg": 1e-4, "aperture_radius": 0.4, "focus_distance": 1e5,
    }});
    // Half of the plane is below the level of open water.
    let sheet = json!({
        "film": film(8, 8, 1),
        "camera": {"orthographic": {"eye": [0, 0, 0], "target": [0, 0.6, -0.8], "height": 2}},
        "materials": {"water": absorber(1.0, 1)},
        "shapes": [{"disc": {"center": [0, 0, 0], "normal": [0, 1, 0], "radius": 1000}, "material": "water"}],
        "lights": [{"constant": {"radiance": 1}}],
    });
    let views = vec![
        View::new(half_space(view_plane, sky()), 16),
        View::new(half_space(lens, sky()), 256),
        View::new(sheet, 64),
        View::new(half_space(plane(0.75), beam(3.0)), 16),
        measuring(half_space(plane(-2.0), beam(0.75)), 16, 4.0),
    ];
    let row = |name: &str, exact: f64, measure: fn(&[Film]) -> f64| {
        Row::new(format!("starts/{name}"), exact, 3e-3, move |f: &[Film]| vec![measure(f)]).floor(1e-5)
    };
    let way: f64 = 0.8 / 0.6;
    Case {
        id: "starts",
        title: "half in an absorber: radiance on a view plane, through a lens, across the level of water; irradiance by a beam",
        views,
        rows: vec![
            row("view-plane/outer", (-1.0f64).exp(), |f| columns(&f[0], 0..2)),
            row("view-plane/inner", (-1.5f64).exp(), |f| columns(&f[0], 2..4)),
            row("view-plane/outside", 1.0, |f| columns(&f[0], 4..8)),
            row("lens", 0.5 * (1.0 + (-2.75f64).exp()), |f| mean(&f[1])),
            row("water/below", (1.0 - (-way).exp()) / way, |f| rows(&f[2], 4..8)),
            row("water/above", 1.0, |f| rows(&f[2], 0..4)),
            row("irradiance/inside", (-0.25f64).exp(), |f| columns(&f[3], 0..4)),
            row("irradiance/outside", 1.0, |f| columns(&f[3], 4..8)),
            row("beam/outer", (-1.75f64).exp(), |f| columns(&f[4], 0..2)),
            row("beam/inner", (-2.75f64).exp(), |f| columns(&f[4], 2..4)),
            row("beam/outside", 1.0, |f| columns(&f[4], 4..8)),
        ],
    }
}

/// Irradiance of a square of 2 m at z = -2 by a square lamp of 1.8 m at z = 0, half of which shines through half a space of absorber: by the midpoint rule
/// over both.
fn lamp_irradiance() -> f64 {
    const N: usize = 24;
    let middle = |i: usize, from: f64, size: f64| from + size * (i as f64 + 0.5) / N as f64;
    let mut sum = 0.0;
    for (i, j) in (0..N * N).map(|k| (k / N, k % N)) {
        let (x, to) = (middle(i, -1.2, 1.8), middle(j, -1.0, 2.0));
        // Shares of the way down to z = -1 at which it is at negative x.
        let at = |t: f64| x + t * (to - x);
        let turn = (x / (x - to)).clamp(0.0, 0.5);
        let inside = if at(0.0) < 0.0 && at(0.5) < 0.0 {
            0.5
        } else if at(0.0) < 0.0 {
            turn
        } else if at(0.5) < 0.0 {
            0.5 - turn
        } else {
            0.0
        };
        for (k, l) in (0..N * N).map(|k| (k / N, k % N)) {
            let d = dvec3(to - x, middle(l, -1.0, 2.0) - middle(k, -0.9, 1.8), -2.0);
            let d2 = d.length_squared();
            sum += 4.0 / (d2 * d2) * (-inside * d2.sqrt()).exp();
        }
    }
    sum * 1.8 * 1.8 / (N as f64).powi(4)
}

/// The lamp's triangles, the first of which starts inside, or outside.
fn lamp_across() -> Case {
    let view = |corner: [f64; 3], u: [f64; 3], v: [f64; 3], seed| {
        let scene = json!({
            "film": film(8, 8, 1),
            "camera": {"irradiance_plane": {"origin": [-1, -1, -2], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0]}},
            "materials": {"a": absorber(1.0, 1)},
            "shapes": [
                {"box": {"min": [-200, -200, -1], "max": [0, 200, 1]}, "material": "a"},
                {"quad": {"corner": corner, "edge_u": u, "edge_v": v}, "emission": {"radiance": 1}},
            ],
        });
        // Light paths alone start on the lamp.
        let techniques = Techniques { bsdf_sampling: false, next_event_estimation: false, ..Default::default() };
        View { seed, techniques, ..measuring(scene, 32, 4.0) }
    };
    let exact = lamp_irradiance();
    let row = |i: usize, name: &str| {
        Row::new(format!("starts-lamp/{name}"), exact, 3e-3 * exact, move |f: &[Film]| vec![mean(&f[i])]).floor(5e-4 * exact)
    };
    Case {
        id: "starts-lamp",
        title: "irradiance by a lamp that reaches across the boundary of an absorber, its first triangle inside or outside",
        views: vec![
            view([-1.2, -0.9, 0.0], [0.0, 1.8, 0.0], [1.8, 0.0, 0.0], 1),
            view([0.6, 0.9, 0.0], [0.0, -1.8, 0.0], [-1.8, 0.0, 0.0], 2),
        ],
        rows: vec![row(0, "inside-first"), row(1, "outside-first")],
    }
}

/// A frame that no axis of is an axis of the world's.
fn turned() -> DMat3 {
    DMat3::from_axis_angle(dvec3(1.0, 2.0, 3.0).normalize(), 0.65)
}

fn point(x: f64, y: f64, z: f64) -> [f64; 3] {
    (turned() * dvec3(x, y, z) + dvec3(0.3, 0.7, -0.4)).to_array()
}

fn edge(x: f64, y: f64, z: f64) -> [f64; 3] {
    (turned() * dvec3(x, y, z)).to_array()
}

/// A square through `(0, y, 0)` whose normal points up or down.
fn square(y: f64, half: f64, is_up: bool) -> Value {
    let z = if is_up { half } else { -half };
    json!({"corner": point(-half, y, z), "edge_u": edge(2.0 * half, 0.0, 0.0), "edge_v": edge(0.0, 0.0, -2.0 * z)})
}

/// A pane of glass from y = 0 to 0.5, turned.
fn pane(camera: Value, rest: Value) -> Value {
    let scene = json!({
        "film": film(8, 8, 1),
        "camera": camera,
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"quad": square(0.5, 3.0, true), "material": "glass"},
            {"quad": square(0.0, 3.0, false), "material": "glass"},
        ],
    });
    with(scene, rest)
}

fn sensor(y: f64, half: f64, is_up: bool) -> Value {
    let plane = square(y, half, is_up);
    json!({"irradiance_plane": {"origin": plane["corner"], "edge_u": plane["edge_u"], "edge_v": plane["edge_v"]}})
}

fn orthographic(from: f64, to: f64) -> Value {
    json!({"orthographic": {"eye": point(0.0, from, 0.0), "target": point(0.0, to, 0.0), "up": edge(0.0, 0.0, 1.0), "height": 0.8}})
}

fn sensor_touching() -> Case {
    let beam = json!({
        "reference": "forward",
        "lights": [{"beam": {"origin": point(0.0, 3.0, 0.0), "direction": edge(0.0, -1.0, 0.0), "radius": 1, "irradiance": 1}}],
    });
    let absorbing = json!({"materials": {"glass": {"dielectric": {"ior": 1.5, "absorption": 1}}}, "lights": sky()["lights"]});
    let ball = json!({
        "film": film(8, 8, 1),
        "camera": {"irradiance_sphere": {"center": [0.1, 0.2, 0.3], "radius": 0.7}},
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [{"sphere": {"center": [0.1, 0.2, 0.3], "radius": 0.7}, "material": "glass"}],
        "lights": [{"constant": {"radiance": 1}}],
    });
    let (r, t): (f64, f64) = (0.04, (-0.5f64).exp());
    let row = |i: usize, name: &str, exact: f64| {
        Row::new(format!("touching/{name}"), exact, 5e-3 * exact, move |f: &[Film]| vec![mean(&f[i])]).floor(1e-5)
    };
    Case {
        id: "touching",
        title: "sensors in a face of glass: irradiance under a beam, in an even sky, and radiance seen from the face into it",
        views: vec![
            measuring(pane(sensor(0.0, 0.5, true), beam.clone()), 64, 4.0),
            View { seed: 2, ..measuring(pane(sensor(0.5, 0.5, true), beam.clone()), 64, 4.0) },
            View { seed: 3, ..measuring(pane(sensor(0.5, 0.5, false), beam), 192, 4.0) },
            View::new(ball, 16),
            View::new(pane(orthographic(0.5, -3.0), absorbing), 16),
        ],
        rows: vec![
            row(0, "lower-face-up", (1.0 - r) / (1.0 - r * r)),
            row(1, "upper-face-up", 1.0),
            row(2, "upper-face-down", (1.0 - r) * r / (1.0 - r * r)),
            row(3, "ball", PI),
            row(4, "view-plane", 1.5 * 1.5 * (1.0 - r) * t / (1.0 - r * t)),
        ],
    }
}

/// Irradiance, over radiance, of a point `height` above the middle of a square of half side `a` that faces it.
fn under_square(a: f64, height: f64) -> f64 {
    let h = (a * a + height * height).sqrt();
    4.0 * a / h * (a / h).atan()
}

fn lamp_touching() -> Case {
    let lamp = |y: f64, is_up: bool| json!({"shapes": [{"quad": square(y, 0.6, is_up), "emission": {"radiance": 1}}]});
    // Black, so that the lamp alone is seen.
    let wall = |camera: Value| {
        json!({
            "film": film(8, 8, 1),
            "camera": camera,
            "materials": {"wall": {"diffuse": {"reflectance": 0}}},
            "shapes": [
                {"quad": square(0.0, 3.0, true), "material": "wall"},
                {"quad": square(0.0, 0.6, true), "emission": {"radiance": 1}},
            ],
        })
    };
    let row = |i: usize, name: &str, exact: f64| {
        Row::new(format!("touching-lamp/{name}"), exact, 5e-3 * exact, move |f: &[Film]| vec![mean(&f[i])]).floor(3e-5 * exact)
    };
    Case {
        id: "touching-lamp",
        title: "lamps in a surface: radiance of such in the lower and upper face of glass, and in a black wall; irradiance by that",
        views: vec![
            View::new(pane(orthographic(3.0, 0.0), lamp(0.0, true)), 32),
            View::new(pane(orthographic(3.0, 0.0), lamp(0.5, true)), 16),
            View::new(wall(orthographic(3.0, 0.0)), 16),
            View::new(wall(sensor(1.0, 5e-3, false)), 64),
        ],
        rows: vec![
            row(0, "through-glass", 0.96 / (1.5 * 1.5)),
            row(1, "on-glass", 1.0),
            row(2, "wall", 1.0),
            row(3, "lit-by-wall", under_square(0.6, 1.0)),
        ],
    }
}
