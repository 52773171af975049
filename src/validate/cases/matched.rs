//! Volumes of the index around them, which nobody sees: a lamp of no size above a floor, a ball between the two, and between the floor and the eye.

use super::{film, mean};
use crate::film::Film;
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// What is inside, and what surrounds it.
const BALLS: [(&str, &str, &str); 8] = [
    ("vacuum", r#"{"ior": 1}"#, r#"{"ior": 1}"#),
    ("vacuum-rough", r#"{"ior": 1, "roughness": 0.3}"#, r#"{"ior": 1}"#),
    ("nearly", r#"{"ior": 1.0000001}"#, r#"{"ior": 1}"#),
    ("nearly-rough", r#"{"ior": 0.9999999, "roughness": 0.3}"#, r#"{"ior": 1}"#),
    ("water", r#"{"ior": {"cauchy": [1.33, 0]}}"#, r#"{"ior": 1.33}"#),
    ("water-rough", r#"{"ior": 1.33, "roughness": 0.6}"#, r#"{"ior": {"cauchy": [1.33, 0]}}"#),
    ("glass", r#"{"ior": "N-SF11"}"#, r#"{"ior": "N-SF11"}"#),
    ("glass-rough", r#"{"ior": "N-SF11", "roughness": 0.1}"#, r#"{"ior": "N-SF11"}"#),
];

pub(super) fn cases() -> Vec<Case> {
    vec![shadow(), absorbing()]
}

/// Lamp, ball and floor. `eye` looks at the floor right below the lamp.
fn scene(eye: [f64; 3], ball: Value, surroundings: Value) -> Value {
    json!({
        "film": film(2, 2, 4),
        "camera": {"orthographic": {"eye": eye, "target": [0, 0, 0], "height": 0.01}},
        "surroundings": surroundings,
        "materials": {"floor": {"diffuse": {"reflectance": 0.5}}, "ball": {"dielectric": ball}},
        "shapes": [
            {"disc": {"center": [0, 0, 0], "normal": [0, 1, 0], "radius": 2}, "material": "floor"},
            {"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "ball"},
        ],
        "lights": [{"point": {"position": [0, 3, 0], "intensity": 1}}],
    })
}

/// Irradiance of the floor, times the square of the lamp's distance.
fn irradiance(film: &Film) -> f64 {
    mean(film) * PI / 0.5 * 9.0
}

fn shadow() -> Case {
    let parse = |text: &str| serde_json::from_str(text).unwrap_or_default();
    let view = |(_, ball, around): &(&str, &str, &str)| View::new(scene([1.0, 3.0, 0.0], parse(ball), parse(around)), 16);
    let row = |(i, (name, ..)): (usize, &(&str, &str, &str))| {
        Row::new(format!("matched-shadow/{name}"), 1.0, 2e-3, move |f: &[Film]| vec![irradiance(&f[i])]).floor(1e-4)
    };
    Case {
        id: "matched-shadow",
        title: "irradiance under a ball of the index around it, seen through the ball, over that without it",
        views: BALLS.iter().map(view).collect(),
        rows: BALLS.iter().enumerate().map(row).collect(),
    }
}

/// Index 1 all the same absorbs: over 1 m on the way of the light, and as much of the view through its middle.
fn absorbing() -> Case {
    let views = [[3.0, 3.0, 0.0], [0.0, 3.0, 0.01]].map(|eye| {
        let ball = json!({"ior": 1, "absorption": 0.7});
        View::new(scene(eye, ball, json!({"ior": 1})), 16)
    });
    let row = |i: usize, name: &str, length: f64| {
        let exact = (-0.7 * length).exp();
        Row::new(format!("matched-absorbing/{name}"), exact, 2e-3 * exact, move |f: &[Film]| vec![irradiance(&f[i])]).floor(1e-4)
    };
    Case {
        id: "matched-absorbing",
        title: "the same, absorbing 0.7 of light per metre: light that crossed it once, and seen through it",
        views: views.into(),
        rows: vec![row(0, "light", 1.0), row(1, "light-and-view", 2.0)],
    }
}
