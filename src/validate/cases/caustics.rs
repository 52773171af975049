//! Caustics of smooth surfaces: behind a ball, and within a mirrored ring.

use super::{blocks, film, landing, mean, measuring};
use crate::film::Film;
use crate::validate::optics::{extremum, fresnel, mirrored_height};
use crate::validate::{Case, Row, View};
use serde_json::json;
use std::f64::consts::PI;

pub(super) fn cases() -> Vec<Case> {
    vec![ball(), polarisation(), cusp(), fold(), lake()]
}

/// Pixels along each side of the sensor behind the ball, which is 2 wide.
const SIDE: usize = 256;

/// Flux within `rho` of the axis, over that which enters the ball.
fn share_within(film: &Film, rho: f64) -> f64 {
    let pixel = 2.0 / SIDE as f64;
    let centre = |i: usize| (i as f64 + 0.5) * pixel - 1.0;
    let flux = |i: usize| {
        let (x, y) = (centre(i % SIDE), centre(i / SIDE));
        // Pixels on the rim count by the part of them that is inside.
        let part = match x.hypot(y) - rho {
            d if d < -pixel => 1.0,
            d if d > pixel => 0.0,
            _ => {
                let offset = |k: usize| ((k as f64 + 0.5) / 16.0 - 0.5) * pixel;
                let inside = (0..256).filter(|k| (x + offset(k % 16)).hypot(y + offset(k / 16)) < rho).count();
                inside as f64 / 256.0
            }
        };
        part * film.bin(i, 0)
    };
    (0..SIDE * SIDE).map(flux).sum::<f64>() * pixel * pixel / PI
}

fn ball() -> Case {
    let scene = json!({
        "film": film(SIDE as u32, SIDE as u32, 1),
        "camera": {"irradiance_plane": {"origin": [-1, -1, -1.5], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0]}},
        "max_depth": 2,
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"}],
        "lights": [{"beam": {"origin": [0, 0, 3], "direction": [0, 0, -1], "radius": 1, "irradiance": 1}}],
    });
    let row = |name: &str, rho: f64, exact: f64| {
        Row::new(format!("sphere-caustic/{name}"), exact, 1e-3, move |f: &[Film]| vec![share_within(&f[0], rho)]).floor(1e-4)
    };
    Case {
        id: "sphere-caustic",
        title: "share of collimated light within rho, 1.5 R behind the centre of a sphere of n = 1.5, two refractions",
        views: vec![measuring(scene, 1, 1.0)],
        rows: vec![row("0.1R", 0.1, 0.37312), row("0.25R", 0.25, 0.56768), row("0.5R", 0.5, 0.70789), row("1R", 1.0, 0.79512)],
    }
}

/// A ball in uniform light, seen by paths of at most two events: what is reflected outside, and what passes by two refractions.
fn polarisation() -> Case {
    let scene = json!({
        "film": film(16, 16, 1),
        "camera": {"orthographic": {"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}},
        "max_depth": 2,
        "materials": {"glass": {"dielectric": {"ior": 1.5}}},
        "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "glass"}],
        "lights": [{"constant": {"radiance": 1}}],
    });
    // The mean over the ball's disc is the mean over a hemisphere by cosine.
    let row = Row::new("polarisation/two-refractions", 0.83554, 5e-4, |f: &[Film]| {
        vec![(mean(&f[0]) - (1.0 - PI / 4.0)) / (PI / 4.0) - 0.091778]
    });
    Case {
        id: "polarisation",
        title: "share through a sphere of n = 1.5 by two refractions, unpolarised at each (0.84061 with polarisation)",
        views: vec![View::new(scene, 64)],
        rows: vec![row.floor(1e-5)],
    }
}

/// The material of a perfect mirror: n of almost 0 reflects all light.
fn mirror() -> serde_json::Value {
    json!({"mirror": {"conductor": {"eta": 1e-6, "k": 100}}})
}

/// Pencils close to the axis of a mirrored cylinder cross it half-way to the centre.
fn cusp() -> Case {
    let h = 0.02;
    let (y0, y1) = (-1.5 * h, 3.0 * h);
    let pencil = |y: f64| json!({"beam": {"origin": [-0.5, y, 0], "direction": [1, 0, 0], "radius": 0.01 * h, "irradiance": 1}});
    let scene = json!({
        "film": film(1536, 1, 1),
        // Faces the mirror at +x.
        "camera": {"irradiance_plane": {"origin": [0, y0, -0.5], "edge_u": [0, y1 - y0, 0], "edge_v": [0, 0, 1]}},
        "max_depth": 1,
        "materials": mirror(),
        "shapes": [{"cylinder": {"base": [0, 0, -1], "top": [0, 0, 1], "radius": 1}, "material": "mirror"}],
        "lights": [pencil(h), pencil(-2.0 * h)],
    });
    let row = Row::new("nephroid/cusp", 0.5, 3e-5, move |f: &[Film]| {
        let at = |from, to| y0 + (y1 - y0) * landing(&f[0], 0, from, to);
        // Distance from the centre at which each pencil crosses the axis.
        let crossing = |h: f64, y: f64| {
            // Through the foot on the mirror and the place where it lands on x = 0.
            let foot = (1.0 - h * h).sqrt();
            -y * foot / (h - y)
        };
        let (c1, c2) = (crossing(h, at(0, 512)), crossing(-2.0 * h, at(512, 1536)));
        vec![(4.0 * c1 - c2) / 3.0]
    });
    Case {
        id: "nephroid",
        title: "cusp of the caustic in a mirrored ring, radii from the centre",
        views: vec![measuring(scene, 1, 32.0)],
        rows: vec![row.floor(3e-5)],
    }
}

/// Light that falls within d and 2d of the fold of the nephroid, on the line x = 0.6 R.
fn fold() -> Case {
    const X: f64 = 0.6;
    // Of which the last lies beyond the fold: single precision spreads it by some 1e-6.
    const COLUMNS: usize = 9;
    let theta = extremum(|t| mirrored_height(t, X), 0.1, 0.7);
    let fold = mirrored_height(theta, X);
    // Wide enough for both branches of the fold, with no second fold in it.
    let width = 5e-4;
    let scene = json!({
        "film": film(COLUMNS as u32, 1, 1),
        "camera": {"irradiance_plane": {"origin": [X, fold - width, -1], "edge_u": [0, width * 9.0 / 8.0, 0], "edge_v": [0, 0, 2]}},
        "max_depth": 1,
        "materials": mirror(),
        "shapes": [{"cylinder": {"base": [0, 0, -1], "top": [0, 0, 1], "radius": 1}, "material": "mirror"}],
        "lights": [{"beam": {"origin": [-0.1, theta.sin(), 0], "direction": [1, 0, 0], "radius": 0.12, "irradiance": 1}}],
    });
    let row = Row::new("fold/exponent", -0.5, 0.01, |f: &[Film]| {
        let within = |columns: usize| (COLUMNS - columns..COLUMNS).map(|c| f[0].bin(c, 0)).sum::<f64>();
        // Flux within d goes as d^(p + 1) where irradiance goes as d^p.
        vec![(within(COLUMNS) / within(1 + COLUMNS / 2)).log2() - 1.0]
    });
    Case {
        id: "fold",
        title: "power of the distance from the nephroid's fold that irradiance goes by",
        views: vec![measuring(scene, 16, 512.0)],
        rows: vec![row.floor(5e-3)],
    }
}

/// A square metre of a lake 1 km wide in the sun, which light paths find only if they are aimed at it.
fn lake() -> Case {
    const N: f64 = 4.0 / 3.0;
    const RHO: f64 = 0.05;
    let slant = 0.6f64;
    let sheet = |y: f64| json!({"corner": [-500, y, 500], "edge_u": [1000, 0, 0], "edge_v": [0, 0, -1000]});
    let scene = json!({
        "film": film(16, 16, 1),
        "camera": {"orthographic": {"eye": [100, 2, 30], "target": [100, 0, 30], "up": [0, 0, -1], "height": 1}},
        "max_depth": 16,
        "materials": {"water": {"dielectric": {"ior": N}}, "mud": {"diffuse": {"reflectance": RHO}}},
        "shapes": [{"quad": sheet(0.0), "material": "water"}, {"quad": sheet(-1.0), "material": "mud"}],
        "lights": [{"sun": {"direction": [slant.sin(), -slant.cos(), 0], "angle_deg": 0.53, "irradiance": 1}}],
    });
    // The water reflects this share of even light from within, and so on with the mud (Duntley 1942).
    const STEPS: usize = 4096;
    let angle = |i: usize| (i as f64 + 0.5) / STEPS as f64 * PI / 2.0;
    let of_even_light = (0..STEPS).map(|i| fresnel(angle(i), N) * (2.0 * angle(i)).sin()).sum::<f64>() * PI / 2.0 / STEPS as f64;
    let back = 1.0 - (1.0 - of_even_light) / (N * N);
    let exact = RHO / PI * slant.cos() * (1.0 - fresnel(slant, N)) / (1.0 - RHO * back) * (1.0 - fresnel(0.0, N)) / (N * N);
    let row = Row::new("lake/blocks", 1.0, 1e-2, move |f: &[Film]| blocks(&f[0], 8, 1.0 / exact));
    Case {
        id: "lake",
        title: "radiance of the sunlit ground 1 m below a square metre of a lake 1 km wide, over theory",
        views: vec![View::new(scene, 64)],
        rows: vec![row],
    }
}
