//! Opaque shapes that bound volumes: a solid may be glass on some sides only.

use super::bodies::{Sums, summed};
use super::volumes::MOST_BOXES;
use super::weld::{Edge, GRAIN, Weld, connections};
use super::{Passage, Scene, Shape};
use crate::geometry::{Bounds, Geometry, bounds, corners};
use glam::DVec3;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

/// Walls of a solid are looked for this many shapes away from its glass.
const FARTHEST: usize = 8;

/// Vertices that are looked at, at most.
const MOST_VERTICES: usize = 20_000_000;

/// What closes the surface of a volume beside its own faces.
pub(super) struct Wall {
    /// The shape, which is opaque.
    pub shape: usize,
    /// Those of its triangles that do, or all.
    pub triangles: Option<Vec<usize>>,
    /// The volume.
    pub interior: usize,
    /// Whether its normals point into the volume.
    pub is_turned: bool,
}

/// A triangle of a shape, and whether the volume that is looked at is its own.
struct Face {
    shape: usize,
    triangle: usize,
    is_own: bool,
}

/// All walls, by their shapes.
pub(super) fn walls(scene: &Scene) -> Vec<Wall> {
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
    let mut walls = Vec::new();
    let mut left = MOST_VERTICES;
    // The first so many: no scene is to keep the loader for minutes.
    for interior in interiors.into_iter().take(MOST_BOXES / opaque.len().max(1)) {
        let own = &shapes[&interior];
        let size = own.iter().fold(Bounds::EMPTY, |b, &s| b.union(bounds(&scene.shapes[s].geometry)));
        if opaque.iter().any(|&s| near(&size, &bounds(&scene.shapes[s].geometry))) && !is_closed(scene, own) {
            let (mut weld, joined) = joined(scene, size, own, &opaque, &mut left);
            let (meshes, others): (Vec<usize>, Vec<usize>) =
                joined.iter().partition(|s| matches!(scene.shapes[**s].geometry, Geometry::Mesh(_)));
            let is_own = |s: usize| own.contains(&s);
            walls.extend(walls_of_meshes(scene, &weld, &meshes, &is_own).into_iter().map(|wall| Wall { interior, ..wall }));
            walls.extend(ends_of_tubes(scene, &mut weld, &others, &is_own).map(|wall| Wall { interior, ..wall }));
        }
    }
    walls.sort_by_key(|wall| (wall.shape, wall.triangles.as_ref().map(|t| t[0])));
    walls
}

/// The vertices of these shapes of a volume and of the opaque shapes that have one in common with them, with one of those, and so on; and all these shapes. Looks at `left` vertices at most.
fn joined(scene: &Scene, size: Bounds, own: &[usize], opaque: &[usize], left: &mut usize) -> (Weld, Vec<usize>) {
    let mut weld = Weld::new(size);
    let mut all = own.to_vec();
    own.iter().for_each(|&s| {
        weld.add(&scene.shapes[s].geometry);
    });
    let (mut rest, mut region) = (opaque.to_vec(), size);
    for _ in 0..FARTHEST {
        let mut joins = |s: &usize| {
            let geometry = &scene.shapes[*s].geometry;
            if *left == 0 || !near(&region, &bounds(geometry)) {
                return false;
            }
            let connections = connections(geometry);
            *left = left.saturating_sub(connections.len());
            connections.into_iter().any(|p| weld.knows(p))
        };
        let (new, others): (Vec<usize>, Vec<usize>) = rest.into_iter().partition(&mut joins);
        rest = others;
        if new.is_empty() {
            break;
        }
        region = new.iter().fold(region, |b, &s| b.union(bounds(&scene.shapes[s].geometry)));
        new.iter().for_each(|&s| {
            weld.add(&scene.shapes[s].geometry);
        });
        all.extend(new);
    }
    (weld, all)
}

/// Walls among triangles: those that own ones lead to over edges of two, if all together are closed.
fn walls_of_meshes(scene: &Scene, weld: &Weld, shapes: &[usize], is_own: &dyn Fn(usize) -> bool) -> Vec<Wall> {
    let mut faces: Vec<Face> = Vec::new();
    let mut edges: HashMap<Edge, Vec<(usize, usize)>> = HashMap::new();
    for &shape in shapes {
        let Geometry::Mesh(mesh) = &scene.shapes[shape].geometry else { continue };
        for triangle in 0..mesh.triangles.len() {
            weld.edges(corners(mesh, triangle)).for_each(|(edge, way)| edges.entry(edge).or_default().push((faces.len(), way)));
            faces.push(Face { shape, triangle, is_own: is_own(shape) });
        }
    }
    // 1 for a face whose normal points out of the volume, -1 for one that is turned.
    let mut sides: Vec<i8> = faces.iter().map(|f| i8::from(f.is_own)).collect();
    let mut is_seen = vec![false; faces.len()];
    let mut walls = Vec::new();
    for first in 0..faces.len() {
        if is_seen[first] || !faces[first].is_own {
            continue;
        }
        let (mut patch, mut at, mut agrees) = (vec![first], 0, true);
        is_seen[first] = true;
        while at < patch.len() {
            let face = patch[at];
            at += 1;
            let Geometry::Mesh(mesh) = &scene.shapes[faces[face].shape].geometry else { continue };
            for (edge, way) in weld.edges(corners(mesh, faces[face].triangle)) {
                let [a, b] = edges[&edge][..] else { continue };
                let (next, its_way) = if a.0 == face { b } else { a };
                let side = if its_way == way { -sides[face] } else { sides[face] };
                if sides[next] == 0 {
                    sides[next] = side;
                }
                agrees &= sides[next] == side;
                if !std::mem::replace(&mut is_seen[next], true) {
                    patch.push(next);
                }
            }
        }
        if agrees {
            walls.extend(closed_patch(scene, &faces, &sides, &patch));
        }
    }
    walls
}

/// The walls of a connected surface, if it is closed.
fn closed_patch(scene: &Scene, faces: &[Face], sides: &[i8], patch: &[usize]) -> Vec<Wall> {
    let mut parts: BTreeMap<(usize, i8), Vec<usize>> = BTreeMap::new();
    patch.iter().for_each(|&f| parts.entry((faces[f].shape, sides[f])).or_default().push(faces[f].triangle));
    let sums = parts.iter().map(|(&(shape, side), triangles)| {
        let sums = summed(shape, &scene.shapes[shape].geometry, Some(triangles.clone()));
        if side < 0 { sums.turned() } else { sums }
    });
    let whole = sums.reduce(|mut a, b| {
        a.add(b);
        a
    });
    if !whole.is_some_and(|whole| whole.is_closed() && whole.volume > 0.0) {
        return Vec::new();
    }
    let is_own = |shape: usize| faces[patch[0]].shape == shape || scene.volume_of(&scene.shapes[shape]).is_some();
    let walls = parts.into_iter().filter(|((shape, _), _)| !is_own(*shape)).map(|((shape, side), mut triangles)| {
        triangles.sort_unstable();
        let Geometry::Mesh(mesh) = &scene.shapes[shape].geometry else { unreachable!("patches are of triangles") };
        let triangles = (triangles.len() < mesh.triangles.len()).then_some(triangles);
        Wall { shape, triangles, interior: 0, is_turned: side < 0 }
    });
    let walls: Vec<Wall> = walls.collect();
    // What shines or has a pattern of normals is not the same from both sides.
    if walls.iter().any(|wall| wall.is_turned && !may_be_turned(scene, &scene.shapes[wall.shape])) { Vec::new() } else { walls }
}

/// Discs that close tubes, and tubes that discs close.
fn ends_of_tubes(scene: &Scene, weld: &mut Weld, shapes: &[usize], is_own: &dyn Fn(usize) -> bool) -> impl Iterator<Item = Wall> {
    let mut surfaces: HashMap<usize, Sums> = HashMap::new();
    for &shape in shapes {
        let geometry = &scene.shapes[shape].geometry;
        let node = weld.add(geometry)[0];
        let part = summed(shape, geometry, None);
        match surfaces.entry(weld.surface(node)) {
            Entry::Occupied(mut sums) => sums.get_mut().add(part),
            Entry::Vacant(new) => {
                new.insert(part);
            }
        }
    }
    let mut walls = Vec::new();
    for surface in surfaces.into_values().filter(|s| s.is_closed() && s.volume > 0.0) {
        if surface.parts.iter().any(|(shape, _)| is_own(*shape)) {
            let others = surface.parts.into_iter().filter(|(shape, _)| !is_own(*shape));
            walls.extend(others.map(|(shape, _)| Wall { shape, triangles: None, interior: 0, is_turned: false }));
        }
    }
    walls.into_iter()
}

fn may_be_turned(scene: &Scene, shape: &Shape) -> bool {
    let is_mapped = |m: usize| scene.materials[m].normals().is_some();
    let is_even = !scene.made_of(shape.material).into_iter().any(|m| is_mapped(m) || scene.grains.contains_key(&m));
    shape.emission.is_none() && is_even
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
