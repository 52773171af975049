//! Lenses as cameras, and what their prescriptions say of them.

use super::film;
use crate::film::Film;
use crate::lens::camera::{Focus, Setting};
use crate::lens::{Fault, Glass, LensCamera, LensRay, Prescription, Surface};
use crate::scene::load_lens;
use crate::spectrum::{Ior, LINE_C_NM, LINE_D_NM, LINE_F_NM};
use crate::validate::{Case, Row, View};
use glam::{DVec2, dvec3};
use serde_json::json;

pub(super) fn cases() -> Vec<Case> {
    vec![stop_alone(), paraxial(), aberrations(), reciprocity()]
}

/// Share of the hemisphere's irradiance that comes from a disc of radius `a` in a parallel plane at `h`, whose axis is `r` away (Howell, configuration B-13).
fn disc_factor(a: f64, h: f64, r: f64) -> f64 {
    let (x, y) = (h * h + r * r + a * a, 2.0 * r * a);
    0.5 * (1.0 - (h * h + r * r - a * a) / (x * x - y * y).sqrt())
}

/// A hole, behind a pane that is of air: what is left of a lens is the cosine to the fourth power.
fn stop_alone() -> Case {
    let (a, h) = (0.008, 0.03);
    let scene = json!({
        "film": film(36, 24, 4),
        "camera": {"lens": {
            "eye": [0, 0, 0], "target": [0, 0, -1], "film": [0.036, 0.024], "film_distance": h, "diameter": 0.2,
            "surfaces": [{"thickness": 0.001, "glass": {"nd": 1}}, {}, {"diameter": 2.0 * a, "stop": true}],
        }},
        "lights": [{"constant": {"radiance": 1}}],
    });
    let pixel = 0.001;
    // Mean over the pixels from (x, y) on.
    let row = |name: &str, [x, y, width, height]: [u32; 4], sigma: f64| {
        let at = |x: f64, y: f64| ((x - 18.0) * pixel).hypot((y - 12.0) * pixel);
        // Over a pixel by Gauss-Legendre, two points along each axis.
        let g = 0.5 / 3f64.sqrt();
        let points = [(-g, -g), (-g, g), (g, -g), (g, g)];
        let mean = |(cx, cy): (u32, u32)| {
            let (cx, cy) = (f64::from(cx) + 0.5, f64::from(cy) + 0.5);
            points.iter().map(|(dx, dy)| disc_factor(a, h, at(cx + dx, cy + dy))).sum::<f64>() / 4.0
        };
        let pixels = (y..y + height).flat_map(|y| (x..x + width).map(move |x| (x, y))).collect::<Vec<_>>();
        let exact = pixels.iter().map(|&p| mean(p)).sum::<f64>() / pixels.len() as f64 / disc_factor(a, h, 0.0);
        let of_bin = move |f: &Film, bin| {
            let values = pixels.iter().map(|(x, y)| f.bin((36 * y + x) as usize, bin));
            values.sum::<f64>() / pixels.len() as f64
        };
        Row::new(format!("stop-alone/{name}"), exact, sigma, move |f: &[Film]| (0..4).map(|bin| of_bin(&f[0], bin)).collect())
            .floor(1e-5)
    };
    Case {
        id: "stop-alone",
        title: "irradiance behind a hole over that on its axis: cos^4 of the angle, near enough",
        views: vec![View::new(scene, 64)],
        rows: vec![
            row("all", [0, 0, 36, 24], 5e-4),
            row("middle", [15, 9, 6, 6], 2e-3),
            row("edge", [30, 9, 6, 6], 2e-3),
            row("corner", [0, 0, 6, 6], 2e-3),
        ],
    }
}

fn constant(n: f64) -> Option<Glass> {
    Some(Glass { name: n.to_string(), ior: Ior::constant(n), absorption: None })
}

fn surface(radius: f64, thickness: f64, glass: Option<Glass>) -> Surface {
    Surface { radius, conic: 0.0, aspheric: vec![], thickness, glass, semi_diameter: 0.02, stop: false }
}

fn lens(surfaces: Vec<Surface>) -> Prescription {
    Prescription { name: String::new(), surfaces }
}

fn known(id: &str, exact: f64, floor: f64, measured: f64) -> Row {
    Row::new(id.to_string(), exact, 0.0, move |_: &[Film]| vec![measured]).floor(floor)
}

/// Gaussian optics of lenses that ship, and of a thin one.
fn paraxial() -> Case {
    let shipped = |name: &str| load_lens(name, None).unwrap_or_else(|e| panic!("{name}, which ships: {e}"));
    let (singlet, gauss) = (shipped("singlet"), shipped("gauss"));
    let focus = |nm: f64| 1e3 * singlet.paraxial(nm).focal_length;
    let back = gauss.paraxial(LINE_D_NM).back_focus() / gauss.paraxial(LINE_D_NM).focal_length;
    // A thin lens of N-BK7 by the lensmaker's formula.
    let glass = || Some(Glass { name: "N-BK7".into(), ior: Ior::from_abbe_number(1.5168, 64.17), absorption: None });
    let thin = lens(vec![surface(0.1, 1e-9, glass()), surface(-0.1, 0.0, None)]);
    let f = |nm: f64| thin.paraxial(nm).focal_length;
    let (n, power) = (|nm: f64| Ior::from_abbe_number(1.5168, 64.17).eval(nm), 2.0 / 0.1);
    let exact_color = 1.0 / ((n(LINE_C_NM) - 1.0) * power) - 1.0 / ((n(LINE_F_NM) - 1.0) * power);
    Case {
        id: "lens-paraxial",
        title: "focal lengths of a singlet of N-BK7, R = 51.680 mm, mm; back focus over focal length of Tronnier's double Gauss; axial colour of a thin lens",
        views: vec![],
        rows: vec![
            known("lens-paraxial/F", 98.932, 1e-3, focus(LINE_F_NM)),
            known("lens-paraxial/d", 100.0, 1e-3, focus(LINE_D_NM)),
            known("lens-paraxial/C", 100.482, 1e-3, focus(LINE_C_NM)),
            // US 2,673,491 prints p0' = 0.71436 f for radii of four digits.
            known("lens-paraxial/gauss", 0.71436, 2e-4, back),
            known("lens-paraxial/colour", exact_color, 1e-9, f(LINE_C_NM) - f(LINE_F_NM)),
        ],
    }
}

/// Rays through surfaces whose aberrations are known: an aplanatic meniscus, and a plano-convex lens either way round.
fn aberrations() -> Case {
    // Light from a point in air enters a meniscus through a sphere about the point, and leaves it by one whose aplanatic point that is: at R (n + 1) / n
    // from its vertex, imaged at R (n + 1), sines of angles in the ratio n (Born & Wolf, 4.2.3).
    let (n, r) = (1.6, 0.1);
    let object = r * (n + 1.0) / n;
    let meniscus = lens(vec![surface(-(object - 0.01), 0.01, constant(n)), surface(-r, 0.0, None)]);
    // The point is before the lens: distances are to its first vertex.
    let from = dvec3(0.0, 0.0, -(object - 0.01));
    let sine = |sin: f64| {
        let d = dvec3(0.0, sin, (1.0 - sin * sin).sqrt());
        let out = crate::lens::Tracer::new(&meniscus, LINE_D_NM).trace(LensRay { o: from, d });
        out.map_or(f64::NAN, |out| sin / out.ray.d.y)
    };
    let image = |sin: f64| {
        let d = dvec3(0.0, sin, (1.0 - sin * sin).sqrt());
        let out = crate::lens::Tracer::new(&meniscus, LINE_D_NM).trace(LensRay { o: from, d });
        out.map_or(f64::NAN, |out| 0.01 - (out.ray.o.z - out.ray.o.y * out.ray.d.z / out.ray.d.y))
    };
    // Longitudinal aberration over h^2 / f of thin lenses of index 1.5 in light from infinity, of the third order: 7/6 with the curved side to the light,
    // 9/2 with the flat one (Hecht, Optics, 6.3.1; Born & Wolf, 5.5).
    let shape = |first: f64, second: f64| {
        let lens = lens(vec![surface(first, 1e-9, constant(1.5)), surface(second, 0.0, None)]);
        let (h, p) = (1e-3, lens.paraxial(LINE_D_NM));
        let out = crate::lens::Tracer::new(&lens, LINE_D_NM).trace(LensRay { o: dvec3(0.0, h, -0.01), d: glam::DVec3::Z });
        let crossing = out.map_or(f64::NAN, |out| out.ray.o.z - out.ray.o.y * out.ray.d.z / out.ray.d.y);
        (p.rear_focus - crossing) * p.focal_length / (h * h)
    };
    let flat = f64::INFINITY;
    Case {
        id: "lens-aberrations",
        title: "sines of an aplanatic meniscus of index 1.6, and where it images; spherical aberration of a plano-convex lens",
        views: vec![],
        rows: vec![
            known("lens-aberrations/sine-0.1", n, 1e-12, sine(0.1)),
            known("lens-aberrations/sine-0.15", n, 1e-12, sine(0.15)),
            known("lens-aberrations/image", r * (n + 1.0), 1e-12, image(0.1)),
            known("lens-aberrations/curved-first", 7.0 / 6.0, 2e-3, shape(0.05, flat)),
            known("lens-aberrations/flat-first", 4.5, 2e-3, shape(flat, -0.05)),
        ],
    }
}

/// A lamp as the camera sees it out of focus, and the caustic that the same lens as a solid makes of its light where the film was.
fn reciprocity() -> Case {
    const SIDE: usize = 24;
    let (film_side, behind, n, r) = (0.006, 0.05, 1.5, 0.05);
    let surfaces = json!([{"stop": true, "thickness": 0.004, "diameter": 0.01}, {"radius": r, "thickness": 0.008, "glass": n}, {"radius": -r}]);
    // Light that passes the stop outside goes outwards from there, beside the lens.
    let lamp = json!([{"sphere": {"center": [0.006, 0, -0.4], "radius": 0.006}, "emission": {"radiance": 1}}]);
    let seen = json!({
        "film": film(SIDE as u32, SIDE as u32, 1),
        "camera": {"lens": {
            "eye": [0, 0, 0], "target": [0, 0, -1], "film": [film_side, film_side], "film_distance": behind,
            "diameter": 0.03, "surfaces": surfaces,
        }},
        "shapes": lamp,
    });
    let half = 0.5 * film_side;
    let caustic = json!({
        "film": film(SIDE as u32, SIDE as u32, 1),
        "camera": {"irradiance_plane": {"origin": [half, -half, 0.012 + behind], "edge_u": [-film_side, 0, 0], "edge_v": [0, film_side, 0]}},
        "shapes": [lamp[0], {"lens": {"diameter": 0.03, "surfaces": surfaces}}],
        // A camera's lens has no reflections.
        "max_depth": 2,
    });
    let part = |radius: f64, thickness: f64, glass: Option<Glass>, semi_diameter: f64, stop: bool| Surface {
        thickness,
        semi_diameter,
        stop,
        ..surface(radius, 0.0, glass)
    };
    let solid = lens(vec![
        part(f64::INFINITY, 0.004, None, 0.005, true),
        part(r, 0.008, constant(n), 0.015, false),
        part(-r, 0.0, None, 0.015, false),
    ]);
    let setting = Setting { film: DVec2::splat(film_side), focus: Focus::Film(behind), f_number: None, range_nm: (500.0, 600.0) };
    let axial = LensCamera::new(solid, &setting).map_or_else(|Fault { problem, .. }| panic!("{problem}"), |camera| camera.axial);
    // Sum, mean column, and variance of the columns.
    let moments = |film: &Film| {
        let sum = |weight: &dyn Fn(f64) -> f64| (0..SIDE * SIDE).map(|i| film.bin(i, 0) * weight((i % SIDE) as f64)).sum::<f64>();
        let (all, mean) = (sum(&|_| 1.0), sum(&|x| x) / sum(&|_| 1.0));
        [all, mean, sum(&|x| (x - mean).powi(2)) / all]
    };
    let row = |name: &str, exact: f64, sigma: f64, measure: fn([f64; 3], [f64; 3], f64) -> f64| {
        let measure = move |f: &[Film]| vec![measure(moments(&f[0]), moments(&f[1]), axial)];
        Row::new(format!("lens-reciprocity/{name}"), exact, sigma, measure).floor(1e-3)
    };
    Case {
        id: "lens-reciprocity",
        title: "image of a lamp out of focus over the caustic of its light through the same lens: light, place in pixels, variance",
        views: vec![View::new(seen, 32), View { light_paths: Some(16.0), seed: 1, ..View::new(caustic, 4) }],
        rows: vec![
            row("light", 1.0, 5e-3, |seen, caustic, axial| seen[0] * axial / caustic[0]),
            row("place", 0.0, 2e-2, |seen, caustic, _| seen[1] - caustic[1]),
            row("width", 1.0, 2e-2, |seen, caustic, _| seen[2] / caustic[2]),
        ],
    }
}
