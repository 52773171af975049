//! What light paths are aimed at: spheres around everything smooth that can bend light.

use crate::geometry::{Bounds, bounds};
use crate::scene::{Geometry, Material, Scene, Shape};
use glam::{DVec3, Vec4};

/// More shapes than this share one sphere: every light path looks at all spheres.
const MOST: usize = 8;

/// Centres relative to `origin`, and radii.
pub(super) fn build(scene: &Scene, origin: DVec3) -> Vec<Vec4> {
    let shapes: Vec<&Shape> = scene.shapes.iter().filter(|s| bends(scene, s.material)).collect();
    let spheres: Vec<(DVec3, f64)> = if shapes.len() > MOST {
        vec![around(shapes.iter().fold(Bounds::EMPTY, |b, s| b.union(bounds(&s.geometry))))]
    } else {
        shapes
            .iter()
            .map(|s| match &s.geometry {
                Geometry::Sphere { center, radius } => (*center, *radius),
                other => around(bounds(other)),
            })
            .collect()
    };
    // A little larger, so that rounding does not leave out an edge.
    spheres.into_iter().map(|(c, r)| (c - origin).as_vec3().extend((r * 1.0001) as f32)).collect()
}

fn around(b: Bounds) -> (DVec3, f64) {
    (0.5 * (b.min + b.max), 0.5 * (b.max - b.min).length())
}

fn bends(scene: &Scene, material: usize) -> bool {
    match &scene.materials[material] {
        Material::Dielectric { alpha, .. } | Material::Conductor { alpha, .. } => *alpha == 0.0,
        Material::ThinDielectric { .. } => true,
        Material::Mix { a, b, .. } => bends(scene, *a) || bends(scene, *b),
        Material::Diffuse { .. } | Material::Boundary { .. } => false,
    }
}
