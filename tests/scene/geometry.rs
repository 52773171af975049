//! Geometry in the world: closed and outward, also when transformed and mirrored.

use crate::{load_text, scene_with, with_shapes};
use abbe::scene::{Geometry, Mesh, Scene, Sensor};
use glam::DVec3;
use std::collections::HashMap;

fn mesh(scene: &Scene) -> &Mesh {
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    mesh
}

/// Signed volume by the divergence theorem: positive if the winding faces outwards.
fn volume(mesh: &Mesh) -> f64 {
    let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

fn assert_closed(mesh: &Mesh) {
    let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
    for t in &mesh.triangles {
        for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
            *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|&n| n == 0), "an edge is open");
}

fn near(a: DVec3, b: DVec3) {
    assert!((a - b).length() < 1e-12 * (1.0 + b.length()), "{a} is not {b}");
}

#[test]
fn boxes_and_prisms_are_closed_and_face_outwards_also_when_mirrored() {
    for (shape, expected) in [
        (r#""box": {"min": [1,2,3], "max": [2,4,6]}"#, 6.0),
        (r#""prism": {"polygon": [[0,0],[1,0],[1,1],[0,1]], "length": 3}"#, 3.0),
        (r#""prism": {"polygon": [[0,1],[1,1],[1,0],[0,0]], "length": 3}"#, 3.0),
        (r#""prism": {"polygon": [[0,0],[2,0],[0,1]], "length": 0.5}"#, 0.5),
    ] {
        for (transform, factor) in [
            (r#"{"translate": [5, 6, 7]}"#, 1.0),
            (r#"{"scale": [2, 1, -1], "rotate_deg": [10, 20, 30]}"#, 2.0),
            (r#"{"scale": -1}"#, 1.0),
        ] {
            let scene = with_shapes(&format!(r#"[{{{shape}, "material": "m", "transform": {transform}}}]"#));
            assert_closed(mesh(&scene));
            assert!((volume(mesh(&scene)) - expected * factor).abs() < 1e-9, "{shape} {transform}");
        }
    }
}

#[test]
fn quads_face_along_edge_u_cross_edge_v() {
    let scene = with_shapes(r#"[{"quad": {"corner": [0,0,0], "edge_u": [0,0,1], "edge_v": [1,0,0]}, "material": "m"}]"#);
    let mesh = mesh(&scene);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        near((b - a).cross(c - a), DVec3::Y);
    }
}

#[test]
fn transforms_scale_then_rotate_then_translate_and_lists_go_first_to_last() {
    let center = |transform: &str| {
        let scene = with_shapes(&format!(
            r#"[{{"sphere": {{"center": [1,0,0], "radius": 1}}, "material": "m", "transform": {transform}}}]"#
        ));
        let Geometry::Sphere { center, radius } = scene.shapes[0].geometry else { panic!("not a sphere") };
        (center, radius)
    };
    let (c, r) = center(r#"{"scale": 2, "axis": [0,0,1], "rotate_deg": 90, "translate": [10,0,0]}"#);
    near(c, DVec3::new(10.0, 2.0, 0.0));
    assert!((r - 2.0).abs() < 1e-12);
    let (c, _) = center(r#"[{"translate": [10,0,0]}, {"axis": [0,0,1], "rotate_deg": 90}]"#);
    near(c, DVec3::new(0.0, 11.0, 0.0));
    let (c, _) = center("[[0,-1,0,5],[1,0,0,6],[0,0,1,7],[0,0,0,1]]");
    near(c, DVec3::new(5.0, 7.0, 7.0));
    let (c, _) = center(r#"{"rotate_deg": [0, 90, 90]}"#); // about y: -z; then about z: still -z
    near(c, DVec3::NEG_Z);
}

#[test]
fn discs_and_cylinders_follow_a_similarity() {
    let scene = with_shapes(
        r#"[{"disc": {"center": [0,0,1], "normal": [0,0,2], "radius": 1}, "material": "m", "transform": {"scale": -3}},
            {"cylinder": {"base": [0,0,0], "top": [0,2,0], "radius": 1}, "material": "m",
             "transform": {"scale": 3, "axis": [1,0,0], "rotate_deg": 90}}]"#,
    );
    let Geometry::Disc { center, normal, radius } = scene.shapes[0].geometry else { panic!("not a disc") };
    near(center, DVec3::new(0.0, 0.0, -3.0));
    near(normal, DVec3::NEG_Z); // away from the origin, as before
    assert!((radius - 3.0).abs() < 1e-12);
    let Geometry::Cylinder { axis, length, radius, .. } = scene.shapes[1].geometry else { panic!("not a cylinder") };
    near(axis, DVec3::Z);
    assert!((length - 6.0).abs() < 1e-12 && (radius - 3.0).abs() < 1e-12);
}

#[test]
fn instances_of_groups_are_placed_by_both_transforms() {
    let text = scene_with(
        "groups",
        r#"{"pair": [{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m"},
                     {"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": {"translate": [1,0,0]}}]}"#,
    )
    .replace(r#""shapes": ["#, r#""shapes": [{"instance": "pair", "transform": {"scale": 2, "translate": [0,5,0]}}, "#);
    let scene = load_text(&text).unwrap();
    assert_eq!(scene.shapes.len(), 3);
    let Geometry::Sphere { center, radius } = scene.shapes[1].geometry else { panic!("not a sphere") };
    near(center, DVec3::new(2.0, 5.0, 0.0));
    assert!((radius - 2.0).abs() < 1e-12);
}

#[test]
fn mesh_files_keep_normals_or_lose_them_as_told() {
    let load = |file: &str, rest: &str| {
        let transform = r#"{"scale": [1, 2, -3]}"#;
        with_shapes(&format!(r#"[{{"mesh": {{"file": "{file}"{rest}}}, "material": "m", "transform": {transform}}}]"#))
    };
    assert!(mesh(&load("square.obj", r#", "smooth": false"#)).normals.is_empty());
    assert!(mesh(&load("dropped.ply", "")).normals.is_empty());
    assert_eq!(mesh(&load("dropped.ply", r#", "smooth": true"#)).normals[1], DVec3::NEG_Z);
    let smooth = load("square.obj", "");
    assert_eq!((mesh(&smooth).positions.len(), mesh(&smooth).triangles.len()), (4, 3));
    assert!(mesh(&smooth).normals.iter().all(|n| (*n - DVec3::NEG_Z).length() < 1e-12), "{:?}", mesh(&smooth).normals);
    let [a, b, c] = mesh(&smooth).triangles[0].map(|v| mesh(&smooth).positions[v as usize]);
    assert!((b - a).cross(c - a).z < 0.0, "the winding does not agree with the normals");
}

#[test]
fn glass_that_faces_inwards_is_said() {
    for (file, notes) in [("inward.obj", 1), ("square.obj", 0)] {
        let text = scene_with("materials", r#"{"m": {"dielectric": {"ior": 1.5}}}"#)
            .replace(r#""sphere": {"center": [0, 0, 0], "radius": 1}"#, &format!(r#""mesh": {{"file": "{file}"}}"#));
        let scene = load_text(&text).unwrap_or_else(|e| panic!("{e}"));
        let found = abbe::scene::advice(&scene);
        assert_eq!(found.iter().filter(|n| n.contains("face inwards")).count(), notes, "{file}: {found:?}");
    }
}

#[test]
fn triangles_without_area_are_dropped_with_a_note() {
    let scene = with_shapes(r#"[{"mesh": {"file": "dropped.ply"}, "material": "m"}]"#);
    assert_eq!(mesh(&scene).triangles.len(), 1);
    assert!(scene.notes.iter().any(|n| n.contains("1 triangles of no area")), "{:?}", scene.notes);
}

#[test]
fn all_ply_encodings_read_the_same() {
    let here = std::env::temp_dir().join(format!("abbe-ply-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    let head = |format: &str| {
        format!(
            "ply\r\nformat {format} 1.0\r\ncomment x\r\nelement vertex 4\r\nproperty double x\r\nproperty float y\r\nproperty short z\r\n\
             element odd 1\r\nproperty list uchar short w\r\nelement face 1\r\nproperty list uchar uint vertex_index\r\nend_header\r\n"
        )
    };
    let corners = [[0.5f64, 0.0, 0.0], [1.0, 0.0, -2.0], [1.0, 1.0, 0.0], [0.0, 1.0, 300.0]];
    let mut files = vec![("ascii", format!("{}0.5 0 0\n1 0 -2\n1 1 0\n0 1 300\n2 7 8\n4 0 1 2 3\n", head("ascii")).into_bytes())];
    for (format, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = head(format).into_bytes();
        let mut put = |little: &[u8]| if big { bytes.extend(little.iter().rev()) } else { bytes.extend(little) };
        for c in corners {
            put(&c[0].to_le_bytes());
            put(&(c[1] as f32).to_le_bytes());
            put(&(c[2] as i16).to_le_bytes());
        }
        put(&[2]);
        put(&7i16.to_le_bytes());
        put(&8i16.to_le_bytes());
        put(&[4]);
        (0..4u32).for_each(|i| put(&i.to_le_bytes()));
        files.push((format, bytes));
    }
    for (format, bytes) in files {
        std::fs::write(here.join("x.ply"), bytes).unwrap();
        let text = scene_with("shapes", r#"[{"mesh": {"file": "x.ply"}, "material": "m"}]"#);
        let scene = abbe::scene::load_str(&text, "t.json".as_ref(), &here, &Default::default())
            .unwrap_or_else(|e| panic!("{format}: {e}"));
        assert_eq!(mesh(&scene).positions, corners.map(DVec3::from_array), "{format}");
        assert_eq!(mesh(&scene).triangles, [[0, 1, 2], [0, 2, 3]], "{format}");
    }
    std::fs::remove_dir_all(&here).unwrap();
}

#[test]
fn cameras_have_orthonormal_right_handed_frames() {
    let camera = r#"{"perspective": {"eye": [1,2,3], "target": [4,0,-3], "vfov_deg": 90, "aperture_radius": 0.1}}"#;
    let scene = load_text(&scene_with("camera", camera)).unwrap();
    let Sensor::Perspective { frame, tan_half_vfov, focus_distance, lens_radius, .. } = scene.sensor else {
        panic!("wrong sensor")
    };
    near(-frame.z_axis, DVec3::new(3.0, -2.0, -6.0) / 7.0);
    near(frame.x_axis.cross(frame.y_axis), frame.z_axis);
    assert!((frame.determinant() - 1.0).abs() < 1e-12 && frame.y_axis.y > 0.0);
    assert!((tan_half_vfov - 1.0).abs() < 1e-12 && (focus_distance - 7.0).abs() < 1e-12 && lens_radius == 0.1);
}
