//! Meshes in STL files, and what their lengths are given in.

use crate::{load_text, scene_with, with_shapes};
use abbe::scene::{Geometry, LoadOptions, Mesh, Scene, load_str};
use glam::DVec3;

fn mesh(scene: &Scene) -> &Mesh {
    let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
    mesh
}

/// A box with corners at 0 and (1, 2, 3), by Rust's own numbers.
fn triangles() -> Vec<[[f32; 3]; 3]> {
    let scene = with_shapes(r#"[{"box": {"min": [0, 0, 0], "max": [1, 2, 3]}, "material": "m"}]"#);
    let mesh = mesh(&scene);
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize].as_vec3().to_array())).collect()
}

fn binary(head: &[u8]) -> Vec<u8> {
    let mut bytes = head.to_vec();
    bytes.resize(80, 0);
    bytes.extend((triangles().len() as u32).to_le_bytes());
    for t in triangles() {
        bytes.extend([0; 12]);
        bytes.extend(t.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0x12, 0x34]);
    }
    bytes
}

fn text(solids: usize) -> Vec<u8> {
    let facet = |t: &[[f32; 3]; 3]| {
        let corner = |c: &[f32; 3]| format!("      vertex {:e} {} {}\r\n", c[0], c[1], c[2]);
        format!(
            "  facet normal 0 0 1\r\n    outer loop\r\n{}    endloop\r\n  endfacet\r\n",
            t.iter().map(corner).collect::<String>()
        )
    };
    let all = triangles();
    let parts = all.chunks(all.len() / solids).enumerate();
    parts
        .map(|(i, part)| format!("solid part {i}\r\n{}endsolid part {i}\r\n", part.iter().map(facet).collect::<String>()))
        .collect::<String>()
        .into()
}

fn read(name: &str, bytes: &[u8], more: &str) -> abbe::Result<Scene> {
    let here = std::env::temp_dir().join(format!("abbe-meshes-{}-{}", std::process::id(), name));
    std::fs::create_dir_all(&here).unwrap();
    std::fs::write(here.join("a.STL"), bytes).unwrap();
    let shapes = format!(r#"[{{"mesh": {{"file": "a.STL"{more}}}, "material": "m"}}]"#);
    let scene = load_str(&scene_with("shapes", &shapes), "t.json".as_ref(), &here, &LoadOptions::default());
    std::fs::remove_dir_all(&here).unwrap();
    scene
}

#[test]
fn stl_is_binary_or_text_whatever_it_begins_with_and_closed() {
    let files =
        [binary(b"made by nobody"), binary(b"solid, says the header"), text(1), text(3), [binary(b""), vec![0; 7]].concat()];
    for (i, bytes) in files.iter().enumerate() {
        let scene = read(&format!("stl{i}"), bytes, "").unwrap_or_else(|e| panic!("{i}: {e}"));
        let mesh = mesh(&scene);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (8, 12), "{i}");
        let volume: f64 =
            mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
        assert!((volume - 6.0).abs() < 1e-12, "{i}: {volume}");
    }
}

#[test]
fn damaged_stl_is_an_error_that_says_where() {
    let whole = binary(b"x");
    let fails = |bytes: &[u8], says: &str| {
        let line = read("bad", bytes, "").unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    };
    fails(&whole[..whole.len() - 1], "promises 12 triangles");
    fails(&whole[..60], "not an STL file");
    fails(b"solid\nfacet normal 0 0 1\nouter loop\nvertex 1 2\n", "line 4");
    fails(b"solid\nouter loop\nvertex 1 2 3\nvertex 1 2 4\nendloop\n", "a facet of 2 corners");
    fails(b"solid\nouter loop\nvertex 1 2 3\nvertex 1 2 4\n", "ends within a facet");
    fails(b"solid\nendsolid\n", "no triangles");
}

#[test]
fn lengths_of_shapes_and_of_files_are_in_the_unit_that_is_named() {
    let greatest = |scene: &Scene| mesh(scene).positions.iter().copied().fold(DVec3::ZERO, DVec3::max);
    let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-15, "{a} is not {b}");
    near(greatest(&read("mm", &binary(b""), r#", "unit": "mm""#).unwrap()), DVec3::new(0.001, 0.002, 0.003));
    // The transform is in metres.
    let moved = r#"[{"box": {"min": [0, 0, 0], "max": [1, 2, 3]}, "material": "m", "unit": "in", "transform": {"translate": [1, 0, 0]}}]"#;
    near(greatest(&with_shapes(moved)), DVec3::new(1.0254, 0.0508, 0.0762));
    let fails = |shapes: &str, says: &str| {
        let line = load_text(&scene_with("shapes", shapes)).unwrap_err().to_string();
        assert!(line.contains(says), "{line}");
    };
    fails(r#"[{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m", "unit": "inch"}]"#, "did you mean \"in\"");
    fails(r#"[{"mesh": {"file": "square.obj", "unit": "mm"}, "material": "m", "unit": "mm"}]"#, "has a \"unit\" already");
}
