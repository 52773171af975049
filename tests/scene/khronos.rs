//! Files that Khronos made or collected to try readers of glTF with.

use crate::folder;
use abbe::color::upsample::color_of_reflectance;
use abbe::scene::{Geometry, LoadOptions, Material, Scene, load};
use glam::{DVec3, dvec2};

fn sample(name: &str) -> Scene {
    load(&folder("tests/data/khronos").join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The Asset Generator's table says which mode and which indices a file has: the picture is the same square for all.
#[test]
fn every_mode_and_type_of_indices_gives_the_same_square() {
    for number in [4, 5, 6, 11, 12, 13, 14, 15] {
        let scene = sample(&format!("Mesh_PrimitiveMode_{number:02}.gltf"));
        let Geometry::Mesh(mesh) = &scene.shapes[0].geometry else { panic!("not a mesh") };
        let doubled: Vec<DVec3> = (mesh.triangles.iter())
            .map(|t| t.map(|v| mesh.positions[v as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a))
            .collect();
        assert_eq!(doubled, [DVec3::Z; 2], "{number}: two halves of a square of side 1 that looks along Z");
    }
}

/// Four squares show the corners of one picture, each tinted; of the one at the upper right, the coordinates are of a set that its material does not use.
#[test]
fn squares_show_the_corners_of_a_picture_that_are_written_on_them() {
    let scene = sample("TextureCoordinateTest.gltf");
    let notes: Vec<&String> = scene.notes.iter().filter(|n| n.contains("without texture coordinates shows one texel")).collect();
    assert_eq!((scene.shapes.len(), notes.len()), (5, 1), "{:?}", scene.notes);
    for (name, tint) in [("TopLeft", [0.8, 0.8, 0.0]), ("BottomLeft", [0.0, 0.16, 0.8]), ("BottomRight", [0.0, 0.8, 0.0])] {
        let shape = scene.shapes.iter().find(|s| s.name == format!("{name}Mesh")).expect(name);
        let Geometry::Mesh(mesh) = &shape.geometry else { panic!("not a mesh") };
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            // The squares reach from 0.2 to 1.2 in x and y, and show from 0 to 0.4 of the picture.
            let expected = dvec2(0.5, 0.5) + 0.4 * dvec2(p.x, -p.y) + 0.02 * dvec2(p.x.signum(), -p.y.signum());
            assert!((*uv - expected).length() < 1e-5, "{name}: {p} shows {uv}");
        }
        let Material::Coated { base, .. } = scene.materials[shape.material] else { panic!("not glossy") };
        let Material::Diffuse { reflectance } = &scene.materials[base] else { panic!("not diffuse") };
        let picture = reflectance.image().expect("a picture");
        assert_eq!((picture.image.width, picture.image.height), (512, 512));
        // Its background is white.
        let colour = color_of_reflectance(|nm| reflectance.eval(nm, dvec2(0.5, 0.5)));
        assert!(colour.iter().zip(tint).all(|(a, b)| (a - b).abs() < 5e-3), "{name}: {colour:?}");
    }
}
