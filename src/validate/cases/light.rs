//! Amounts of light: form factors, fog, colour, lamps of no size, and what becomes of all the light there is.

use super::{all_bins, film, mean, measuring};
use crate::color::cie::xy;
use crate::film::Film;
use crate::validate::optics::{disc_to_disc, square_solid_angle};
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};
use std::f64::consts::PI;

pub(super) fn cases() -> Vec<Case> {
    vec![
        barrel(),
        fog_pencil(),
        fog_spot(),
        fog_behind_glass(),
        blackbody(),
        small_lights(),
        laser_at_bin_edge(),
        energy(),
        reciprocity(),
    ]
}

/// Three black tubes side by side, each with a lamp as its floor: irradiance on the square around the open end.
fn barrel() -> Case {
    let lengths = [2.0, 5.0, 10.0];
    let tubes = lengths.iter().enumerate().flat_map(|(i, length)| {
        let x = 2.5 * i as f64;
        [
            json!({"cylinder": {"base": [x, -length, 0], "top": [x, 0, 0], "radius": 1}, "material": "black"}),
            json!({"disc": {"center": [x, -length, 0], "normal": [0, 1, 0], "radius": 1}, "emission": {"radiance": 1}}),
        ]
    });
    let tubes: Vec<Value> = tubes.collect();
    let view = |i: usize| {
        let scene = json!({
            "film": film(8, 8, 1),
            "camera": {"irradiance_plane": {"origin": [2.5 * i as f64 - 1.0, 1e-5, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2]}},
            "materials": {"black": {"diffuse": {"reflectance": 0}}},
            "shapes": tubes.clone(),
        });
        View { seed: 1 + i as u64, ..View::new(scene, 64) }
    };
    let row = |(i, length): (usize, &f64)| {
        let exact = disc_to_disc(*length);
        // 4 is the square's area, pi squared the flux of the lamp.
        Row::new(format!("barrel/{length}"), exact, 5e-3 * exact, move |f: &[Film]| vec![4.0 * mean(&f[i]) / (PI * PI)])
    };
    Case {
        id: "barrel",
        title: "share of a disc's light that leaves a black tube of 2, 5 and 10 radii",
        views: (0..3).map(view).collect(),
        rows: lengths.iter().enumerate().map(row).map(|row| row.floor(2e-6)).collect(),
    }
}

/// A beam through a block of fog, seen across: light that is scattered once.
fn fog_pencil() -> Case {
    const ROWS: usize = 8;
    let (sigma_s, sigma_t, radius) = (0.5, 0.8, 0.001);
    let scene = json!({
        "film": film(4, ROWS as u32, 1),
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}},
        "max_depth": 1,
        "media": {"fog": {"sigma_s": sigma_s, "sigma_a": sigma_t - sigma_s}},
        "materials": {"fog": {"boundary": {"medium": "fog"}}},
        "shapes": [{"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}, "material": "fog"}],
        "lights": [{"beam": {"origin": [0, -2, 0], "direction": [0, 1, 0], "radius": radius, "irradiance": 1}}],
    });
    let pixel = 2.0 / ROWS as f64;
    let row = |name: &str, r: usize| {
        // Mean over the pixels' height of e^(-sigma_t s), s from the bottom; the way to the camera is 1.
        let s0 = 2.0 - pixel * (r + 1) as f64;
        let along = ((-sigma_t * s0).exp() - (-sigma_t * (s0 + pixel)).exp()) / (sigma_t * pixel);
        let exact = sigma_s * PI * radius * radius * along * (-sigma_t).exp() / (4.0 * PI);
        across(format!("fog-pencil/{name}"), exact, r, pixel)
    };
    Case {
        id: "fog-pencil",
        title: "a pencil of light in fog seen at 90 degrees, scattered once: radiance integrated across it, near and far",
        views: vec![measuring(scene, 64, 16.0)],
        rows: vec![row("near", ROWS - 2), row("far", 1)],
    }
}

/// Radiance integrated across row `r` of four pixels, each `pixel` m wide.
fn across(id: String, exact: f64, r: usize, pixel: f64) -> Row {
    let sum = move |f: &[Film]| vec![(0..4).map(|column| f[0].bin(4 * r + column, 0)).sum::<f64>() * pixel];
    Row::new(id, exact, 5e-3 * exact, sum).floor(1e-4 * exact)
}

/// The cone of a spot in a block of fog, seen across: light that is scattered once, by quadrature.
fn fog_spot() -> Case {
    const ROWS: usize = 8;
    let (sigma_s, sigma_t, inner, outer) = (0.3, 0.4, 4f64.to_radians(), 8f64.to_radians());
    let scene = json!({
        "film": film(4, ROWS as u32, 1),
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}},
        "max_depth": 1,
        "media": {"fog": {"sigma_s": sigma_s, "sigma_a": sigma_t - sigma_s}},
        "materials": {"fog": {"boundary": {"medium": "fog"}}},
        "shapes": [{"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}, "material": "fog"}],
        "lights": [{"spot": {"position": [0, -2, 0], "direction": [0, 1, 0], "inner_deg": inner.to_degrees(), "outer_deg": outer.to_degrees(), "intensity": 1}}],
    });
    let pixel = 2.0 / ROWS as f64;
    let row = |name: &str, r: usize| {
        // Over directions from the spot and heights above it; fog begins at 1 above the spot, and ends at 1 before the axis.
        const STEPS: usize = 64;
        let middle = |i: usize| (i as f64 + 0.5) / STEPS as f64;
        let bottom = 3.0 - pixel * (r + 1) as f64;
        let mut sum = 0.0;
        for (i, j, k) in (0..STEPS).flat_map(|i| (0..STEPS).flat_map(move |j| (0..STEPS).map(move |k| (i, j, k)))) {
            let cos = 1.0 - middle(i) * (1.0 - outer.cos());
            let t = ((cos - outer.cos()) / (inner.cos() - outer.cos())).min(1.0);
            let (height, azimuth) = (bottom + pixel * middle(j), 2.0 * PI * middle(k));
            let towards_eye = height * (1.0 - cos * cos).sqrt() / cos * azimuth.cos();
            let in_fog = (height - 1.0) / cos + 1.0 - towards_eye;
            sum += t * t * (3.0 - 2.0 * t) * (-sigma_t * in_fog).exp() / cos;
        }
        let cone = 2.0 * PI * (1.0 - outer.cos());
        let exact = sigma_s / (4.0 * PI) * cone * sum / (STEPS * STEPS * STEPS) as f64;
        across(format!("fog-spot/{name}"), exact, r, pixel)
    };
    Case {
        id: "fog-spot",
        title: "the cone of a spot in fog seen at 90 degrees, scattered once: radiance integrated across it, near and far",
        views: vec![measuring(scene, 64, 16.0)],
        rows: vec![row("near", ROWS - 2), row("far", 1)],
    }
}

/// Fog in a beam, seen through a plane slab of glass: only light paths that are merged find it. A layer thinner than the kernel is deep, lit from the side, and fog so dense
/// that what lies a kernel deep hardly counts, lit along the view. So little is scattered that twice does not matter.
fn fog_behind_glass() -> Case {
    let (sigma_s, depth, edge, height, n) = (1e-4, 0.1, 0.1, 0.1, 1.5);
    let view = |spp: u32, sigma_t: f64, origin: [f64; 3], direction: [f64; 3]| {
        let scene = json!({
            "film": film(4, 4, 1),
            "camera": {"orthographic": {"eye": [0, 0, 3], "target": [0, 0, 0], "height": height}},
            "media": {"fog": {"sigma_s": sigma_s, "sigma_a": sigma_t - sigma_s}},
            "materials": {"fog": {"boundary": {"medium": "fog"}}, "glass": {"dielectric": {"ior": n}}},
            "shapes": [
                {"box": {"min": [-edge, -edge, -depth], "max": [edge, edge, 0]}, "material": "fog"},
                {"box": {"min": [-1, -1, 1], "max": [1, 1, 1.1]}, "material": "glass"},
            ],
            "lights": [{"beam": {"origin": origin, "direction": direction, "radius": 0.12, "irradiance": 1}}],
        });
        measuring(scene, spp, 64.0)
    };
    // Integral of e^(-sigma s) from `a` to `b`.
    let left = |sigma: f64, a: f64, b: f64| ((-sigma * a).exp() - (-sigma * b).exp()) / sigma;
    let (thin, dense) = (2.0, 40.0);
    // The beam has come from the edge; its mean over the picture's width.
    let beam = left(thin, edge - 0.5 * height, edge + 0.5 * height) / height;
    // A slab's transmittance, with all reflections within it.
    let seen = sigma_s / (4.0 * PI) * 2.0 * n / (n * n + 1.0);
    let row = |name: &str, i: usize, exact: f64| {
        let value = move |f: &[Film]| vec![mean(&f[i])];
        Row::new(format!("fog-behind-glass/{name}"), exact, 1e-2 * exact, value).floor(1e-4 * exact)
    };
    Case {
        id: "fog-behind-glass",
        title: "fog in a beam, behind a slab of glass: radiance of a thin layer, and of fog dense over a kernel's depth",
        views: vec![
            view(256, thin, [-2.0, 0.0, -0.5 * depth], [1.0, 0.0, 0.0]),
            view(16, dense, [0.0, 0.0, 0.8], [0.0, 0.0, -1.0]),
        ],
        rows: vec![row("thin", 0, seen * beam * left(thin, 0.0, depth)), row("dense", 1, seen * left(2.0 * dense, 0.0, depth))],
    }
}

/// Chromaticities of skies that radiate as black bodies do.
fn blackbody() -> Case {
    let view = |kelvin: u32| {
        let scene = json!({
            // As far as the observer is known.
            "film": {"width": 2, "height": 2, "range_nm": [360, 830], "bins": 20},
            "camera": {"orthographic": {"eye": [0, 0, 1], "target": [0, 0, 0], "height": 1}},
            "lights": [{"constant": {"radiance": {"blackbody": kelvin}}}],
        });
        View { seed: u64::from(kelvin), ..View::new(scene, 256) }
    };
    let row = |name: &str, exact, i: usize, axis: usize| {
        Row::new(format!("blackbody/{name}"), exact, 1e-4, move |f: &[Film]| {
            vec![xy([0, 1, 2].map(|c| f[i].mean_of(f[i].bins() + c)))[axis]]
        })
        .floor(1e-5)
    };
    Case {
        id: "blackbody",
        title: "chromaticity x, y of black bodies of 2856 and 6500 K, from the film's XYZ",
        views: vec![view(2856), view(6500)],
        rows: vec![
            row("2856K-x", 0.44754, 0, 0),
            row("2856K-y", 0.40743, 0, 1),
            row("6500K-x", 0.31353, 1, 0),
            row("6500K-y", 0.32363, 1, 1),
        ],
    }
}

/// Lights of no size over an irradiance sensor, straight and through a slab of glass.
fn small_lights() -> Case {
    let view = |light: Value, shapes: Value, seed| {
        let scene = json!({
            "film": film(8, 8, 1),
            "camera": {"irradiance_plane": {"origin": [-1, 0, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}},
            "materials": {"glass": {"dielectric": {"ior": 1.5168}}},
            "shapes": shapes,
            "lights": [light],
        });
        View { seed, ..View::new(scene, 64) }
    };
    let point = json!({"point": {"position": [0, 2, 0], "intensity": 1}});
    let sun = |direction: [f64; 3]| json!({"sun": {"direction": direction, "angle_deg": 0, "irradiance": 1}});
    let slab = json!([{"box": {"min": [-9, 0.5, -9], "max": [9, 1, 9]}, "material": "glass"}]);
    let row = |name: &str, exact: f64, i: usize, largest_sigma: f64| {
        Row::new(format!("small-lights/{name}"), exact, largest_sigma, move |f: &[Film]| vec![mean(&f[i])]).floor(5e-6)
    };
    Case {
        id: "small-lights",
        title: "irradiance under lights of no size: a point, a slanted sun, a sun through a slab of N-BK7",
        views: vec![view(point, json!([]), 1), view(sun([0.6, -0.8, 0.0]), json!([]), 2), view(sun([0.0, -1.0, 0.0]), slab, 3)],
        rows: vec![
            row("point", square_solid_angle(1.0, 2.0) / 4.0, 0, 1e-3),
            row("sun", 0.8, 1, 1e-3),
            row("sun-through-slab", 0.919083, 2, 3e-3),
        ],
    }
}

/// A line of 1 nm over the edge of two bins.
fn laser_at_bin_edge() -> Case {
    let scene = json!({
        "film": film(4, 4, 6),
        "camera": {"irradiance_plane": {"origin": [-1, 0, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}},
        "lights": [{"laser": {
            "origin": [0.1, 1, 0.1], "direction": [0, -1, 0], "radius": 0.5, "power_W": 1, "wavelength_nm": 550.2, "width_nm": 1,
        }}],
    });
    // Bins of 50 nm, two of which meet at 550: W of each, of the line from 549.7 to 550.7.
    let row = |name: &str, exact: f64, bin: usize| {
        Row::new(format!("laser-bin-edge/{name}"), exact, 5e-3, move |f: &[Film]| vec![4.0 * 50.0 * f[0].mean_of(bin)])
            .floor(1e-5)
    };
    Case {
        id: "laser-bin-edge",
        title: "a laser line of 1 nm and 1 W across the edge of two bins, W in each",
        views: vec![View::new(scene, 256)],
        rows: vec![row("below", 0.3, 2), row("above", 0.7, 3)],
    }
}

/// A point lamp in a ball of glass in a closed room, all of whose walls are alike.
fn energy() -> Case {
    let scene = json!({
        "film": film(8, 8, 2),
        "camera": {"irradiance_plane": {"origin": [-1, -0.99999, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2]}},
        "max_depth": 1000,
        "materials": {
            "wall": {"diffuse": {"reflectance": 0.5}},
            "glass": {"dielectric": {"ior": 1.3}},
        },
        "shapes": [
            {"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}, "material": "wall"},
            {"sphere": {"center": [0, 0, 0], "radius": 0.5}, "material": "glass"},
        ],
        "lights": [{"point": {"position": [0, 0, 0], "intensity": 1}}],
    });
    // Each of six walls of area 4 absorbs half of what falls on it; the lamp sends out 4 pi.
    let row = Row::new("energy/absorbed", 1.0, 3e-3, |f: &[Film]| {
        all_bins(&f[0]).iter().map(|e| 6.0 * 4.0 * 0.5 * e / (4.0 * PI)).collect()
    });
    Case {
        id: "energy",
        title: "light absorbed by the walls of a closed room, over what a lamp in a ball of glass sends out",
        views: vec![View::new(scene, 64)],
        rows: vec![row.floor(1e-4)],
    }
}

/// Lamp and sensor change places: smooth and rough glass between them.
fn reciprocity() -> Case {
    let (corners, edges_u, edges_v) =
        ([[-1.5, 0.0, 1.0], [1.0, 0.2, -1.0]], [[0.0, 0.0, -2.0], [0.0, 0.0, 2.0]], [[0.0, 2.0, 0.0], [1.0, 1.0, 0.0]]);
    // Their normals, towards each other.
    let normals = [[1.0, 0.0, 0.0], [-0.5f64.sqrt(), 0.5f64.sqrt(), 0.0]];
    let square = |i: usize, above: f64| {
        let corner = [0, 1, 2].map(|a| corners[i][a] + above * normals[i][a]);
        json!({"corner": corner, "edge_u": edges_u[i], "edge_v": edges_v[i]})
    };
    let view = |lamp: usize, seed| {
        let sensor = square(1 - lamp, 1e-5);
        let scene = json!({
            "film": film(4, 4, 2),
            "camera": {"irradiance_plane": {"origin": sensor["corner"], "edge_u": sensor["edge_u"], "edge_v": sensor["edge_v"]}},
            "materials": {
                "glass": {"dielectric": {"ior": 1.5}},
                "frosted": {"dielectric": {"ior": 1.5, "alpha": 0.3}},
                "ground": {"diffuse": {"reflectance": 0.6}},
                "black": {"diffuse": {"reflectance": 0}},
            },
            "shapes": [
                {"quad": square(lamp, 0.0), "emission": {"radiance": 1}},
                // The lamp is black where it does not shine; so is the sensor's back.
                {"quad": square(1 - lamp, 0.0), "material": "black"},
                {"sphere": {"center": [-0.5, 0.6, 0.2], "radius": 0.5}, "material": "glass"},
                {"sphere": {"center": [0.3, 0.9, -0.5], "radius": 0.4}, "material": "frosted"},
                {"quad": {"corner": [-4, -0.2, 4], "edge_u": [8, 0, 0], "edge_v": [0, 0, -8]}, "material": "ground"},
            ],
        });
        View { seed, ..View::new(scene, 256) }
    };
    let areas: [f64; 2] = [4.0, 8f64.sqrt()];
    let row = Row::new("reciprocity/ratio", 1.0, 1e-2, move |f: &[Film]| {
        let flux = |i: usize| all_bins(&f[i]).into_iter().map(move |e| e * areas[1 - i]);
        flux(0).zip(flux(1)).map(|(a, b)| a / b).collect()
    });
    Case {
        id: "reciprocity",
        title: "flux from one square to another and back, through glass and frosted glass over a diffuse floor: their ratio",
        views: vec![view(0, 1), view(1, 2)],
        rows: vec![row],
    }
}
