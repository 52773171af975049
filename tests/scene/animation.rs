//! Animations of glTF files: nodes and cameras stand where the specification (glTF 2.0, 3.11 and appendix C) has them at a frame's time.

use crate::gltf::{base64, document};
use abbe::scene::{Geometry, LoadOptions, Scene, Sensor, load};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Node, path, interpolation, times and values.
type Channel<'a> = (usize, &'a str, &'a str, &'a [f32], &'a [f32]);

/// What is changed about an animation, and what the error then says.
type Mistake<'a> = (&'a dyn Fn(&mut Value), &'a str);

/// A file of the square, whose node 0 carries it two units large, with an animation.
fn animated(channels: &[Channel]) -> Value {
    let mut document = document();
    let mut bytes: Vec<u8> = Vec::new();
    let mut number = |values: &[f32], kind: &str, components: usize| {
        let offset = bytes.len();
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        let view = document["bufferViews"].as_array_mut().unwrap();
        view.push(json!({"buffer": 1, "byteOffset": offset, "byteLength": 4 * values.len()}));
        let view = view.len() - 1;
        let accessors = document["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"bufferView": view, "componentType": 5126, "count": values.len() / components, "type": kind}));
        accessors.len() - 1
    };
    let (mut list, mut samplers) = (Vec::new(), Vec::new());
    for (node, path, interpolation, times, values) in channels {
        let (kind, components) = match *path {
            "rotation" => ("VEC4", 4),
            "weights" => ("SCALAR", 1),
            _ => ("VEC3", 3),
        };
        let (input, output) = (number(times, "SCALAR", 1), number(values, kind, components));
        list.push(json!({"sampler": samplers.len(), "target": {"node": node, "path": path}}));
        samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    }
    document["buffers"]
        .as_array_mut()
        .unwrap()
        .push(json!({"byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes))}));
    document["animations"] = json!([{"channels": list, "samplers": samplers}]);
    document
}

fn at(name: &str, document: &Value, frame: Option<u32>, rate: f64) -> abbe::Result<Scene> {
    let path: PathBuf = std::env::temp_dir().join(format!("abbe-{name}-{}.gltf", std::process::id()));
    std::fs::write(&path, document.to_string()).unwrap();
    let scene = load(&path, &LoadOptions { frame, frames_per_second: Some(rate), ..LoadOptions::default() });
    std::fs::remove_file(&path).unwrap();
    scene
}

/// The corner that lies at (2, 2, -1) at rest.
fn corner(scene: &Scene) -> DVec3 {
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    mesh.positions[2]
}

fn is_near(a: DVec3, b: [f64; 3]) -> bool {
    (a - DVec3::from_array(b)).length() < 1e-6
}

#[test]
fn nodes_move_by_lines_steps_and_cubic_splines() {
    let document = animated(&[
        // After 1 s and 3 s; before and after it stays.
        (0, "translation", "LINEAR", &[1., 3.], &[0., 0., 0., 4., 0., -2.]),
        (1, "scale", "STEP", &[0., 2.], &[2., 2., -2., 1., 3., -2.]),
    ]);
    for (frame, place) in [(0, [2., 2., 0.]), (4, [2., 2., 0.]), (7, [3.5, 2., -0.75]), (8, [3., 3., -1.]), (40, [5., 3., -2.])] {
        let scene = at("lines", &document, Some(frame), 4.0).unwrap_or_else(|e| panic!("{e}"));
        assert!(is_near(corner(&scene), place), "frame {frame}: {}", corner(&scene));
        assert_eq!(scene.notes, Vec::<String>::new());
    }
    let at_rest = at("lines", &document, None, 4.0).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(corner(&at_rest), DVec3::new(2.0, 2.0, -1.0));
    assert!(at_rest.notes.iter().any(|note| note.contains("--frames")), "{:?}", at_rest.notes);

    // The cubic with f(0) = 0, f'(0) = 3, f(2) = 4, f'(2) = -1 is 3 t + t^2 / 2 - t^3 / 2.
    let spline = [9., 9., 9., 0., 0., 0., 3., 0., 0., -1., 0., 0., 4., 0., 0., 7., 7., 7.];
    let document = animated(&[(0, "translation", "CUBICSPLINE", &[0., 2.], &spline)]);
    for frame in [0, 1, 2, 3, 4, 9] {
        let t = (0.5 * f64::from(frame)).min(2.0);
        let scene = at("spline", &document, Some(frame), 2.0).unwrap_or_else(|e| panic!("{e}"));
        assert!(
            is_near(corner(&scene), [2.0 + 3.0 * t + 0.5 * t * t - 0.5 * t * t * t, 2., 0.]),
            "frame {frame}: {}",
            corner(&scene)
        );
    }
}

#[test]
fn rotations_take_the_shorter_arc_and_stay_rotations() {
    let half = 0.5f32.sqrt();
    // A quarter turn about z, written with the other sign; LINEAR is an even turn.
    let document = animated(&[(0, "rotation", "LINEAR", &[0., 3.], &[0., 0., 0., 1., 0., 0., -half, -half])]);
    for (frame, degrees) in [(0, 0.0), (1, 30.0), (2, 60.0), (3, 90.0)] {
        let scene = at("arc", &document, Some(frame), 1.0).unwrap_or_else(|e| panic!("{e}"));
        let (sin, cos) = f64::to_radians(degrees + 45.0).sin_cos();
        let place = [8f64.sqrt() * cos, 8f64.sqrt() * sin, -1.0];
        assert!(is_near(corner(&scene), place), "frame {frame}: {} for {place:?}", corner(&scene));
    }
    // A cubic one between the same ends, without slopes: halfway is half the turn, of length 1 again.
    let spline = [&[0.; 4][..], &[0., 0., 0., 1.], &[0.; 4], &[0.; 4], &[0., 0., half, half], &[0.; 4]].concat();
    let document = animated(&[(0, "rotation", "CUBICSPLINE", &[0., 2.], &spline)]);
    let scene = at("cubic", &document, Some(1), 1.0).unwrap_or_else(|e| panic!("{e}"));
    assert!(is_near(corner(&scene), [0.0, 8f64.sqrt(), -1.0]), "{}", corner(&scene));
}

#[test]
fn cameras_move_and_one_that_the_file_lacks_stands_still() {
    let mut document = animated(&[
        (2, "translation", "LINEAR", &[0., 1.], &[0., 0., 5., 3., 0., 5.]),
        (0, "translation", "LINEAR", &[0., 1.], &[0., 0., 0., 50., 0., 0.]),
    ]);
    let eye =
        |document: &Value, frame: u32| match at("camera", document, Some(frame), 24.0).unwrap_or_else(|e| panic!("{e}")).sensor {
            Sensor::Perspective { eye, .. } => eye,
            _ => panic!("another sensor"),
        };
    assert!(is_near(eye(&document, 12), [1.5, 0., 5.]), "{}", eye(&document, 12));
    document["nodes"][2].as_object_mut().unwrap().remove("camera");
    assert_eq!(eye(&document, 24), eye(&document, 0));
}

#[test]
fn what_cannot_move_is_told() {
    let mut document = animated(&[
        (0, "translation", "LINEAR", &[0., 1.], &[0., 0., 0., 1., 0., 0.]),
        (0, "weights", "LINEAR", &[0., 1.], &[0., 1.]),
        (0, "translation", "LINEAR", &[0., 1.], &[0., 0., 0., 9., 0., 0.]),
    ]);
    document["animations"][0]["channels"].as_array_mut().unwrap().push(json!({"sampler": 0, "target": {"path": "pointer"}}));
    let scene = at("notes", &document, Some(1), 1.0).unwrap_or_else(|e| panic!("{e}"));
    assert!(is_near(corner(&scene), [3., 2., 0.]), "{}", corner(&scene));
    for word in ["weights", "the first one counts", "other things than nodes"] {
        assert_eq!(scene.notes.iter().filter(|note| note.contains(word)).count(), 1, "{word}: {:?}", scene.notes);
    }

    let moved = |change: &dyn Fn(&mut Value)| {
        let mut document = animated(&[(0, "rotation", "LINEAR", &[0., 1.], &[0., 0., 0., 1., 0., 0., 1., 0.])]);
        change(&mut document["animations"][0]);
        // At rest it is read all the same.
        at("wrong", &document, None, 1.0).unwrap_or_else(|e| panic!("{e}"));
        at("wrong", &document, Some(0), 1.0).map(|_| ()).expect_err("an error").to_string()
    };
    let changes: [Mistake; 6] = [
        (&|a| a["channels"][0]["sampler"] = 7.into(), "no such sampler"),
        (&|a| a["channels"][0]["target"]["node"] = 70.into(), "no element 70"),
        (&|a| a["channels"][0]["target"]["path"] = "colour".into(), "no property"),
        (&|a| a["channels"][0]["target"]["path"] = "scale".into(), "VEC4"),
        (&|a| a["samplers"][0]["interpolation"] = "CUBICSPLINE".into(), "2 values for 2 keyframes"),
        (&|a| a["samplers"][0]["input"] = 99.into(), "no element 99"),
    ];
    for (change, word) in changes {
        let line = moved(change);
        assert!(line.contains(word) && line.contains("$.") && line.contains("; "), "no '{word}' in {line}");
    }
}
