//! What `abbe check` warns of, each with a scene that has it and one that has not.

use crate::{folder, load_text, scene_with, shipped};
use abbe::scene::{LoadOptions, Scene, advice, load};
use serde_json::{Value, json};

/// A lit glass ball over a table, with `more` added to its lists and objects.
pub(crate) fn scene(more: Value) -> Scene {
    let mut all = json!({
        "film": {"width": 8, "height": 8},
        "camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 0, 0], "vfov_deg": 40}},
        "materials": {"paper": {"diffuse": {"reflectance": 0.8}}, "glass": {"dielectric": {"ior": 1.5}}, "other": {"dielectric": {"ior": 1.6}}},
        "shapes": [
            {"name": "table", "quad": {"corner": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4]}, "material": "paper"},
            {"name": "ball", "sphere": {"center": [0, 0.5, 0], "radius": 0.4}, "material": "glass"},
            {"name": "lamp", "quad": {"corner": [-0.5, 2, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}, "emission": {"radiance": 1}}],
        "lights": [{"point": {"position": [1, 2, 1], "intensity": 1}}],
    });
    for (key, value) in more.as_object().expect("an object") {
        match (&mut all[key], value) {
            (Value::Array(list), Value::Array(more)) => list.extend(more.clone()),
            (old, new) => *old = new.clone(),
        }
    }
    abbe::scene::load_str(&all.to_string(), "t.json".as_ref(), &folder("tests/data/scenes"), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Exactly one warning, which says all this.
pub(crate) fn warns(scene: &Scene, says: &[&str]) {
    let found = advice(scene);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(says.iter().all(|part| found[0].contains(part)) && found[0].contains("; "), "{says:?}: {found:?}");
}

pub(crate) fn is_silent(scene: &Scene) {
    assert_eq!(advice(scene), Vec::<String>::new());
}

#[test]
fn scenes_that_ship_get_no_advice() {
    is_silent(&scene(json!({})));
    for path in shipped() {
        let scene = load(&path, &LoadOptions::default()).unwrap();
        assert_eq!(advice(&scene), Vec::<String>::new(), "{}", path.display());
    }
}

#[test]
fn a_scene_without_light_is_dark() {
    let text = scene_with("lights", "[]");
    warns(&load_text(&text).unwrap(), &["black", "add \"lights\""]);
    warns(&load_text(&scene_with("lights", r#"[{"constant": {"radiance": 0}}]"#)).unwrap(), &["black"]);
    is_silent(&load_text(&scene_with("lights", r#"[{"constant": {"radiance": 1}}]"#)).unwrap());
}

#[test]
fn open_glass_has_a_hole() {
    // The sides of a box one by one: together they are closed, without one of them they are not.
    let side = |corner: [f64; 3], u: [f64; 3], v: [f64; 3]| json!({"name": "side", "quad": {"corner": corner, "edge_u": u, "edge_v": v}, "material": "other"});
    let (x, y, z) = ([0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.2]);
    let sides = [
        side([1.0, 0.5, 0.0], z, y),
        side([1.2, 0.5, 0.0], y, z),
        side([1.0, 0.5, 0.0], x, z),
        side([1.0, 0.7, 0.0], z, x),
        side([1.0, 0.5, 0.0], y, x),
        side([1.0, 0.5, 0.2], x, y),
    ];
    is_silent(&scene(json!({"shapes": sides})));
    warns(&scene(json!({"shapes": sides[..5]})), &["\"other\" has a hole (4 edges", "close the mesh"]);
    let tube = |capped: bool| json!({"shapes": [{"name": "tube", "cylinder": {"base": [1, 0.5, 0], "top": [1, 1, 0], "radius": 0.1, "capped": capped}, "material": "other"}]});
    warns(&scene(tube(false)), &["\"tube\"", "\"capped\": true"]);
    is_silent(&scene(tube(true)));
    // The surface of water is a sheet.
    let sheet = |up: f64| json!({"shapes": [side([-1.0, 1.5, up], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0 * up])]});
    is_silent(&scene(sheet(1.0)));
    warns(&scene(sheet(-1.0)), &["has a hole"]);
}

#[test]
fn faces_turned_different_ways_are_said() {
    let mesh = |turned: bool| {
        let last = if turned { "f 5 2 3\n" } else { "f 5 3 2\n" };
        // The corner at the origin is there twice, as in seams.
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv -1e-9 1e-9 0\n{last}f 1 2 4\nf 2 3 4\nf 3 1 4\n");
        let here = std::env::temp_dir().join(format!("abbe-advice-{turned}-{}", std::process::id()));
        std::fs::create_dir_all(&here).unwrap();
        std::fs::write(here.join("a.obj"), text).unwrap();
        let text = r#"{"camera": {"orthographic": {"eye": [0, 0, 9], "target": [0, 0, 0], "height": 2}}, "lights": [{"constant": {"radiance": 1}}],
            "materials": {"stone": {"dielectric": {"ior": 1.5}}}, "shapes": [{"mesh": {"file": "a.obj"}, "material": "stone"}]}"#;
        let scene = abbe::scene::load_str(text, "t.json".as_ref(), &here, &LoadOptions::default()).unwrap();
        std::fs::remove_dir_all(&here).unwrap();
        scene
    };
    warns(&mesh(true), &["\"stone\" are turned different ways", "Recalculate"]);
    is_silent(&mesh(false));
}

#[test]
fn solids_that_face_inwards_are_said_whatever_they_are_made_of() {
    let pyramid = |material: &str, turned: bool| {
        let [a, b] = if turned { [3, 2] } else { [2, 3] };
        let text = format!("v 1 0.2 0\nv 1.2 0.2 0\nv 1 0.4 0\nv 1 0.2 0.2\nf 1 {b} {a}\nf 1 {a} 4\nf {a} {b} 4\nf {b} 1 4\n");
        let here = std::env::temp_dir().join(format!("abbe-inwards-{material}-{turned}-{}", std::process::id()));
        std::fs::create_dir_all(&here).unwrap();
        std::fs::write(here.join("a.obj"), text).unwrap();
        let text = json!({"camera": {"orthographic": {"eye": [0, 0, 9], "target": [0, 0, 0], "height": 2}}, "lights": [{"constant": {"radiance": 1}}],
            "materials": {"glass": {"dielectric": {"ior": 1.5}}, "paint": {"diffuse": {"reflectance": 0.5}},
                          "dirty": {"mix": {"a": "glass", "b": "paint", "weight": 0.5}}},
            "shapes": [{"name": "pyramid", "mesh": {"file": "a.obj"}, "material": material}]});
        let scene = abbe::scene::load_str(&text.to_string(), "t.json".as_ref(), &here, &LoadOptions::default());
        std::fs::remove_dir_all(&here).unwrap();
        scene.unwrap()
    };
    for glass in ["glass", "dirty"] {
        warns(&pyramid(glass, true), &["\"pyramid\" face inwards", "Recalculate Outside"]);
        is_silent(&pyramid(glass, false));
    }
    is_silent(&pyramid("paint", true));
}

#[test]
fn what_is_wrong_a_thousand_times_is_said_a_few_times_and_counted_at_once() {
    let start = std::time::Instant::now();
    let lamp = |i: u32| json!({"point": {"position": [0.0, 0.5, 0.0001 * f64::from(i)], "intensity": 1}});
    let found = advice(&scene(json!({"lights": (0..100).map(lamp).collect::<Vec<_>>()})));
    assert_eq!(found.len(), 6, "{found:?}");
    assert!(found[5].contains("and 95 more"), "{found:?}");
    // 60,000 glasses, each with a ball of its own: it is not to take the time of all pairs of them.
    let name = |i: u32| format!("g{i}");
    let glasses: serde_json::Map<String, Value> = (0..60_000).map(|i| (name(i), json!({"dielectric": {"ior": 1.5}}))).collect();
    let ball = |i: u32| json!({"sphere": {"center": [i % 300, i / 300, 0], "radius": 0.4}, "material": name(i)});
    let text = json!({"camera": {"orthographic": {"eye": [0, 0, 9], "target": [0, 0, 0], "height": 2}}, "lights": [{"constant": {"radiance": 1}}],
        "materials": glasses, "shapes": (0..60_000).map(ball).collect::<Vec<_>>()});
    is_silent(&load_text(&text.to_string()).unwrap());
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn a_lamp_in_the_plane_of_the_ceiling_is_said() {
    let ceiling = |y: f64| json!({"shapes": [{"name": "ceiling", "quad": {"corner": [-2, y, -2], "edge_u": [4, 0, 0], "edge_v": [0, 0, 4]}, "material": "paper"}]});
    warns(&scene(ceiling(2.0)), &["\"lamp\" and \"ceiling\" overlap", "move them apart"]);
    is_silent(&scene(ceiling(2.01)));
    // Neighbours share an edge, not an area; a box stands on the table back to back.
    let beside = json!({"shapes": [
        {"quad": {"corner": [2, 0, 2], "edge_u": [1, 0, 0], "edge_v": [0, 0, -4]}, "material": "paper"},
        {"box": {"min": [1, 0, 0], "max": [1.5, 0.5, 0.5]}, "material": "paper"}]});
    is_silent(&scene(beside));
}

#[test]
fn a_lamp_in_glass_is_said() {
    let point = |y: f64| json!({"lights": [{"point": {"position": [0, y, 0], "intensity": 1}}]});
    warns(&scene(point(0.5)), &["a point light lies inside \"glass\"", "move it out"]);
    is_silent(&scene(point(1.0)));
    let bulb = |y: f64| json!({"shapes": [{"name": "bulb", "sphere": {"center": [0, y, 0], "radius": 0.05}, "emission": {"radiance": 1}}]});
    warns(&scene(bulb(0.5)), &["the lamp \"bulb\" lies inside \"glass\""]);
    is_silent(&scene(bulb(1.0)));
}

#[test]
fn millimetres_are_suspected() {
    let lens = |radius: f64| json!({"shapes": [{"name": "lens", "sphere": {"center": [0, 300, 0], "radius": radius}, "material": "other"}]});
    warns(&scene(lens(51.0)), &["\"lens\" is 102 m across", "scale everything by 0.001"]);
    is_silent(&scene(lens(0.051)));
    let far = |size: f64| json!({"shapes": [{"quad": {"corner": [3, -1, 0], "edge_u": [size, 0, 0], "edge_v": [0, 0, -1]}, "material": "paper"}]});
    warns(&scene(far(1500.0)), &["the scene is", "millimetres"]);
    is_silent(&scene(far(500.0)));
}
