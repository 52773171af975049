//! Flat and round surfaces: prisms, rainbows, Fresnel's equations, slabs.

use super::{LINES, film, film_of_lines, landing, lines, measuring, screen};
use crate::film::Film;
use crate::spectrum::library;
use crate::validate::optics::{fresnel, prism_tilt, rainbow_incidence};
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};
use std::f64::consts::PI;

pub(super) fn cases() -> Vec<Case> {
    vec![
        prism("prism-n-bk7", "N-BK7", "minimum deviation of a 60 degree prism of N-BK7, degrees", [39.138, 38.647, 38.429]),
        prism("prism-n-sf11", "N-SF11", "minimum deviation of a 60 degree prism of N-SF11, degrees", [69.179, 66.343, 65.240]),
        rainbow("rainbow-1", "rainbow of one reflection in a sphere of n = 4/3, degrees", 1.0, 42.030),
        rainbow("rainbow-2", "rainbow of two reflections in a sphere of n = 4/3, degrees", 2.0, 50.978),
        fresnel_outside(),
        fresnel_inside(),
        fresnel_mean_outside(),
        fresnel_mean_inside(),
        slab(),
    ]
}

/// Beams of F, d and C, each at its own minimum deviation, and where they land 100 m away.
fn prism(id: &'static str, glass: &str, title: &'static str, degrees: [f64; 3]) -> Case {
    const FAR: f64 = 100.0;
    let half = 0.5 * 0.75f64.sqrt();
    let ior = library::glass(glass);
    let tilts = LINES.map(|(_, nm)| prism_tilt(ior.as_ref().map_or(f64::NAN, |ior| ior.eval(nm))));
    let beams: Vec<Value> = LINES
        .iter()
        .zip(tilts)
        .map(|((_, nm), tilt)| {
            let d = [tilt.cos(), tilt.sin(), 0.0];
            json!({"beam": {"origin": [-0.25 - d[0], half - d[1], 0], "direction": d, "radius": 0.01, "irradiance": lines(&[*nm])}})
        })
        .collect();
    let heights = [tilts[0], tilts[2]].map(|tilt| half - FAR * tilt.tan());
    let (y0, y1) = (heights[0] - 0.3, heights[1] + 0.3);
    let scene = json!({
        "film": film_of_lines(1024, 1),
        "camera": screen(0.25 + FAR, y0, y1, 1.0),
        "materials": {"glass": {"dielectric": {"ior": glass}}},
        "shapes": [{"prism": {"polygon": [[-0.5, 0], [0.5, 0], [0, 0.75f64.sqrt()]], "length": 1}, "material": "glass"}],
        "lights": beams,
        "max_depth": 2,
    });
    let row = |line: usize| {
        let tilt = tilts[line];
        Row::new(format!("{id}/{}", LINES[line].0), degrees[line], 1e-4, move |f: &[Film]| {
            let y = y0 + (y1 - y0) * landing(&f[0], line, 0, f[0].pixels());
            vec![(tilt + ((half - y) / FAR).atan()).to_degrees()]
        })
        .floor(6e-4)
    };
    Case { id, title, views: vec![measuring(scene, 8, 4.0)], rows: (0..3).map(row).collect() }
}

/// A pencil of light at Descartes' angle, and where it lands 100 m away.
fn rainbow(id: &'static str, title: &'static str, k: f64, degrees: f64) -> Case {
    const FAR: f64 = 100.0;
    let n: f64 = 4.0 / 3.0;
    let i = rainbow_incidence(n, k);
    let t = (i.sin() / n).asin();
    // Clockwise from +x; every chord turns the foot by pi - 2t.
    let deviation = k * PI + 2.0 * i - 2.0 * (k + 1.0) * t;
    let foot = PI - i - (k + 1.0) * (PI - 2.0 * t);
    let along = [deviation.cos(), -deviation.sin()];
    // A sensor across the way out; its columns run to the left of it.
    let left = [-along[1], along[0]];
    let width = 1.0;
    let corner = [0, 1].map(|a| [foot.cos(), foot.sin()][a] + FAR * along[a] - 0.5 * width * left[a]);
    let scene = json!({
        "film": film(512, 1, 1),
        "camera": {"irradiance_plane": {
            "origin": [corner[0], corner[1], 0.5],
            "edge_u": [width * left[0], width * left[1], 0],
            "edge_v": [0, 0, -1],
        }},
        "materials": {"water": {"dielectric": {"ior": n}}},
        "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "water"}],
        "lights": [{"beam": {"origin": [-2, i.sin(), 0], "direction": [1, 0, 0], "radius": 0.001, "irradiance": 1}}],
        "max_depth": k as u32 + 2,
    });
    let degrees_from_antisolar = move |offset: f64| {
        let angle = (along[1] * FAR + offset * left[1]).atan2(along[0] * FAR + offset * left[0]);
        180.0 - angle.to_degrees().abs()
    };
    let row = Row::new(format!("{id}/angle"), degrees, 1e-4, move |f: &[Film]| {
        vec![degrees_from_antisolar(width * (landing(&f[0], 0, 0, f[0].pixels()) - 0.5))]
    });
    Case { id, title, views: vec![measuring(scene, 2, 32.0)], rows: vec![row.floor(6e-4)] }
}

/// Plates, each turned by its own angle, seen by parallel rays: one column of 16 pixels for each.
fn plates(degrees: &[f64], surroundings: f64, plate: f64) -> Value {
    let shapes: Vec<Value> = degrees
        .iter()
        .enumerate()
        .map(|(i, angle)| {
            json!({
                "box": {"min": [-20, -0.45, -1], "max": [20, 0.45, 0]},
                "material": "plate",
                "transform": {"axis": [0, 1, 0], "rotate_deg": angle, "translate": [0, i as f64 + 0.5, 0]},
            })
        })
        .collect();
    let rows = degrees.len();
    json!({
        "film": film(8, 8 * rows as u32, 1),
        "camera": {"orthographic": {"eye": [0, 0.5 * rows as f64, 40], "target": [0, 0.5 * rows as f64, 0], "height": rows}},
        "surroundings": {"ior": surroundings},
        // What gets through is absorbed in the plate.
        "materials": {"plate": {"dielectric": {"ior": plate, "absorption": 1e5}}},
        "shapes": shapes,
        "lights": [{"constant": {"radiance": 1}}],
    })
}

/// Reflectance of each plate.
fn plate_rows(case: &str, plates: &[(&str, f64, f64)], floor: f64) -> Vec<Row> {
    let count = plates.len();
    let row = |(i, (name, _, exact)): (usize, &(&str, f64, f64))| {
        // Without the rows of pixels that see a gap between two plates.
        let first = (count - 1 - i) * 64 + 8;
        Row::new(format!("{case}/{name}"), *exact, 0.01 * exact, move |f: &[Film]| {
            vec![(first..first + 48).map(|pixel| f[0].bin(pixel, 0)).sum::<f64>() / 48.0]
        })
        .floor(floor)
    };
    plates.iter().enumerate().map(row).collect()
}

fn fresnel_outside() -> Case {
    let n: f64 = 1.5168;
    let brewster = n.atan();
    // Half of the reflectance of the polarisation that is left at Brewster's angle.
    let at_brewster = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
    let at = |degrees: f64| fresnel(degrees.to_radians(), n);
    let list = [
        ("normal", 0.0, 0.04216),
        ("brewster", brewster.to_degrees(), at_brewster),
        ("75-degrees", 75.0, at(75.0)),
        ("85-degrees", 85.0, at(85.0)),
    ];
    let angles = list.map(|(_, degrees, _)| degrees);
    Case {
        id: "fresnel-outside",
        title: "reflectance of n = 1.5168 from outside",
        views: vec![View::new(plates(&angles, 1.0, n), 64)],
        rows: plate_rows("fresnel-outside", &list, 5e-6),
    }
}

fn fresnel_inside() -> Case {
    let n: f64 = 1.5168;
    let critical = (1.0 / n).asin().to_degrees();
    let at = |degrees: f64| fresnel(degrees.to_radians(), 1.0 / n);
    let list = [
        ("normal", 0.0, 0.04216),
        ("critical-below", critical - 1e-3, at(critical - 1e-3)),
        ("critical-above", critical + 1e-3, 1.0),
        ("60-degrees", 60.0, 1.0),
    ];
    let angles = list.map(|(_, degrees, _)| degrees);
    Case {
        id: "fresnel-inside",
        title: "reflectance of n = 1.5168 from inside, also 0.001 degrees from the critical angle on both sides",
        views: vec![View::new(plates(&angles, n, 1.0), 64)],
        rows: plate_rows("fresnel-inside", &list, 1e-4),
    }
}

/// Irradiance from a uniform sky by way of a mirror of glass, over pi.
fn fresnel_mean_outside() -> Case {
    let scene = json!({
        "film": film(8, 8, 1),
        "camera": {"irradiance_plane": {"origin": [-0.5, 0.001, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}},
        "materials": {"glass": {"dielectric": {"ior": 1.5, "absorption": 1e5}}},
        "shapes": [{"box": {"min": [-1e4, -10, -1e4], "max": [1e4, 0, 1e4]}, "material": "glass"}],
        "lights": [{"constant": {"radiance": 1}}],
    });
    let row = Row::new("fresnel-mean-outside/share", 0.091778, 2e-4, |f: &[Film]| vec![f[0].mean_of(0) / PI]).floor(1e-6);
    Case {
        id: "fresnel-mean-outside",
        title: "mean reflectance of n = 1.5 over the hemisphere, from outside",
        views: vec![View::new(scene, 1024)],
        rows: vec![row],
    }
}

/// Irradiance in glass over a lamp as wide as it, by way of the surface, over pi.
fn fresnel_mean_inside() -> Case {
    let scene = json!({
        "film": film(8, 8, 1),
        "camera": {"irradiance_plane": {"origin": [-0.5, -0.001, -0.5], "edge_u": [0, 0, 1], "edge_v": [1, 0, 0]}},
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"box": {"min": [-1e4, -10, -1e4], "max": [1e4, 0, 1e4]}, "material": "glass"},
            {"quad": {"corner": [-9e3, -0.01, 9e3], "edge_u": [1.8e4, 0, 0], "edge_v": [0, 0, -1.8e4]}, "emission": {"radiance": 1}},
        ],
    });
    let row = Row::new("fresnel-mean-inside/share", 0.596346, 5e-4, |f: &[Film]| vec![f[0].mean_of(0) / PI]).floor(1e-5);
    Case {
        id: "fresnel-mean-inside",
        title: "mean reflectance of n = 1.5 over the hemisphere, from inside",
        views: vec![View::new(scene, 256)],
        rows: vec![row],
    }
}

/// A lamp through a clear and an absorbing slab, side by side.
fn slab() -> Case {
    let n = 1.5168;
    let scene = json!({
        "film": film(16, 8, 1),
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 1}},
        "materials": {
            "clear": {"dielectric": {"ior": n}},
            "tinted": {"dielectric": {"ior": n, "absorption": 0.1}},
        },
        "shapes": [
            {"box": {"min": [-9, -9, 0], "max": [-0.001, 9, 1]}, "material": "clear"},
            {"box": {"min": [0.001, -9, 0], "max": [9, 9, 1]}, "material": "tinted"},
            {"disc": {"center": [0, 0, -2], "normal": [0, 0, 1], "radius": 8}, "emission": {"radiance": 1}},
        ],
    });
    let half = |right: usize| {
        move |f: &[Film]| {
            let pixels = (0..128).filter(|p| p % 16 / 8 == right && ![7, 8].contains(&(p % 16)));
            let values: Vec<f64> = pixels.map(|p| f[0].bin(p, 0)).collect();
            vec![values.iter().sum::<f64>() / values.len() as f64]
        }
    };
    Case {
        id: "slab",
        title: "a slab of N-BK7 at normal incidence with all inner reflections, and one of optical depth 0.1",
        views: vec![View::new(scene, 64)],
        rows: vec![
            Row::new("slab/clear", 0.919083, 1e-3, half(0)).floor(1e-6),
            Row::new("slab/absorbing", 0.831352, 1e-3, half(1)).floor(1e-6),
        ],
    }
}
