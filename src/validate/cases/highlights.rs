//! Mirror images of small lamps and of the sun in smooth glass, which only camera paths find.

use super::{film, mean};
use crate::film::Film;
use crate::validate::optics::{fresnel, mirrored_in_ball};
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_4, PI, SQRT_2};

/// Index of the glass.
const N: f64 = 2.0;
/// Vertical field of view, degrees.
const FOV: f64 = 10.0;

pub(super) fn cases() -> Vec<Case> {
    vec![highlights()]
}

/// Glass that swallows what enters it.
fn scene(eye: [f64; 3], shape: Value, lights: Value, lamp: Option<Value>) -> Value {
    let shapes: Vec<Value> = std::iter::once(shape).chain(lamp).collect();
    json!({
        "film": film(16, 16, 1),
        "camera": {"perspective": {"eye": eye, "target": [0, 0, 0], "vfov_deg": FOV}},
        "materials": {"glass": {"dielectric": {"ior": N, "absorption": 1000}}},
        "lights": lights,
        "shapes": shapes,
    })
}

fn highlights() -> Case {
    let pane = || json!({"box": {"min": [-3, -1, -3], "max": [3, 0, 3]}, "material": "glass"});
    let sun = |towards: [f64; 3], angle_deg: f64| json!([{"sun": {"direction": towards.map(|x| -x), "angle_deg": angle_deg, "irradiance": 1}}]);
    // The picture's height at distance 1.
    let height = 2.0 * (0.5 * FOV.to_radians()).tan();
    let of_pane = fresnel(FRAC_PI_4, N);
    // A lamp as far behind the pane as the eye is before it.
    let (radius, distance) = (0.05, 4.0 * SQRT_2);
    let lamp = json!({"sphere": {"center": [2, 2, 0], "radius": radius}, "emission": {"radiance": 1}});
    let tan_squared = radius * radius / (distance * distance - radius * radius);
    // The ball turns the view by 60 degrees.
    let (far, turn) = (8.0, 60f64.to_radians());
    let ball = json!({"sphere": {"center": [0, 0, 0], "radius": 0.5}, "material": "glass"});
    let sun_in_ball = mean_over_disc(turn, 4f64.to_radians(), |turn| {
        let (incidence, spread) = mirrored_in_ball(far / 0.5, turn);
        fresnel(incidence, N) * spread
    });
    let view = |seed: u64, scene: Value| View { seed, ..View::new(scene, 400) };
    let row = |name: &str, i: usize, exact: f64| {
        Row::new(format!("highlights/{name}"), exact, 3e-2 * exact, move |f: &[Film]| vec![mean(&f[i])]).floor(1e-3 * exact)
    };
    Case {
        id: "highlights",
        title: "mirror images in smooth glass: of a small lamp in a pane, of the sun in a pane and in a ball",
        views: vec![
            view(1, scene([-2.0, 2.0, 0.0], pane(), json!([]), Some(lamp))),
            view(2, scene([0.0, 2.0, -2.0], pane(), sun([0.0, 1.0, 1.0], 0.5), None)),
            view(3, scene([0.0, 0.0, far], ball, sun([turn.sin(), 0.0, -turn.cos()], 8.0), None)),
        ],
        rows: vec![
            row("lamp-in-pane", 0, of_pane * PI * tan_squared / (height * height)),
            row("sun-in-pane", 1, of_pane / (height * height)),
            row("sun-in-ball", 2, sun_in_ball / (height * height)),
        ],
    }
}

/// Mean of what depends on the angle to an axis over directions within `radius`, of which the middle one is at `angle` to it.
fn mean_over_disc(angle: f64, radius: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 32;
    let middle = |i: usize| (i as f64 + 0.5) / STEPS as f64;
    let at = |i: usize, j: usize| {
        let cos = 1.0 - middle(i) * (1.0 - radius.cos());
        let across = (1.0 - cos * cos).sqrt() * (2.0 * PI * middle(j)).cos();
        f((cos * angle.cos() + across * angle.sin()).acos())
    };
    (0..STEPS * STEPS).map(|n| at(n / STEPS, n % STEPS)).sum::<f64>() / (STEPS * STEPS) as f64
}
