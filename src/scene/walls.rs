//! Opaque shapes that bound volumes: a solid may be glass on some sides only.

use super::bodies::{Sums, summed};
use super::weld::{GRAIN, Weld, connections};
use super::{Passage, Scene, Shape};
use crate::geometry::{Bounds, Geometry, bounds};
use glam::DVec3;
use std::collections::HashMap;

/// Walls of a solid are looked for this many shapes away from its glass.
const FARTHEST: usize = 8;

/// Opaque shapes that close the surface of a volume, with the triangles that do (or all) and its interior.
pub(super) fn walls(scene: &Scene) -> Vec<(usize, Option<Vec<usize>>, usize)> {
    let opaque: Vec<usize> = (0..scene.shapes.len()).filter(|&s| may_be_wall(scene, &scene.shapes[s])).collect();
    let mut shapes: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, shape) in scene.shapes.iter().enumerate() {
        if let (Some(interior), false) =
            (scene.volume_of(shape), matches!(shape.geometry, Geometry::Sphere { .. } | Geometry::Instance(_)))
        {
            shapes.entry(interior).or_default().push(i);
        }
    }
    let mut interiors: Vec<usize> = shapes.keys().copied().collect();
    interiors.sort_unstable();
    let mut out = Vec::new();
    for interior in interiors {
        let own = &shapes[&interior];
        let size = own.iter().fold(Bounds::EMPTY, |b, &s| b.union(bounds(&scene.shapes[s].geometry)));
        if !opaque.iter().any(|&s| near(&size, &bounds(&scene.shapes[s].geometry))) || is_closed(scene, own) {
            continue;
        }
        let mut weld = Weld::new(size);
        let mut nodes: Vec<(usize, Vec<usize>)> = own.iter().map(|&s| (s, weld.add(&scene.shapes[s].geometry))).collect();
        // What has a vertex in common with what is known already, and so on.
        let (mut rest, mut region) = (opaque.clone(), size);
        for _ in 0..FARTHEST {
            let joins = |s: &usize| {
                let geometry = &scene.shapes[*s].geometry;
                near(&region, &bounds(geometry)) && connections(geometry).into_iter().any(|p| weld.knows(p))
            };
            let (joined, others): (Vec<usize>, Vec<usize>) = rest.into_iter().partition(joins);
            rest = others;
            if joined.is_empty() {
                break;
            }
            region = joined.iter().fold(region, |b, &s| b.union(bounds(&scene.shapes[s].geometry)));
            nodes.extend(joined.into_iter().map(|s| (s, weld.add(&scene.shapes[s].geometry))));
        }
        let mut surfaces: HashMap<usize, Sums> = HashMap::new();
        for (shape, nodes) in &nodes {
            let mut mine: HashMap<usize, Vec<usize>> = HashMap::new();
            nodes.iter().enumerate().for_each(|(t, &node)| mine.entry(weld.surface(node)).or_default().push(t));
            let is_whole = mine.len() == 1;
            for (root, triangles) in mine {
                let part = summed(*shape, &scene.shapes[*shape].geometry, (!is_whole).then_some(triangles));
                match surfaces.get_mut(&root) {
                    Some(sum) => sum.add(part),
                    None => {
                        surfaces.insert(root, part);
                    }
                }
            }
        }
        for surface in surfaces.into_values().filter(|s| s.is_closed() && s.volume > 0.0) {
            let is_own = |(shape, _): &(usize, Option<Vec<usize>>)| own.contains(shape);
            if surface.parts.iter().any(is_own) {
                let walls = surface.parts.into_iter().filter(|part| !is_own(part));
                out.extend(walls.map(|(shape, triangles)| (shape, triangles, interior)));
            }
        }
    }
    out.sort_by_key(|(shape, triangles, _)| (*shape, triangles.as_ref().map(|t| t[0])));
    out
}

/// Is it an opaque shape that bounds no volume?
fn may_be_wall(scene: &Scene, shape: &Shape) -> bool {
    let is_flat = matches!(shape.geometry, Geometry::Mesh(_) | Geometry::Disc { .. } | Geometry::Cylinder { .. });
    is_flat && shape.interior.is_none() && scene.passage(shape.material) == Ok(Passage::None)
}

fn near(a: &Bounds, b: &Bounds) -> bool {
    let slack = DVec3::splat(GRAIN * (a.max - a.min).length());
    Bounds { min: a.min - slack, max: a.max + slack }.overlaps(b)
}

/// Do the area vectors of these shapes cancel?
fn is_closed(scene: &Scene, shapes: &[usize]) -> bool {
    let mut all = summed(shapes[0], &scene.shapes[shapes[0]].geometry, None);
    shapes[1..].iter().for_each(|&s| all.add(summed(s, &scene.shapes[s].geometry, None)));
    all.is_closed()
}
