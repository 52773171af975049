//! Which interiors a point lies in, and what a crossing of their boundaries means.
//!
//! A path keeps a multiset of the interiors it is inside. Where several overlap the greatest `(priority, index)` rules; where none is,
//! `interiors[0]`. Surfaces that coincide (glass on glass, a prism on the floor) are taken together, as optical contact.

use super::bvh::World;
use super::intersect::{Hit, Ray};
use crate::geometry::{Bounds, bounds};
use crate::scene::{Material, Scene, Shape};
use glam::{DVec3, dvec3};

/// More surfaces than this in a row without scattering, and a path is given up.
pub(super) const MAX_STRAIGHT: u32 = 10_000;

/// The interiors that hold each of `points`: crossings of dielectrics and boundaries, signed, along a ray upwards to infinity. Slightly
/// tilted, so that it does not run along walls; upwards, so that an open sheet of water is above whoever is in it.
pub fn initial_interiors(scene: &Scene, points: &[DVec3]) -> Vec<Vec<usize>> {
    if points.is_empty() || !scene.materials.iter().any(|m| interior_of(m).is_some()) {
        return vec![Vec::new(); points.len()];
    }
    // Only volumes that may be met: a scene can have many millions of triangles, and so can its instances.
    let may_be_met = |shape: &&Shape| {
        scene.interior_of(shape.material).is_some() && {
            let b = bounds(&shape.geometry);
            points.iter().any(|&p| passes(&b, p))
        }
    };
    let volumes = Scene { shapes: scene.shapes.iter().filter(may_be_met).cloned().collect(), ..scene.clone() }.flattened();
    let world = World::new(&volumes);
    points.iter().map(|&p| interiors_at(&volumes, &world, Ray::new(p, up()), Vec::new())).collect()
}

/// Might a ray from `p` along [`up`] meet what is in this box?
fn passes(b: &Bounds, p: DVec3) -> bool {
    let slack = 1e-9 * (b.min.abs().max(b.max.abs()).max(p.abs()).max_element());
    let (near, far) = ((b.min - slack - p) / up(), (b.max + slack - p) / up());
    near.max_element().max(0.0) <= far.min_element()
}

/// The direction in which crossings are counted.
pub(super) fn up() -> DVec3 {
    dvec3(0.013_7, 1.0, 0.007_1).normalize()
}

/// As [`initial_interiors`], from a ray along [`up`] and crossings already `met` at its origin, as (interior, entered).
pub(super) fn interiors_at(scene: &Scene, world: &World, mut ray: Ray, met: Vec<(usize, bool)>) -> Vec<usize> {
    let mut count = vec![0i64; scene.interiors.len()];
    let mut tally = |(interior, entered): (usize, bool)| count[interior] += if entered { -1 } else { 1 };
    met.into_iter().for_each(&mut tally);
    if scene.materials.iter().any(|m| interior_of(m).is_some()) {
        for _ in 0..MAX_STRAIGHT {
            let hits = world.intersect(&ray);
            let Some(first) = hits.first() else { break };
            for hit in &hits {
                if let Some(interior) = scene.interior_of(scene.shapes[hit.shape].material) {
                    tally((interior, ray.dir.dot(hit.ng) < 0.0));
                }
            }
            ray = Ray { origin: first.p, dir: ray.dir, t_min: 0.0, on: hits.iter().map(|h| h.prim).collect() };
        }
    }
    count.iter().enumerate().flat_map(|(i, &n)| std::iter::repeat_n(i, n.clamp(0, 256) as usize)).collect()
}

/// The material whose normals or roughness vary in this one, or else itself.
pub(super) fn bare(scene: &Scene, material: usize) -> usize {
    match scene.materials[material] {
        Material::NormalMapped { base, .. } | Material::Graded { first: base, .. } => bare(scene, base),
        _ => material,
    }
}

/// The interior behind a surface of this material.
pub(super) fn interior_of(material: &Material) -> Option<usize> {
    match material {
        Material::Dielectric { interior, .. } => Some(*interior),
        Material::Boundary { interior } => *interior,
        _ => None,
    }
}

/// The interior that rules where all of `inside` overlap.
pub(super) fn ruling(scene: &Scene, inside: &[usize]) -> usize {
    inside.iter().copied().max_by_key(|&i| (scene.interiors[i].priority, i)).unwrap_or(0)
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
        let Some(interior) = interior_of(&scene.materials[material]) else { continue };
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
    let interface = met.iter().find_map(|&(hit, material)| match scene.materials[material] {
        Material::Dielectric { interior, alpha } if interior == owner && (!is_matched || scene.films.contains_key(&material)) => {
            Some(Crossing::Interface { hit, near, far, alpha })
        }
        _ => None,
    });
    (beyond, interface.unwrap_or(Crossing::Straight))
}
