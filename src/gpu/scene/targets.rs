//! What light paths are aimed at: spheres around everything that can bend light.

use crate::geometry::{Bounds, bounds};
use crate::scene::bounds_of_all;
use crate::scene::{Geometry, Material, Scene, Shape};
use glam::{DVec3, Vec4};

/// More shapes than this share one sphere: every light path looks at all spheres.
const MOST: usize = 8;

/// Centres and radii. Without guiding, or with nothing to aim at, one sphere around the scene.
pub fn targets(scene: &Scene, guiding: bool) -> Vec<(DVec3, f64)> {
    let shapes: Vec<&Shape> = scene.shapes.iter().filter(|s| guiding && bends(scene, s.material)).collect();
    if shapes.is_empty() {
        vec![around(bounds_of_all(&scene.shapes))]
    } else if shapes.len() > MOST {
        vec![around(shapes.iter().fold(Bounds::EMPTY, |b, s| b.union(bounds(&s.geometry))))]
    } else {
        shapes
            .iter()
            .map(|s| match &s.geometry {
                Geometry::Sphere { center, radius } => (*center, *radius),
                other => around(bounds(other)),
            })
            .collect()
    }
}

/// As the shaders read them: relative to `origin`, and a little larger, so that rounding does not leave out an edge.
pub(super) fn build(scene: &Scene, origin: DVec3, guiding: bool) -> Vec<Vec4> {
    targets(scene, guiding).into_iter().map(|(c, r)| (c - origin).as_vec3().extend((r * 1.0001) as f32)).collect()
}

fn around(b: Bounds) -> (DVec3, f64) {
    (0.5 * (b.min + b.max), 0.5 * (b.max - b.min).length())
}

fn bends(scene: &Scene, material: usize) -> bool {
    match &scene.materials[material] {
        Material::Dielectric { .. } | Material::ThinDielectric { .. } => true,
        Material::Conductor { .. } | Material::ColoredConductor { .. } => true,
        // A coat bends but little of the light that meets it.
        Material::NormalMapped { base, .. }
        | Material::Coated { base, .. }
        | Material::Sheen { base, .. }
        | Material::Graded { first: base, .. } => bends(scene, *base),
        Material::Mix { a, b, .. } => bends(scene, *a) || bends(scene, *b),
        Material::Diffuse { .. } | Material::Boundary { .. } => false,
    }
}
