//! What is inside counts, whatever bounds it: solids of several materials, copies that overlap, bodies within bodies.

use super::{film, mean};
use crate::film::Film;
use crate::scene::{Geometry, Mesh, Scene, Shape};
use crate::validate::{Case, Row, View};
use glam::DVec3;
use serde_json::{Value, json};
use std::sync::Arc;

pub(super) fn cases() -> Vec<Case> {
    vec![unseen(), absorbing()]
}

/// A view of the sky of radiance 1 along -z.
fn scene(materials: Value, shapes: Value, height: f64) -> Value {
    json!({
        "film": film(4, 4, 4),
        "camera": {"orthographic": {"eye": [0.013, 0.007, 4], "target": [0.013, 0.007, 0], "height": height}},
        "max_depth": 500,
        "materials": materials,
        "shapes": shapes,
        "lights": [{"constant": {"radiance": 1}}],
    })
}

/// The faces of a box of 2 m, that towards the eye first.
fn faces(front: &str, others: &str) -> Value {
    let quad = |corner: [i32; 3], u: [i32; 3], v: [i32; 3], material: &str| json!({"quad": {"corner": corner, "edge_u": u, "edge_v": v}, "material": material});
    json!([
        quad([-1, -1, 1], [2, 0, 0], [0, 2, 0], front),
        quad([1, -1, -1], [-2, 0, 0], [0, 2, 0], others),
        quad([-1, -1, -1], [0, 0, 2], [0, 2, 0], others),
        quad([1, -1, 1], [0, 0, -2], [0, 2, 0], others),
        quad([-1, 1, 1], [2, 0, 0], [0, 0, -2], others),
        quad([-1, -1, -1], [2, 0, 0], [0, 0, 2], others),
    ])
}

fn ball(x: f64, radius: f64, material: &str) -> Value {
    json!({"sphere": {"center": [x, 0, 0], "radius": radius}, "material": material})
}

fn cuboid(half: f64, material: &str) -> Value {
    json!({"box": {"min": [-half, -half, -half], "max": [half, half, half]}, "material": material})
}

/// A box with a pane that lies in the middle of its face towards the eye.
fn pane_in_a_face() -> Value {
    let pane = json!({"quad": {"corner": [-0.6, -0.6, 1], "edge_u": [1.2, 0, 0], "edge_v": [0, 1.2, 0]}, "material": "pane"});
    json!([cuboid(1.0, "a"), pane])
}

/// Puts five boxes within each other in place of the scene's only shape, as one mesh.
fn nest_shells(scene: &mut Scene) {
    let Some(Shape { geometry: Geometry::Mesh(mesh), .. }) = scene.shapes.first_mut() else { return };
    let one = Mesh::clone(mesh);
    let shells = (0..5u32).map(|i| 1.0 - 0.15 * f64::from(i));
    let count = one.positions.len() as u32;
    *mesh = Arc::new(Mesh {
        positions: shells.flat_map(|scale| one.positions.iter().map(move |&p| p * scale).collect::<Vec<DVec3>>()).collect(),
        triangles: (0..5).flat_map(|i| one.triangles.iter().map(move |t| t.map(|v| v + i * count)).collect::<Vec<_>>()).collect(),
        ..Mesh::default()
    });
}

/// What cannot be seen in an even sky, since nothing absorbs.
fn unseen() -> Case {
    let glass = json!({"dielectric": {"ior": 1.5}});
    let ground = json!({"dielectric": {"ior": 1.5, "roughness": 0.6}});
    let of = |index: f64| json!({"dielectric": {"ior": index}});
    let two = |a: &Value, b: &Value| json!({"a": a, "b": b, "m": {"mix": {"a": "a", "b": "b", "weight": 0.4}}});
    let drops: Vec<Value> = (0..5).map(|i| ball(0.1 * f64::from(i) - 0.2, 0.6, "a")).collect();
    // A drop of water in glass in water, all of one priority.
    let bodies = [ball(0.0, 1.0, "water"), ball(0.1, 0.7, "glass"), ball(0.2, 0.3, "water")];
    let nested = |order: [usize; 3]| {
        let shapes = order.map(|i| bodies[i].clone());
        scene(json!({"water": of(1.33), "glass": of(1.5)}), json!(shapes), 2.2)
    };
    let six: Vec<Value> = (0..6).map(|i| ball(0.1 * f64::from(i) - 0.25, 0.6, &format!("{i}"))).collect();
    let six_materials: serde_json::Map<String, Value> =
        (0..6).map(|i| (i.to_string(), json!({"dielectric": {"ior": 1.1 + 0.1 * f64::from(i), "priority": i}}))).collect();
    let silvered = json!({"a": glass, "mirror": {"conductor": {"reflectance": 1}}});
    let views = [
        ("two-materials", scene(two(&glass, &glass), faces("a", "b"), 0.5)),
        ("polished-and-ground", scene(two(&glass, &ground), faces("a", "b"), 0.5)),
        ("mix", scene(two(&glass, &glass), json!([ball(0.0, 0.5, "m")]), 0.6)),
        ("mix-with-ground", scene(two(&glass, &ground), json!([ball(0.0, 0.5, "m")]), 0.6)),
        ("drops", scene(two(&glass, &glass), json!(drops), 0.8)),
        ("shells", scene(two(&glass, &glass), json!([cuboid(1.0, "a")]), 1.2)),
        ("drop-in-glass-in-water", nested([0, 1, 2])),
        ("drop-in-glass-in-water-from-within", nested([2, 1, 0])),
        ("six-volumes", scene(six_materials.into(), json!(six), 0.8)),
        ("silvered", scene(silvered, faces("a", "mirror"), 0.5)),
        ("pane-in-a-face", scene(json!({"a": glass, "pane": {"thin_dielectric": {"ior": 1.5}}}), pane_in_a_face(), 2.2)),
    ];
    let rows = views.iter().enumerate().map(|(i, (name, _))| {
        Row::new(format!("volumes-unseen/{name}"), 1.0, 2e-3, move |f: &[Film]| vec![mean(&f[i])]).floor(1e-4)
    });
    let rows = rows.collect();
    let view = |(name, scene): (&str, Value)| {
        let change: Option<fn(&mut Scene)> = if name == "shells" { Some(nest_shells) } else { None };
        // Ground glass scatters at random.
        let spp = match name {
            "polished-and-ground" => 160,
            "mix-with-ground" => 320,
            _ => 16,
        };
        View { change, ..View::new(scene, spp) }
    };
    Case {
        id: "volumes-unseen",
        title: "radiance of an even sky behind clear solids, of which nothing is to be seen",
        views: views.map(view).into(),
        rows,
    }
}

/// Volumes of index 1, of which only what they absorb is seen: exp(-sum of coefficient times length).
fn absorbing() -> Case {
    let dye = |coefficient: f64| json!({"dielectric": {"ior": 1, "absorption": coefficient}});
    let one = |shapes: Value| scene(json!({"a": dye(0.5), "b": dye(0.5)}), shapes, 0.2);
    let slab =
        |from: f64, to: f64, material: &str| json!({"box": {"min": [-1, -1, from], "max": [1, 1, to]}, "material": material});
    let bodies = [cuboid(1.0, "thin"), cuboid(0.8, "thick"), cuboid(0.5, "thin")];
    let nested =
        |order: [usize; 3]| scene(json!({"thin": dye(0.1), "thick": dye(1.0)}), json!(order.map(|i| bodies[i].clone())), 0.2);
    // Number i reaches 1 m beyond i + 1 at the back and 0.1 m at the front, and gives way to it.
    let many: Vec<Value> = (0..8).map(|i| slab(-f64::from(8 - i), 0.1 * f64::from(7 - i), &i.to_string())).collect();
    let dyes: serde_json::Map<String, Value> = (0..8)
        .map(|i| (i.to_string(), json!({"dielectric": {"ior": 1, "absorption": 0.05 * f64::from(i + 1), "priority": i}})))
        .collect();
    let within = |mut scene: Value| {
        scene["camera"] = json!({"perspective": {"eye": [0.1, 0.2, 0.5], "target": [0.1, 0.2, -1], "vfov_deg": 0.5}});
        scene
    };
    let silvered = json!({"a": dye(0.5), "mirror": {"conductor": {"reflectance": 1}}});
    let named = json!({"a": {"dielectric": {"volume": "dye"}}, "mirror": {"diffuse": {"reflectance": 0}}});
    let mut open = scene(named, json!([slab(0.0, 1.0, "a"), slab(-1.0, 0.0, "a")]), 0.2);
    open["volumes"] = json!({"dye": {"ior": 1, "absorption": 0.5}});
    // A lamp all around, its wall the only bound of what it is filled with.
    let wall = json!([{"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}, "volume": "dye", "emission": {"radiance": 1, "two_sided": true}}]);
    let mut filled = within(scene(json!({}), wall, 0.2));
    filled["volumes"] = open["volumes"].clone();
    let views = [
        ("two-materials", one(faces("a", "b")), 0.5 * 2.0),
        ("overlap", one(json!([slab(-1.0, 1.0, "a"), slab(-0.5, 0.5, "b")])), 0.5 * 2.0),
        ("one-face-in-common", one(json!([slab(-1.0, 1.0, "a"), slab(-1.0, 0.0, "b"), slab(0.2, 1.0, "a")])), 0.5 * 2.0),
        ("nested", nested([0, 1, 2]), 0.1 * 1.4 + 0.6),
        ("nested-from-within", nested([2, 1, 0]), 0.1 * 1.4 + 0.6),
        ("eight-volumes", scene(dyes.into(), json!(many), 0.2), 0.4 + (1..8).map(|i| 1.1 * 0.05 * f64::from(i)).sum::<f64>()),
        ("named", open, 0.5 * 2.0),
        ("filled-lamp", filled, 0.5 * 1.5),
        ("silvered-from-within", within(scene(silvered, faces("a", "mirror"), 0.2)), 0.5 * 3.5),
    ];
    let rows = views.iter().enumerate().map(|(i, (name, _, depth))| {
        let exact = (-depth).exp();
        Row::new(format!("volumes-absorbing/{name}"), exact, 1e-3 * exact, move |f: &[Film]| vec![mean(&f[i])]).floor(1e-4)
    });
    let rows = rows.collect();
    Case {
        id: "volumes-absorbing",
        title: "radiance of an even sky behind solids that absorb: every metre counts once",
        views: views.map(|(_, scene, _)| View::new(scene, 8)).into(),
        rows,
    }
}
