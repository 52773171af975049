//! Paths look for the volumes that they start in only where a sensor or lamp meets the boundary of one.

use super::support::*;
use abbe::integrator::{Feature, Plan, Techniques};
use serde_json::{Value, json};

/// Whether paths from the sensor, and from lights, look; and whether a lamp lies in a surface.
fn looks(more: Value) -> [bool; 3] {
    let mut scene = json!({"materials": {"glass": {"dielectric": {"ior": 1.5}}}, "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "glass"}]});
    merge(&mut scene, more);
    let plan = Plan::new(&scene_of(scene), Techniques::default());
    let light = plan.light.is_some_and(|f| f.has(Feature::StartVolumes));
    [plan.has(Feature::StartVolumes), light, plan.has(Feature::TouchedLights)]
}

fn lamp(shape: &str, geometry: Value) -> Value {
    json!({"shapes": [{shape: geometry, "emission": {"radiance": 1}}]})
}

fn view(y: f64, z: f64) -> Value {
    json!({"camera": {"orthographic": {"eye": [0, y, z], "target": [0, y, -9], "height": 0.5}}, "lights": [{"constant": {"radiance": 1}}]})
}

#[test]
fn paths_look_for_their_volumes_only_where_a_start_meets_a_boundary() {
    let (none, sensor, lights) = ([false; 3], [true, false, false], [false, true, false]);
    // The view plane: across the ball, before it, in its middle, and at a corner of its box.
    assert_eq!(looks(view(1.5, 0.0)), sensor);
    assert_eq!(looks(view(1.0, 0.6)), none);
    assert_eq!(looks(json!({"camera": {"orthographic": {"eye": [0, 1, 0], "target": [0, 1, -9], "height": 0.2}}})), none);
    assert_eq!(looks(json!({"camera": {"irradiance_sphere": {"center": [0, 1, 0], "radius": 0.49}}})), none);
    // A pinhole is a point.
    assert_eq!(looks(json!({"camera": {"perspective": {"eye": [0, 1.4, 0], "target": [0, 1, 9], "vfov_deg": 9}}})), none);
    // Lamps across the ball, in it, around it and beside it.
    let sphere = |radius: f64, x: f64| lamp("sphere", json!({"center": [x, 1, 0], "radius": radius}));
    assert_eq!(looks(sphere(0.3, 0.4)), lights);
    assert_eq!(looks(sphere(0.3, 0.1)), none);
    assert_eq!(looks(sphere(0.3, 0.9)), none);
    assert_eq!(looks(lamp("quad", json!({"corner": [-1, 1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 0, 1]}))), lights);
    let beam =
        |x: f64| json!({"lights": [{"beam": {"origin": [x, 1, 0], "direction": [0, -1, 0], "radius": 0.2, "irradiance": 1}}]});
    assert_eq!(looks(beam(0.4)), lights);
    assert_eq!(looks(beam(0.1)), none);
    // Fog that fills the room is around all that is in it.
    let fog = json!({"media": {"fog": {"sigma_s": 1}}, "materials": {"fog": {"boundary": {"medium": "fog"}}},
                     "shapes": [{"box": {"min": [-2.9, 0.1, -2.9], "max": [2.9, 3.9, 4.9]}, "material": "fog"},
                                {"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.2}, "emission": {"radiance": 1}}]});
    assert_eq!(looks(fog), none);
    // In the ceiling, and a hair below.
    let ceiling = |y: f64| lamp("quad", json!({"corner": [-1, y, 0], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}));
    assert_eq!(looks(ceiling(4.0)), [false, false, true]);
    assert_eq!(looks(ceiling(3.999)), none);
    // On the ball, as a skin.
    assert_eq!(looks(sphere(0.5, 0.0)), [false, true, true]);
}
