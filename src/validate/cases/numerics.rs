//! What the method itself promises: no tint, no dependence on the number of bins, on scale or on place, convergence, the same bits.

use super::{all_bins, blocks, film, measuring};
use crate::film::Film;
use crate::integrator::Techniques;
use crate::scene::{Geometry, Mesh, Scene};
use crate::validate::{Case, Row, View};
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::sync::Arc;

pub(super) fn cases() -> Vec<Case> {
    vec![no_dispersion(), channels(), scale(), mesh_refinement(), convergence(), merging_convergence(), determinism()]
}

/// Parallel light through a ball of glass onto an irradiance sensor around the focus.
fn caustic(film: Value, ior: Value) -> Value {
    json!({
        "film": film,
        "camera": {"irradiance_plane": {"origin": [-0.2, -1.5, 0.2], "edge_u": [0.4, 0, 0], "edge_v": [0, 0, -0.4]}},
        "materials": {"glass": {"dielectric": {"ior": ior}}},
        "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"}],
        "lights": [{"beam": {
            "origin": [0, 3, 0], "direction": [0, -1, 0], "radius": 0.9, "irradiance": [[400, 1], [720, 2]],
        }}],
    })
}

fn no_dispersion() -> Case {
    let view = |ior: Value, seed, spp| View { seed, ..measuring(caustic(film(4, 4, 8), ior), spp, 16.0) };
    let row = Row::new("no-dispersion/ratio", 1.0, 5e-3, |f: &[Film]| {
        all_bins(&f[1]).iter().zip(all_bins(&f[0])).map(|(a, b)| a / b).collect()
    });
    Case {
        id: "no-dispersion",
        title: "flux behind glass of n = 1.6 + 1e-12 um^2 / l^2, over that of n = 1.6, in each of 8 bins",
        views: vec![view(json!(1.6), 1, 48), view(json!({"cauchy": [1.6, 1e-12]}), 2, 192)],
        rows: vec![row],
    }
}

fn channels() -> Case {
    const COUNTS: [usize; 4] = [16, 4, 20, 80];
    let view = |n: &usize| {
        let film = json!({"width": 4, "height": 4, "range_nm": [400, 720], "bins": n});
        View { seed: *n as u64, ..measuring(caustic(film, json!("N-SF11")), 32, 16.0) }
    };
    // Bins of 80 nm.
    let quarter = |film: &Film, q: usize| {
        let n = film.bins() / 4;
        (q * n..(q + 1) * n).map(|bin| film.mean_of(bin)).sum::<f64>() / n as f64
    };
    let row = |i: usize| {
        Row::new(format!("channels/{}", COUNTS[i]), 1.0, 1e-2, move |f: &[Film]| {
            (0..4).map(|q| quarter(&f[i], q) / quarter(&f[0], q)).collect()
        })
    };
    Case {
        id: "channels",
        title: "flux behind a ball of N-SF11 in four bands, rendered with N bins, over that with 16",
        views: COUNTS.iter().map(view).collect(),
        rows: (1..4).map(row).collect(),
    }
}

/// A small room with a prism and a ball of glass, all lengths times `s`, moved by `by`.
fn room(s: f64, by: f64) -> Value {
    let at = |x: f64, y: f64, z: f64| json!([s * x + by, s * y - by, s * z + by]);
    json!({
        "film": film(16, 16, 2),
        "camera": {"perspective": {"eye": at(0.0, 1.0, 4.0), "target": at(0.0, 0.4, 0.0), "vfov_deg": 35}},
        "materials": {"ground": {"diffuse": {"reflectance": 0.6}}, "glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"quad": {"corner": at(-3.0, 0.0, 3.0), "edge_u": [6.0 * s, 0, 0], "edge_v": [0, 0, -6.0 * s]}, "material": "ground"},
            {"sphere": {"center": at(-0.5, 0.5, 0.0), "radius": 0.5 * s}, "material": "glass"},
            {"prism": {"polygon": [[-0.4, 0], [0.4, 0], [0, 0.7]], "length": 0.8}, "material": "glass",
             "transform": {"scale": s, "translate": at(0.6, 0.001, 0.2)}},
            {"disc": {"center": at(0.3, 3.0, 0.5), "normal": [0, -1, 0], "radius": 0.6 * s}, "emission": {"radiance": 5}},
        ],
        "lights": [{"constant": {"radiance": 0.1}}],
    })
}

fn scale() -> Case {
    // The same seed: the same paths, but for rounding.
    let views = [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 1e5)].map(|(s, by)| View::new(room(s, by), 32));
    let row = |name: &str, i: usize| {
        Row::new(format!("scale/{name}"), 1.0, 1e-2, move |f: &[Film]| {
            blocks(&f[i], 4, 1.0).iter().zip(blocks(&f[0], 4, 1.0)).map(|(a, b)| a / b).collect()
        })
        .floor(1e-4)
    };
    Case {
        id: "scale",
        title: "the same scene at 1e-3 and 1e4 times its size, and moved by 1e5 m along each axis: radiance over that of the first",
        views: views.into(),
        rows: vec![row("1e-3", 1), row("1e4", 2), row("moved-1e5-m", 3)],
    }
}

/// A ball of radius 1 out of `2 n^2` rectangles; `smooth` ones have the normals of the ball.
pub(super) fn tessellated_ball(n: u32, smooth: bool) -> Geometry {
    let mut mesh = Mesh::default();
    let columns = 2 * n;
    for j in 0..=n {
        for i in 0..columns {
            let (theta, phi) = (PI * f64::from(j) / f64::from(n), PI * f64::from(i) / f64::from(n));
            mesh.positions.push(DVec3::new(theta.sin() * phi.cos(), -theta.sin() * phi.sin(), theta.cos()));
        }
    }
    if smooth {
        mesh.normals = mesh.positions.clone();
    }
    for j in 0..n {
        for i in 0..columns {
            let (a, b) = (j * columns + i, j * columns + (i + 1) % columns);
            if j > 0 {
                mesh.triangles.push([a, b, a + columns]);
            }
            if j < n - 1 {
                mesh.triangles.push([b, b + columns, a + columns]);
            }
        }
    }
    Geometry::Mesh(Arc::new(mesh))
}

/// Puts a tessellated ball in place of the first shape.
fn tessellate<const N: u32, const SMOOTH: bool>(scene: &mut Scene) {
    scene.shapes[0].geometry = tessellated_ball(N, SMOOTH);
}

fn mesh_refinement() -> Case {
    let view = |change: fn(&mut Scene), seed| {
        let scene = json!({
            "film": film(32, 32, 1),
            "camera": {"irradiance_plane": {"origin": [-1.2, -1.2, -3], "edge_u": [2.4, 0, 0], "edge_v": [0, 2.4, 0]}},
            "max_depth": 2,
            "materials": {"glass": {"dielectric": {"ior": 1.5}}},
            "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"}],
            "lights": [{"beam": {"origin": [0, 0, 3], "direction": [0, 0, -1], "radius": 0.6, "irradiance": 1}}],
        });
        View { change: Some(change), seed, ..measuring(scene, 2, 8.0) }
    };
    // Flux times the square of the distance from the axis: its error is one of the mesh, not of a rim.
    let spread = |f: &Film| {
        let at = |i: usize| 2.4 * ((i as f64 + 0.5) / 32.0 - 0.5);
        (0..1024).map(|p| f.bin(p, 0) * (at(p % 32).powi(2) + at(p / 32).powi(2))).sum::<f64>()
    };
    let order = move |f: &[Film], coarse: usize, fine: usize| {
        let off = |i: usize| (spread(&f[i]) - spread(&f[0])).abs();
        vec![(off(coarse) / off(fine)).log2()]
    };
    Case {
        id: "mesh-refinement",
        title: "caustic of a tessellated ball against that of the ball: order in the size of the facets; with smooth normals, its spread",
        views: vec![
            view(|_| {}, 1),
            view(tessellate::<12, false>, 2),
            view(tessellate::<24, false>, 3),
            view(tessellate::<48, true>, 4),
        ],
        rows: vec![
            Row::new("mesh-refinement/order", 2.0, 0.1, move |f: &[Film]| order(f, 1, 2)).floor(0.2),
            Row::new("mesh-refinement/smooth-normals", 1.0, 2e-3, move |f: &[Film]| vec![spread(&f[3]) / spread(&f[0])])
                .floor(5e-3),
        ],
    }
}

/// Least-squares slope of `ln y` over `ln x`.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mx) * (y - my), b + (x - mx).powi(2)));
    xy / xx
}

/// Mean squared difference of two films of the same scene, over all pixels and bins.
fn squared_difference(a: &Film, b: &Film) -> f64 {
    let pixels = (0..a.pixels()).flat_map(|p| (0..a.bins()).map(move |bin| (a.bin(p, bin) - b.bin(p, bin)).powi(2)));
    pixels.sum::<f64>() / (a.pixels() * a.bins()) as f64
}

const SAMPLES: [u32; 3] = [2, 8, 32];

/// Pairs of independent pictures of the same number of samples: half their mean squared difference is the variance.
fn convergence() -> Case {
    let scene = json!({
        "film": film(16, 16, 2),
        "camera": {"perspective": {"eye": [0, 0, 4], "target": [0, 0, 0], "vfov_deg": 40}},
        "media": {"fog": {"sigma_s": 1, "g": 0.3}},
        "materials": {"fog": {"boundary": {"medium": "fog"}}, "glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"sphere": {"center": [0, 0, 0], "radius": 1.5}, "material": "fog"},
            {"sphere": {"center": [0.3, 0, 0], "radius": 0.5}, "material": "glass"},
            {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 1}, "emission": {"radiance": 5}},
        ],
    });
    let techniques = Techniques { merging: false, ..Techniques::default() };
    let view = |i: usize| View {
        seed: 1 + i as u64,
        scales: false,
        techniques,
        light_paths: Some(1.0),
        ..View::new(scene.clone(), SAMPLES[i / 2])
    };
    let row = Row::new("convergence/unbiased", -1.0, 0.04, |f: &[Film]| {
        let mse = |i: usize| 0.5 * squared_difference(&f[2 * i], &f[2 * i + 1]);
        vec![slope(&[0, 1, 2].map(|i| (f64::from(SAMPLES[i]), mse(i))))]
    });
    Case {
        id: "convergence",
        title: "slope of log squared error over log samples, no merging: fog around glass",
        views: (0..6).map(view).collect(),
        rows: vec![row],
    }
}

/// A floor seen through a pane by merging alone, and by BSDF-sampled emitter hits and next-event estimation as its truth.
fn merging_convergence() -> Case {
    let scene = json!({
        "film": film(16, 16, 2),
        "camera": {"orthographic": {"eye": [0, 3, 0], "target": [0, 0, 0], "up": [0, 0, -1], "height": 2}},
        "materials": {"ground": {"diffuse": {"reflectance": 0.7}}, "glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [
            {"quad": {"corner": [-3, 0, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6]}, "material": "ground"},
            {"box": {"min": [-2, 0.5, -2], "max": [2, 0.8, 2]}, "material": "glass"},
            // Beside what the camera would see in the pane.
            {"disc": {"center": [3, 4, 0], "normal": [-0.6, -0.8, 0], "radius": 1}, "emission": {"radiance": 5}},
        ],
    });
    let alone = Techniques { bsdf_sampling: false, next_event_estimation: false, ..Techniques::default() };
    let plain = Techniques { merging: false, light_paths: false, ..Techniques::default() };
    let merged = |i: usize| View {
        seed: 1 + i as u64,
        scales: false,
        techniques: alone,
        light_paths: Some(1.0),
        ..View::new(scene.clone(), SAMPLES[i])
    };
    let truth = |seed| View { seed, scales: false, techniques: plain, ..View::new(scene.clone(), 256) };
    let row = Row::new("convergence/merging", -2.0 / 3.0, 0.08, |f: &[Film]| {
        // Net of the variance of the truth, by its two pictures.
        let mse = |i: usize| squared_difference(&f[i], &f[3]) - 0.5 * squared_difference(&f[3], &f[4]);
        vec![slope(&[0, 1, 2].map(|i| (f64::from(SAMPLES[i]), mse(i))))]
    });
    Case {
        id: "merging-convergence",
        title: "the same, merging alone",
        views: (0..3).map(merged).chain([truth(8), truth(9)]).collect(),
        rows: vec![row.floor(0.1)],
    }
}

fn determinism() -> Case {
    let view = || View { scales: false, ..View::new(caustic(film(8, 8, 4), json!("N-SF11")), 8) };
    let row = Row::new("determinism/values-that-differ", 0.0, 0.0, |f: &[Film]| {
        let bits = |f: &Film| {
            (0..f.pixels()).flat_map(|p| f.pixel(p).iter().map(|v| v.to_bits()).collect::<Vec<_>>()).collect::<Vec<_>>()
        };
        vec![bits(&f[0]).iter().zip(bits(&f[1])).filter(|(a, b)| **a != *b).count() as f64]
    });
    Case {
        id: "determinism",
        title: "the same seed twice: values whose bits differ",
        views: vec![view(), view()],
        rows: vec![row],
    }
}
