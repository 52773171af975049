//! What light paths are aimed at: spheres around everything that can bend light.

use crate::geometry::{Bounds, bounds};
use crate::scene::bounds_of_all;
use crate::scene::{Geometry, Scene, Shape};
use glam::{DVec3, Vec4};

/// More shapes than this share one sphere: every light path looks at all spheres.
const MOST: usize = 8;

/// Centres and radii. Without guiding, or with nothing to aim at, one sphere around the scene.
pub fn targets(scene: &Scene, guiding: bool) -> Vec<(DVec3, f64)> {
    let shapes: Vec<&Shape> = scene.shapes.iter().filter(|s| guiding && bends(scene, s.material)).collect();
    let bodies: Vec<&[&Shape]> = shapes.chunk_by(|a, b| scene.are_one_piece(a, b)).collect();
    let whole = |body: &[&Shape]| body.iter().fold(Bounds::EMPTY, |b, s| b.union(bounds(&s.geometry))).ball();
    if bodies.is_empty() {
        vec![bounds_of_all(&scene.shapes).ball()]
    } else if bodies.len() > MOST {
        vec![whole(&shapes)]
    } else {
        let target = |body: &&[&Shape]| match body {
            [Shape { geometry: Geometry::Sphere { center, radius }, .. }] => (*center, *radius),
            body => whole(body),
        };
        bodies.iter().map(target).collect()
    }
}

/// As the shaders read them: relative to `origin`, and a little larger, so that rounding does not leave out an edge.
pub(super) fn build(scene: &Scene, origin: DVec3, guiding: bool) -> Vec<Vec4> {
    targets(scene, guiding).into_iter().map(|(c, r)| (c - origin).as_vec3().extend((r * 1.0001) as f32)).collect()
}

fn bends(scene: &Scene, material: usize) -> bool {
    scene.made_of(material).into_iter().any(|m| scene.materials[m].bends())
}
