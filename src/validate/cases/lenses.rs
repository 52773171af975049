//! Lenses: two pencils of light at heights h and -2h, whose focal lengths are extrapolated to height 0, so that only aberration of the fifth
//! order is left.

use super::{LINES, film_of_lines, landing, lines, measuring, screen};
use crate::film::Film;
use crate::validate::{Case, Row};
use serde_json::{Value, json};

pub(super) fn cases() -> Vec<Case> {
    vec![ball(), plano_convex()]
}

/// Pencils along +x from `x`, and a sensor `reach` behind the principal plane at `plane`.
fn scene(materials: Value, shapes: Value, h: f64, x: f64, plane: f64, reach: f64, focus: f64) -> (Value, [f64; 2]) {
    let far = 2.5 * h * (reach / focus - 1.0);
    let (y0, y1) = (-far, 2.0 * far);
    let all = LINES.map(|(_, nm)| nm);
    let pencil =
        |y: f64| json!({"beam": {"origin": [x, y, 0], "direction": [1, 0, 0], "radius": 0.01 * h, "irradiance": lines(&all)}});
    let scene = json!({
        "film": film_of_lines(1536, 1),
        "camera": screen(plane + reach, y0, y1, h),
        "materials": materials,
        "shapes": shapes,
        "lights": [pencil(h), pencil(-2.0 * h)],
        // Light that is reflected within the lens has other foci.
        "max_depth": 2,
    });
    (scene, [y0, y1])
}

/// Focal length from the principal plane of a bin's line, times `unit`.
fn focus(h: f64, reach: f64, [y0, y1]: [f64; 2], line: usize, unit: f64) -> impl Fn(&[Film]) -> Vec<f64> {
    move |f: &[Film]| {
        let at = |from, to| y0 + (y1 - y0) * landing(&f[0], line, from, to);
        // The first third of the columns is below the axis.
        let (near, far) = (at(0, 512), at(512, 1536));
        let [f1, f2] = [(h, near), (-2.0 * h, far)].map(|(h, y)| reach * h / (h - y));
        vec![unit * (4.0 * f1 - f2) / 3.0]
    }
}

fn ball() -> Case {
    let (h, reach) = (0.02, 3.0);
    let materials = json!({"glass": {"dielectric": {"ior": "N-BK7"}}});
    let shapes = json!([{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"}]);
    let (scene, window) = scene(materials, shapes, h, -2.0, 0.0, reach, 1.46);
    let row = |line: usize, exact| {
        Row::new(format!("ball-lens/{}", LINES[line].0), exact, 3e-5, focus(h, reach, window, line, 1.0)).floor(3e-5)
    };
    Case {
        id: "ball-lens",
        title: "focal length of a ball of N-BK7 from its centre, radii",
        views: vec![measuring(scene, 8, 4.0)],
        rows: vec![row(0, 1.45716), row(2, 1.47215)],
    }
}

/// The curved side is a sphere, the flat one the face of a block of air that cuts off the rest of it.
fn plano_convex() -> Case {
    let (radius, h, reach) = (0.05168, 1e-3, 0.3);
    let materials = json!({
        "glass": {"dielectric": {"ior": "N-BK7", "priority": 1}},
        "air": {"dielectric": {"ior": 1, "priority": 2}},
    });
    let shapes = json!([
        {"sphere": {"center": [0, 0, 0], "radius": radius}, "material": "glass"},
        {"box": {"min": [-0.1, -0.1, -0.1], "max": [0.04, 0.1, 0.1]}, "material": "air"},
    ]);
    let (scene, window) = scene(materials, shapes, h, -0.09, radius, reach, 0.1);
    let row = |line: usize, exact| {
        Row::new(format!("plano-convex/{}", LINES[line].0), exact, 2e-3, focus(h, reach, window, line, 1e3)).floor(2e-3)
    };
    Case {
        id: "plano-convex",
        title: "focal lengths of a plano-convex lens of N-BK7, R = 51.680 mm, flat side to the light, mm from the vertex",
        views: vec![measuring(scene, 8, 4.0)],
        rows: vec![row(0, 98.932), row(1, 100.0), row(2, 100.482)],
    }
}
