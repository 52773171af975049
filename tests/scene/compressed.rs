//! Compressed glTF: meshes by Draco and by meshoptimizer, each before what those libraries decode it to (tools/make-compressed.py).

use crate::folder;
use abbe::scene::{Geometry, LoadOptions, Mesh, load};

fn meshes(name: &str) -> Vec<Mesh> {
    let scene = load(&folder("tests/data/scenes").join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.notes.iter().all(|note| !note.contains("ignored")), "{:?}", scene.notes);
    let mesh = |geometry: &Geometry| match geometry {
        Geometry::Mesh(mesh) => Mesh::clone(mesh),
        other => panic!("{other:?}"),
    };
    scene.shapes.iter().map(|shape| mesh(&shape.geometry)).collect()
}

#[test]
fn compressed_meshes_are_what_their_own_libraries_decode_them_to() {
    for (name, count, slack) in [("draco.glb", 6, 1e-6), ("meshopt.glb", 4, 1.0 / 32767.0)] {
        let meshes = meshes(name);
        assert_eq!(meshes.len(), count, "{name}");
        for pair in meshes.chunks(2) {
            let (small, plain) = (&pair[0], &pair[1]);
            assert_eq!(small.triangles, plain.triangles, "{name}");
            assert_eq!(small.positions, plain.positions, "{name}");
            assert_eq!((&small.uvs, small.colors.len()), (&plain.uvs, plain.positions.len()), "{name}");
            // Filters of normals and colours are exact to a unit.
            assert!(small.normals.iter().zip(&plain.normals).all(|(a, b)| (*a - *b).length() < 2.0 * slack), "{name}");
            let near = |a: &[f32; 4], b: &[f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.05 * (1.0 + b.abs()));
            assert!(small.colors.iter().zip(&plain.colors).all(|(a, b)| near(a, b)), "{name}");
        }
    }
}
