//! What a volume is: content, named or not, whatever bounds it; and which rules where several overlap.

use crate::{load_text, scene_with};
use abbe::scene::{Geometry, Material, Scene, advice, initial_interiors, ruling};
use glam::{DVec3, dvec3};
use serde_json::{Value, json};

fn loaded(materials: Value, volumes: Value, shapes: Value) -> Scene {
    load_text(&text(materials, volumes, shapes)).unwrap_or_else(|e| panic!("{e}"))
}

fn text(materials: Value, volumes: Value, shapes: Value) -> String {
    let mut scene: Value = serde_json::from_str(&scene_with("materials", &materials.to_string())).unwrap();
    scene["volumes"] = volumes;
    scene["shapes"] = shapes;
    scene["lights"] = json!([{"constant": {"radiance": 1}}]);
    scene.to_string()
}

fn ball(radius: f64, material: &str) -> Value {
    json!({"name": format!("{material} {radius}"), "sphere": {"center": [0, 0, 0], "radius": radius}, "material": material})
}

fn faces(materials: [&str; 6]) -> Vec<Value> {
    let sides = [
        [[-1, -1, 1], [2, 0, 0], [0, 2, 0]],
        [[1, -1, -1], [-2, 0, 0], [0, 2, 0]],
        [[-1, -1, -1], [0, 0, 2], [0, 2, 0]],
        [[1, -1, 1], [0, 0, -2], [0, 2, 0]],
        [[-1, 1, 1], [2, 0, 0], [0, 0, -2]],
        [[-1, -1, -1], [2, 0, 0], [0, 0, 2]],
    ];
    let face =
        |([corner, u, v], m): ([[i32; 3]; 3], &str)| json!({"quad": {"corner": corner, "edge_u": u, "edge_v": v}, "material": m});
    sides.into_iter().zip(materials).map(face).collect()
}

/// The interior of the volume that rules at a point, and how many bodies there are in all.
fn at(scene: &Scene, p: DVec3) -> (usize, usize) {
    let inside = initial_interiors(scene, &[p]).remove(0);
    (ruling(scene, &inside), inside.len())
}

#[test]
fn equal_content_is_one_volume_unless_it_has_names() {
    let materials = json!({
        "polished": {"dielectric": {"ior": 1.5, "absorption": 2}},
        "ground": {"dielectric": {"ior": {"cauchy": [1.5, 0]}, "absorption": 2, "roughness": 0.5}},
        "clear": {"dielectric": {"ior": 1.5}},
        "other": {"dielectric": {"ior": 1.5, "absorption": 2, "priority": 3}},
        "left": {"dielectric": {"volume": "left"}},
        "right": {"dielectric": {"volume": "right", "roughness": 0.2}},
        "fog": {"boundary": {"volume": "right"}},
    });
    let volumes = json!({"left": {"ior": 1.5, "absorption": 2}, "right": {"ior": 1.5, "absorption": 2}});
    let names = ["polished", "ground", "clear", "other", "left", "right", "fog"];
    let scene = loaded(materials, volumes, names.iter().map(|m| ball(0.5, m)).collect());
    let of: Vec<usize> = scene.shapes.iter().map(|s| scene.volume_of(s).unwrap()).collect();
    assert_eq!(of, [1, 1, 2, 3, 4, 5, 5], "in the order of the shapes");
    assert_eq!(scene.interiors.len(), 6);
    assert_eq!(scene.interiors[5].name, "right");
}

#[test]
fn a_mix_has_the_one_interior_of_its_parts_or_is_refused() {
    let materials = |m: Value| {
        json!({
            "a": {"dielectric": {"ior": 1.5}}, "b": {"dielectric": {"ior": 1.5, "roughness": 0.4}}, "c": {"dielectric": {"ior": 1.6}},
            "pane": {"thin_dielectric": {"ior": 1.5}}, "nothing": {"boundary": {}}, "paint": {"diffuse": {"reflectance": 0.5}},
            "left": {"dielectric": {"volume": "left"}}, "haze": {"boundary": {"volume": "left"}}, "m": m})
    };
    let mix = |a: &str, b: &str| materials(json!({"mix": {"a": a, "b": b, "weight": 0.5}}));
    let volumes = json!({"left": {"ior": 1.5}});
    for (a, b, interior) in [("a", "b", Some(1)), ("paint", "a", Some(1)), ("pane", "nothing", None), ("paint", "nothing", None)]
    {
        let scene = loaded(mix(a, b), volumes.clone(), json!([ball(1.0, "m")]));
        assert_eq!(scene.interior_of(scene.shapes[0].material), interior, "{a}, {b}");
    }
    for (a, b) in [("a", "c"), ("a", "pane"), ("nothing", "a"), ("a", "left"), ("left", "haze"), ("haze", "pane")] {
        let line = load_text(&text(mix(a, b), volumes.clone(), json!([ball(1.0, "m")]))).unwrap_err().to_string();
        assert!(line.starts_with("test.json: $.materials.m: a mix of ") && line.contains("thin_dielectric"), "{line}");
    }
}

#[test]
fn volumes_are_named_once() {
    let fails = |materials: Value, shape: Value, says: &[&str]| {
        let volumes = json!({"water": {"ior": 1.33}});
        let line = load_text(&text(materials, volumes, json!([shape]))).unwrap_err().to_string();
        assert!(says.iter().all(|part| line.contains(part)), "{line}");
    };
    let glass = |m: Value| json!({"m": {"dielectric": m}});
    fails(glass(json!({"volume": "water", "ior": 1.3})), ball(1.0, "m"), &["$.materials.m.dielectric.ior", "already says"]);
    fails(glass(json!({"volume": "wine"})), ball(1.0, "m"), &["$.materials.m.dielectric.volume", "unknown volume"]);
    fails(glass(json!({"roughness": 0.3})), ball(1.0, "m"), &["\"ior\" is missing"]);
    let mut wall = ball(1.0, "m");
    wall["volume"] = json!("water");
    fails(glass(json!({"ior": 1.5})), wall.clone(), &["$.shapes[0]", "bounds another volume"]);
    fails(json!({"m": {"thin_dielectric": {"ior": 1.5}}}), wall, &["light goes straight through"]);
}

#[test]
fn opaque_faces_close_a_volume() {
    let materials = || json!({"glass": {"dielectric": {"ior": 1.5}}, "mirror": {"conductor": {"reflectance": 1}}, "paint": {"diffuse": {"reflectance": 0.5}}});
    let walls = ["glass", "mirror", "paint", "mirror", "mirror", "mirror"];
    let closed = loaded(materials(), json!({}), faces(walls).into());
    assert_eq!(advice(&closed), Vec::<String>::new());
    assert_eq!(closed.shapes.iter().map(|s| s.interior).collect::<Vec<_>>(), [None, Some(1), Some(1), Some(1), Some(1), Some(1)]);
    assert_eq!([DVec3::ZERO, dvec3(0.0, -2.0, 0.0), dvec3(0.0, 2.0, 0.0)].map(|p| at(&closed, p)), [(1, 1), (0, 0), (0, 0)]);
    // A table that shares an edge with a solid is none of its faces.
    let mut shapes = faces(["glass"; 6]);
    shapes.push(json!({"quad": {"corner": [-1, -1, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 3]}, "material": "paint"}));
    let stands = loaded(materials(), json!({}), shapes.into());
    assert!(stands.shapes.iter().all(|s| s.interior.is_none()));
    // Nor does it keep the walls of one from being found, whatever way they are turned.
    let mut shapes = faces(walls);
    for face in &mut shapes[2..4] {
        let quad = &mut face["quad"];
        let u = quad["edge_u"].clone();
        quad["edge_u"] = quad["edge_v"].take();
        quad["edge_v"] = u;
    }
    shapes.push(json!({"quad": {"corner": [-1, -1, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 3]}, "material": "paint"}));
    let turned = loaded(materials(), json!({}), shapes.into());
    assert_eq!(turned.shapes.iter().filter(|s| s.interior == Some(1)).count(), 5);
    assert_eq!([DVec3::ZERO, dvec3(0.0, -2.0, 0.0), dvec3(-2.0, 0.0, 0.0)].map(|p| at(&turned, p)), [(1, 1), (0, 0), (0, 0)]);
    // A mirror between two solids bounds both.
    let mut shapes = faces(["mirror", "glass", "glass", "glass", "glass", "glass"]);
    for (mut face, (m, z)) in
        faces(["mirror"; 6]).into_iter().zip([("flint", 2), ("", 0), ("flint", 2), ("flint", 2), ("flint", 2), ("flint", 2)])
    {
        if z > 0 {
            let z = face["quad"]["corner"][2].as_f64().unwrap() + f64::from(z);
            face["quad"]["corner"][2] = json!(z);
            face["material"] = json!(m);
            shapes.push(face);
        }
    }
    let mut both = materials();
    both["flint"] = json!({"dielectric": {"ior": 1.7}});
    let both = loaded(both, json!({}), shapes.into());
    assert_eq!([-0.5, 1.5, 3.5].map(|z| at(&both, dvec3(0.0, 0.0, z)).1), [1, 1, 0]);
    assert_eq!(advice(&both), Vec::<String>::new());
    // Without one face it is open.
    let open = loaded(materials(), json!({}), faces(walls)[..5].to_vec().into());
    assert!(open.shapes.iter().all(|s| s.interior.is_none()) && advice(&open).iter().any(|line| line.contains("has a hole")));
    // By its name a wall bounds what it is said to.
    let mut named = faces(["glass", "mirror", "mirror", "mirror", "mirror", "mirror"]);
    named.iter_mut().skip(1).for_each(|face| face["volume"] = json!("flint"));
    let flint = loaded(
        json!({"glass": {"dielectric": {"volume": "flint"}}, "mirror": {"conductor": {"reflectance": 1}}}),
        json!({"flint": {"ior": 1.7}}),
        named.into(),
    );
    assert_eq!(at(&flint, DVec3::ZERO), (1, 1));
}

#[test]
fn bodies_within_bodies_of_equal_priority_rule_there() {
    let materials = || json!({"water": {"dielectric": {"ior": 1.33}}, "glass": {"dielectric": {"ior": 1.5}}});
    let bodies = [ball(1.0, "water"), ball(0.7, "glass"), ball(0.3, "water")];
    for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2], [1, 2, 0]] {
        let scene = loaded(materials(), json!({}), order.map(|i| bodies[i].clone()).to_vec().into());
        assert_eq!(scene.interiors.len(), 4, "the drop is a volume of its own");
        let names = [0.1, 0.5, 0.9].map(|x| {
            let volume = &scene.interiors[at(&scene, dvec3(x, 0.0, 0.0)).0];
            (volume.name.clone(), volume.depth)
        });
        assert_eq!(names, [("water".into(), 2), ("glass".into(), 1), ("water".into(), 0)], "{order:?}");
        assert_eq!(advice(&scene), Vec::<String>::new());
    }
    // Shells of one content are one volume.
    let shells: Vec<Value> = (1..6).map(|i| ball(0.2 * f64::from(i), "glass")).collect();
    let scene = loaded(materials(), json!({}), shells.into());
    let volumes = scene.interiors.iter().filter(|i| i.name == "glass").count();
    assert_eq!((volumes, at(&scene, DVec3::ZERO)), (1, (1, 5)));
    // A greater priority rules whatever lies where.
    let strong = json!({"water": {"dielectric": {"ior": 1.33, "priority": 2}}, "glass": {"dielectric": {"ior": 1.5}}});
    let scene = loaded(strong, json!({}), bodies[..2].to_vec().into());
    assert_eq!(scene.interiors[at(&scene, DVec3::ZERO).0].name, "water");
}

#[test]
fn parts_of_one_mesh_may_lie_at_different_depths() {
    // Two boxes in one file, one of them within a box of other glass.
    let here = std::env::temp_dir().join(format!("abbe-depths-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let mut obj = String::new();
    for (i, x) in [0.0, 5.0].into_iter().enumerate() {
        for corner in 0..8u32 {
            let side = |bit: u32| if corner >> bit & 1 == 1 { 0.4 } else { -0.4 };
            obj += &format!("v {} {} {}\n", x + side(0), side(1), side(2));
        }
        for f in [[1, 5, 7, 3], [2, 4, 8, 6], [1, 2, 6, 5], [3, 7, 8, 4], [1, 3, 4, 2], [5, 6, 8, 7]] {
            let [a, b, c, d] = f.map(|v| v + 8 * i);
            obj += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    std::fs::write(here.join("two.obj"), obj).unwrap();
    let mut scene: Value = serde_json::from_str(&scene_with(
        "materials",
        r#"{"crown": {"dielectric": {"ior": 1.5}}, "flint": {"dielectric": {"ior": 1.7}}}"#,
    ))
    .unwrap();
    scene["lights"] = json!([{"constant": {"radiance": 1}}]);
    scene["shapes"] = json!([{"mesh": {"file": "two.obj"}, "material": "flint"}, ball(1.0, "crown")]);
    let scene = abbe::scene::load_str(&scene.to_string(), "t.json".as_ref(), &here, &Default::default()).unwrap();
    std::fs::remove_dir_all(&here).unwrap();
    let triangles = |s: &abbe::scene::Shape| if let Geometry::Mesh(mesh) = &s.geometry { mesh.triangles.len() } else { 0 };
    assert_eq!(scene.shapes.iter().map(triangles).collect::<Vec<_>>(), [12, 12, 0]);
    let depth = |x: f64| scene.interiors[at(&scene, dvec3(x, 0.0, 0.0)).0].depth;
    assert_eq!([0.0, 0.8, 5.0].map(depth), [1, 0, 0]);
    assert_eq!(scene.interiors.iter().filter(|i| i.name == "flint").count(), 2);
    assert!(scene.materials.iter().filter(|m| matches!(m, Material::Dielectric { .. })).count() == 3);
}

#[test]
fn bodies_that_only_overlap_are_said_and_the_later_rules() {
    let materials = || json!({"a": {"dielectric": {"ior": 1.5}}, "b": {"dielectric": {"ior": 1.6}}});
    let at_x = |x: f64, m: &str| json!({"name": m, "sphere": {"center": [x, 0, 0], "radius": 0.5}, "material": m});
    for (first, second) in [("a", "b"), ("b", "a")] {
        let scene = loaded(materials(), json!({}), json!([at_x(0.0, first), at_x(0.4, second)]));
        assert_eq!(scene.interiors[at(&scene, dvec3(0.2, 0.0, 0.0)).0].name, second);
        let lines = advice(&scene);
        let says = format!("{first:?} and {second:?} overlap with the same priority, and there {second:?} rules");
        assert!(lines.len() == 1 && lines[0].starts_with(&says), "{lines:?}");
    }
    // Apart, or of one volume, or of different priorities nothing is to be said.
    for (x, m) in [(1.1, "b"), (0.4, "a")] {
        assert_eq!(advice(&loaded(materials(), json!({}), json!([at_x(0.0, "a"), at_x(x, m)]))), Vec::<String>::new());
    }
    let ranked = json!({"a": {"dielectric": {"ior": 1.5}}, "b": {"dielectric": {"ior": 1.6, "priority": 2}}});
    assert_eq!(advice(&loaded(ranked, json!({}), json!([at_x(0.0, "a"), at_x(0.4, "b")]))), Vec::<String>::new());
    // Boxes that stand side by side have a face in common, and nothing else.
    let boxes = json!([{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "material": "a"}, {"box": {"min": [1, 0, 0], "max": [2, 1, 1]}, "material": "b"}]);
    assert_eq!(advice(&loaded(materials(), json!({}), boxes)), Vec::<String>::new());
    // On the ground of the glass that it is in.
    let drop = json!([{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "material": "a"}, {"box": {"min": [0.2, 0, 0.2], "max": [0.5, 0.5, 0.5]}, "material": "b"}]);
    assert_eq!(advice(&loaded(materials(), json!({}), drop)), Vec::<String>::new());
}
