//! Lenses: two pencils of light at heights h and -2h, whose focal lengths are extrapolated to height 0, so that only aberration of the fifth
//! order is left.

use super::{LINES, film, film_of_lines, landing, lines, mean, measuring, screen};
use crate::film::Film;
use crate::validate::optics::{Ray2, fresnel};
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};

pub(super) fn cases() -> Vec<Case> {
    vec![ball(), plano_convex(), thick(), axial_color(), aplanatic(), spherical(), cemented()]
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

/// A lens of these surfaces with the vertex of the first at `x`, its axis along +x.
fn lens(surfaces: Value, diameter: f64, x: f64) -> Value {
    let transform = json!({"axis": [0, 1, 0], "rotate_deg": 90, "translate": [x, 0, 0]});
    json!([{"lens": {"surfaces": surfaces, "diameter": diameter}, "transform": transform}])
}

fn plano_convex() -> Case {
    let (radius, h, reach) = (0.05168, 1e-3, 0.3);
    let shapes = lens(json!([{"thickness": 0.01, "glass": "N-BK7"}, {"radius": -radius}]), 0.03, radius - 0.01);
    let (scene, window) = scene(json!({}), shapes, h, -0.09, radius, reach, 0.1);
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

/// The lensmaker's equation with thickness (Hecht, Optics, 6.2), from the second principal plane.
fn thick() -> Case {
    let (n, r1, r2, d, h, reach) = (1.5, 0.05, -0.08, 0.02, 1e-3, 0.2);
    let f = 1.0 / ((n - 1.0) * (1.0 / r1 - 1.0 / r2 + (n - 1.0) * d / (n * r1 * r2)));
    let plane = d - f * (n - 1.0) * d / (n * r1);
    let shapes = lens(json!([{"radius": r1, "thickness": d, "glass": n}, {"radius": r2}]), 0.03, 0.0);
    let (scene, window) = scene(json!({}), shapes, h, -0.05, plane, reach, f);
    Case {
        id: "thick-lens",
        title: "focal length of a biconvex lens of index 1.5, 20 mm thick, R = 50 and 80 mm, from its principal plane, mm",
        views: vec![measuring(scene, 8, 4.0)],
        rows: vec![Row::new("thick-lens/f", 1e3 * f, 2e-3, focus(h, reach, window, 1, 1e3)).floor(2e-3)],
    }
}

/// Foci of a thin lens are f / V apart, as f (n - 1) is the same for all lines: f_C - f_F = f_d / V (n_d - 1)^2 / ((n_F - 1) (n_C - 1)).
fn axial_color() -> Case {
    let (radius, d, h, reach) = (0.2, 2e-4, 1.5e-3, 0.45);
    let n = LINES.map(|(_, nm)| 1.6 + 0.01 / (1e-3 * nm).powi(2));
    let v = (n[1] - 1.0) / (n[0] - n[2]);
    let glass = json!({"cauchy": [1.6, 0.01]});
    let shapes = lens(json!([{"radius": radius, "thickness": d, "glass": glass}, {"radius": -radius}]), 0.01, -0.5 * d);
    let f = 0.5 * radius / (n[1] - 1.0);
    let (scene, window) = scene(json!({}), shapes, h, -0.05, 0.0, reach, f);
    let foci = [0, 1, 2].map(|line| focus(h, reach, window, line, 1.0));
    let measure = move |films: &[Film]| {
        let [f_f, f_d, f_c] = [0, 1, 2].map(|line| foci[line](films)[0]);
        vec![(f_c - f_f) * v / f_d]
    };
    let exact = (n[1] - 1.0).powi(2) / ((n[0] - 1.0) * (n[2] - 1.0));
    Case {
        id: "axial-color",
        title: "distance of the foci for F and C of a thin lens, over f / V",
        views: vec![measuring(scene, 8, 4.0)],
        rows: vec![Row::new("axial-color/f-over-v", exact, 1e-3, measure).floor(1e-3)],
    }
}

/// Light from a point R / n from the middle of a ball of glass leaves as if it came from n R from there, all of it: sin u / sin u' = n (Born & Wolf, 4.2.3).
fn aplanatic() -> Case {
    let (n, x, from) = (1.5, 4.0, 0.8 - 1.5);
    let beam = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        json!({"beam": {"origin": [0.8 - 1.0 / n, 0, 0], "direction": [cos, sin, 0], "radius": 2e-3, "irradiance": 1}})
    };
    let scene = json!({
        "film": film(2048, 1, 1),
        "camera": screen(x, 0.5, 2.5, 0.1),
        "shapes": lens(json!([{"thickness": 1.8, "glass": n}, {"radius": -1.0}]), 1.9, 0.0),
        "lights": [beam(15.0), beam(40.0)],
        "max_depth": 1,
    });
    let row = |degrees: f64, columns: [usize; 2]| {
        let measure = move |f: &[Film]| {
            let y = 0.5 + 2.0 * landing(&f[0], 0, columns[0], columns[1]);
            vec![degrees.to_radians().sin() / (y / (x - from)).atan().sin()]
        };
        Row::new(format!("aplanatic/{degrees}"), n, 1e-4, measure).floor(1e-4)
    };
    Case {
        id: "aplanatic",
        title: "sine condition: sin u / sin u' of light from the aplanatic point of a ball of index 1.5",
        views: vec![measuring(scene, 8, 4.0)],
        rows: vec![row(15.0, [0, 1024]), row(40.0, [1024, 2048])],
    }
}

/// A ray through a plano-convex lens far from its axis, traced by Snell's law: the flat side should face the focus.
fn spherical() -> Case {
    let (n, radius, d, h, x) = (1.5168, 0.05168, 0.01, 0.015, 0.25);
    let root = f64::sqrt(radius * radius - h * h);
    let ray = Ray2 { at: [-0.05, h], along: [1.0, 0.0] };
    let curved_first = ray
        .refracted_at([radius - root, h], [-root / radius, h / radius], n)
        .refracted_at([d, 0.0], [-1.0, 0.0], 1.0 / n)
        .height_at(x);
    let flat_first = ray.refracted_at([d - radius + root, h], [-root / radius, -h / radius], 1.0 / n).height_at(x);
    let view = |surfaces: Value, y: f64| {
        let scene = json!({
            "film": film(64, 1, 1),
            "camera": screen(x, y - 1e-3, y + 1e-3, 1e-3),
            "shapes": lens(surfaces, 0.04, 0.0),
            "lights": [{"beam": {"origin": [-0.05, h, 0], "direction": [1, 0, 0], "radius": 1e-4, "irradiance": 1}}],
            "max_depth": 2,
        });
        View { light_paths: Some(64.0), ..View::new(scene, 8) }
    };
    let row = |id: &str, film: usize, y: f64| {
        let measure = move |f: &[Film]| vec![1e3 * (y - 1e-3 + 2e-3 * landing(&f[film], 0, 0, 64))];
        Row::new(format!("spherical-aberration/{id}"), 1e3 * y, 1e-3, measure).floor(1e-3)
    };
    Case {
        id: "spherical-aberration",
        title: "where a ray 15 mm off the axis of a plano-convex lens, f = 100 mm, crosses the plane 250 mm behind its front, mm",
        views: vec![
            view(json!([{"radius": radius, "thickness": d, "glass": n}, {}]), curved_first),
            view(json!([{"thickness": d, "glass": n}, {"radius": -radius}]), flat_first),
        ],
        rows: vec![row("curved-side-first", 0, curved_first), row("flat-side-first", 1, flat_first)],
    }
}

/// A cemented face is one interface between two glasses: what gets straight through is the product of three transmittances.
fn cemented() -> Case {
    let (radius, side) = (1e-3, 4e-3);
    let surfaces = json!([{"radius": 0.06, "thickness": 0.008, "glass": 1.5}, {"radius": -0.05, "thickness": 0.004, "glass": 1.7}, {"radius": -0.2}]);
    let scene = json!({
        "film": film(1, 1, 1),
        "camera": {"irradiance_plane": {"origin": [0.03, -0.5 * side, 0.5 * side], "edge_u": [0, side, 0], "edge_v": [0, 0, -side]}},
        "shapes": lens(surfaces, 0.02, 0.0),
        "lights": [{"beam": {"origin": [-0.05, 0, 0], "direction": [1, 0, 0], "radius": radius, "irradiance": 1}}],
        "max_depth": 3,
    });
    let exact = [1.5, 1.7 / 1.5, 1.0 / 1.7].map(|n| 1.0 - fresnel(0.0, n)).iter().product();
    let measure = move |f: &[Film]| vec![mean(&f[0]) * side * side / (std::f64::consts::PI * radius * radius)];
    Case {
        id: "cemented",
        title: "share of a thin beam that gets straight through a cemented doublet of indices 1.5 and 1.7",
        views: vec![View { light_paths: Some(4096.0), ..View::new(scene, 8) }],
        rows: vec![Row::new("cemented/transmittance", exact, 1e-3, measure).floor(1e-4)],
    }
}
