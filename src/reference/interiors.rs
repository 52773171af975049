//! What a crossing of boundaries of interiors means.
//!
//! A path keeps a multiset of the interiors it is inside. Where several overlap the greatest `(priority, depth, index)` rules; where none is,
//! `interiors[0]`. Surfaces that coincide (glass on glass, a prism on the floor) are taken together, as optical contact.

use crate::geometry::world::Hit;
use crate::scene::Scene;
use glam::DVec3;

/// The interior that rules where all of `inside` overlap.
pub(super) fn ruling(scene: &Scene, inside: &[usize]) -> usize {
    inside.iter().copied().max_by_key(|&i| (scene.interiors[i].priority, scene.interiors[i].depth, i)).unwrap_or(0)
}

/// What a ray finds where it crosses boundaries of interiors, all at one place.
pub(super) enum Crossing<'a> {
    /// Nothing to see: no surface, or one between equal indices without a film. The medium may change.
    Straight,
    /// A real interface between `near` and `far`.
    Interface { hit: &'a Hit, near: usize, far: usize, alpha: f64 },
}

/// The interiors beyond the surfaces `met`, and what lies between. `dir` is the ray's direction. Which side of a face the ray comes from is
/// told by the geometry; the set only tells what else is there. Materials are given by their indices.
pub(super) fn cross<'a>(scene: &Scene, inside: &[usize], dir: DVec3, met: &[(&'a Hit, usize)]) -> (Vec<usize>, Crossing<'a>) {
    let (mut here, mut beyond) = (inside.to_vec(), inside.to_vec());
    let mut counted = Vec::new();
    for &(hit, material) in met {
        let Some(interior) = scene.materials[material].interior() else { continue };
        let entered = dir.dot(hit.ng) < 0.0;
        // Two triangles that share the edge the ray goes through are one surface.
        if counted.contains(&(hit.shape, entered)) {
            continue;
        }
        counted.push((hit.shape, entered));
        if entered {
            beyond.push(interior);
        } else if let Some(at) = beyond.iter().position(|&i| i == interior) {
            beyond.swap_remove(at);
        } else {
            here.push(interior);
        }
    }
    let (near, far) = (ruling(scene, &here), ruling(scene, &beyond));
    if near == far {
        return (beyond, Crossing::Straight);
    }
    // The surface belongs to whichever rules over the other, and is there only if that one's own surface was met.
    let owner = match (here.is_empty(), beyond.is_empty()) {
        (true, _) => far,
        (_, true) => near,
        _ => ruling(scene, &[near, far]),
    };
    let is_matched = scene.interiors[near].ior == scene.interiors[far].ior;
    let interface = met.iter().find_map(|&(hit, material)| match scene.materials[material].interface() {
        Some((interior, alpha)) if interior == owner && (!is_matched || is_seen_between_equals(scene, material)) => {
            Some(Crossing::Interface { hit, near, far, alpha })
        }
        _ => None,
    });
    (beyond, interface.unwrap_or(Crossing::Straight))
}

/// Whether glass of this material is there even between equal indices: for its film, or its tint, which is seen of smooth glass only.
fn is_seen_between_equals(scene: &Scene, material: usize) -> bool {
    let (glass, film) = (&scene.materials[material], scene.thin_films.contains_key(&material));
    film || (glass.alpha() == Some(0.0) && glass.tint().is_some())
}
