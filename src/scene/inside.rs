//! Which volumes a point lies in, by the geometry alone.

use super::{Scene, Shape};
use crate::geometry::world::{Ray, World};
use crate::geometry::{Bounds, bounds};
use glam::{DVec3, dvec3};

/// More surfaces than this in a row without scattering, and a path is given up.
pub(crate) const MAX_STRAIGHT: u32 = 10_000;

/// The interiors that hold each of `points`: crossings of dielectrics and boundaries, signed, along a ray upwards to infinity. Slightly
/// tilted, so that it does not run along walls; upwards, so that an open sheet of water is above whoever is in it.
pub fn initial_interiors(scene: &Scene, points: &[DVec3]) -> Vec<Vec<usize>> {
    if points.is_empty() || !has_volumes(scene) {
        return vec![Vec::new(); points.len()];
    }
    // Only volumes that may be met: a scene can have many millions of triangles, and so can its instances.
    let may_be_met = |shape: &&Shape| {
        scene.volume_of(shape).is_some() && {
            let b = bounds(&shape.geometry);
            points.iter().any(|&p| passes(&b, p))
        }
    };
    let volumes = Scene { shapes: scene.shapes.iter().filter(may_be_met).cloned().collect(), ..scene.clone() }.flattened();
    let world = World::new(volumes.shapes.iter().map(|s| &s.geometry));
    points.iter().map(|&p| interiors_at(&volumes, &world, Ray::new(p, up()))).collect()
}

/// Might a ray from `p` along [`up`] meet what is in this box?
fn passes(b: &Bounds, p: DVec3) -> bool {
    let slack = 1e-9 * (b.min.abs().max(b.max.abs()).max(p.abs()).max_element());
    let (near, far) = ((b.min - slack - p) / up(), (b.max + slack - p) / up());
    near.max_element().max(0.0) <= far.min_element()
}

/// The direction in which crossings are counted, here and by the shaders.
pub(crate) fn up() -> DVec3 {
    dvec3(0.013_7, 1.0, 0.007_1).normalize()
}

fn interiors_at(scene: &Scene, world: &World, ray: Ray) -> Vec<usize> {
    let mut count = vec![0i64; scene.interiors.len()];
    crossings(world, ray, |shape, entered| {
        if let Some(interior) = scene.volume_of(&scene.shapes[shape]) {
            count[interior] += if entered { -1 } else { 1 };
        }
    });
    count.iter().enumerate().flat_map(|(i, &n)| std::iter::repeat_n(i, n.clamp(0, 256) as usize)).collect()
}

/// Which of these interiors rules where all of them are; what surrounds the scene where there is none.
pub fn ruling(scene: &Scene, interiors: &[usize]) -> usize {
    let rank = |i: &usize| (scene.interiors[*i].priority, scene.interiors[*i].depth, *i);
    interiors.iter().copied().max_by_key(rank).unwrap_or(0)
}

/// Are there surfaces that bound a volume?
pub(crate) fn has_volumes(scene: &Scene) -> bool {
    scene.materials.iter().any(|m| m.interior().is_some()) || scene.shapes.iter().any(|s| s.interior.is_some())
}

/// Every surface that `ray` crosses on its way, as the number of its shape and whether it enters there.
pub(super) fn crossings(world: &World, mut ray: Ray, mut crossed: impl FnMut(usize, bool)) {
    for _ in 0..MAX_STRAIGHT {
        let hits = world.intersect(&ray);
        let Some(first) = hits.first() else { break };
        hits.iter().for_each(|hit| crossed(hit.shape, ray.dir.dot(hit.ng) < 0.0));
        ray = Ray { origin: first.p, dir: ray.dir, t_min: 0.0, on: hits.iter().map(|h| h.prim).collect() };
    }
}
