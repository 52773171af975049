//! Which volumes there are, and which of them rules where they overlap.
//!
//! A volume is what is inside: index, absorption, medium, priority. Surfaces of any finish bound it. Volumes of equal content are one, unless the scene gives
//! them names; copies of one that overlap count once. Of different ones the greater priority rules. Where priorities are equal, a body wholly within another
//! rules there; where bodies only overlap, that whose volume comes later in the file, by the first of its shapes.

use super::bodies::{Bodies, Body, Part, some_of};
use super::json::load::Loader;
use super::matched::Indices;
use super::walls::{Wall, walls};
use super::{Geometry, Interior, Material, Scene, Shape};
use crate::geometry::{Bounds, Mesh, bounds, corners};
use glam::DVec3;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// Pairs of bodies that are looked at, at most.
const MOST_PAIRS: usize = 200_000;
/// Pairs of boxes that are looked at, at most: no scene is to keep the loader for minutes.
pub(super) const MOST_BOXES: usize = 100_000_000;

/// The volumes of a scene in the making.
#[derive(Default)]
pub(super) struct Volumes {
    indices: Indices,
    /// Those without a name, by their content.
    by_content: HashMap<String, usize>,
}

impl Loader {
    /// Adds a volume that is no other's, whatever is in it.
    pub(super) fn named_volume(&mut self, interior: Interior) -> usize {
        self.add_volume(interior).0
    }

    /// The volume of this content.
    pub(super) fn volume(&mut self, interior: Interior) -> usize {
        let (new, index) = self.add_volume(interior);
        let Interior { sigma_a, sigma_s, g, priority, .. } = &self.scene.interiors[new];
        let content = format!("{index} {sigma_a:?} {sigma_s:?} {g} {priority}");
        let first = *self.volumes.by_content.entry(content).or_insert(new);
        if first != new {
            self.scene.interiors.pop();
        }
        first
    }

    /// The number of a volume added, and that of the first of its index.
    fn add_volume(&mut self, interior: Interior) -> (usize, usize) {
        let new = self.scene.interiors.len();
        self.scene.interiors.push(interior);
        let bins = self.scene.film.bins;
        (new, self.volumes.indices.add(&mut self.scene.interiors, new, (bins.min_nm, bins.max_nm)))
    }
}

impl Scene {
    /// Finds what closes volumes beside their own surfaces and how they are nested, and puts interiors in the order of the file.
    pub(super) fn settle_volumes(&mut self) {
        self.raise_walls();
        let nesting = Nesting::of(self);
        let depths = nesting.depths();
        // A shape whose bodies lie at different depths becomes one for each of these.
        let mut shapes: Vec<(Shape, u32)> = Vec::with_capacity(self.shapes.len());
        for (i, shape) in std::mem::take(&mut self.shapes).into_iter().enumerate() {
            let of: Vec<u32> = match nesting.bodies.of.get(&i) {
                None => vec![0],
                Some(Part::Whole(body)) => vec![depths[*body]],
                Some(Part::Split(bodies)) => bodies.iter().map(|&b| depths[b]).collect(),
            };
            let all: BTreeSet<u32> = of.iter().copied().collect();
            if all.len() == 1 {
                shapes.push((shape, of[0]));
                continue;
            }
            for depth in all {
                let triangles: Vec<usize> = (0..of.len()).filter(|&t| of[t] == depth).collect();
                shapes.push((cut(&shape, &triangles), depth));
            }
        }
        self.renumber(shapes);
    }

    /// Makes shapes of the walls of volumes.
    fn raise_walls(&mut self) {
        let walls = walls(self);
        for of_shape in walls.chunk_by(|a, b| a.shape == b.shape).rev() {
            let shape = of_shape[0].shape;
            let whole = self.shapes.remove(shape);
            let mut parts: Vec<Shape> = of_shape.iter().map(|wall| part_of_wall(&whole, wall)).collect();
            if of_shape.iter().all(|wall| wall.triangles.is_some()) {
                let walled: Vec<usize> = of_shape.iter().filter_map(|wall| wall.triangles.as_ref()).flatten().copied().collect();
                let rest = others(&whole, &walled);
                parts.extend((!rest.is_empty()).then(|| cut(&whole, &rest)));
            }
            self.shapes.splice(shape..shape, parts);
        }
    }

    /// Takes these shapes, whose bodies lie at these depths, and numbers the pairs of an interior and a depth in the order of the shapes.
    fn renumber(&mut self, shapes: Vec<(Shape, u32)>) {
        let bounded: Vec<Option<(usize, u32)>> =
            shapes.iter().map(|(shape, depth)| self.volume_of(shape).map(|interior| (interior, *depth))).collect();
        let mut order = vec![(0, 0)];
        let mut number: HashMap<(usize, u32), usize> = HashMap::new();
        let mut first: Vec<Option<usize>> = vec![None; self.interiors.len()];
        first[0] = Some(0);
        for key in bounded.iter().flatten() {
            let new = *number.entry(*key).or_insert(order.len());
            if new == order.len() {
                order.push(*key);
            }
            first[key.0].get_or_insert(new);
        }
        for (interior, first) in first.iter_mut().enumerate().filter(|(_, first)| first.is_none()) {
            *first = Some(order.len());
            order.push((interior, 0));
        }
        self.interiors = order.iter().map(|&(i, depth)| Interior { depth, ..self.interiors[i].clone() }).collect();
        let first: Vec<usize> = first.into_iter().flatten().collect();
        for interior in self.materials.iter_mut().filter_map(Material::interior_mut) {
            *interior = first[*interior];
        }
        let mut copies: HashMap<(usize, usize), usize> = HashMap::new();
        for ((mut shape, _), key) in shapes.into_iter().zip(bounded) {
            if let Some(key) = key {
                let new = number[&key];
                if shape.interior.is_some() {
                    shape.interior = Some(new);
                } else if new != first[key.0] {
                    shape.material = *copies.entry((shape.material, new)).or_insert_with(|| self.copy_with(shape.material, new));
                }
            }
            self.shapes.push(shape);
        }
    }

    /// A copy of a material that bounds `interior` instead.
    fn copy_with(&mut self, index: usize, interior: usize) -> usize {
        let mut copy = self.materials[index].clone();
        match &mut copy {
            Material::Mix { a, b, .. } => {
                for part in [a, b] {
                    if self.interior_of(*part).is_some() {
                        *part = self.copy_with(*part, interior);
                    }
                }
            }
            Material::NormalMapped { base, .. } => *base = self.copy_with(*base, interior),
            Material::Graded { materials, .. } => {
                materials.iter_mut().for_each(|level| *level = self.copy_with(*level, interior));
            }
            other => other.interior_mut().into_iter().for_each(|own| *own = interior),
        }
        self.materials.push(copy);
        let new = self.materials.len() - 1;
        if let Some(film) = self.thin_films.get(&index).cloned() {
            self.thin_films.insert(new, film);
        }
        new
    }
}

/// A shape as the wall of a volume, with normals out of that.
fn part_of_wall(shape: &Shape, wall: &Wall) -> Shape {
    let mut part = match &wall.triangles {
        Some(triangles) => cut(shape, triangles),
        None => shape.clone(),
    };
    part.interior = Some(wall.interior);
    if let (Geometry::Mesh(mesh), true) = (&mut part.geometry, wall.is_turned) {
        let mesh = Arc::make_mut(mesh);
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh.normals.iter_mut().for_each(|n| *n = -*n);
    }
    part
}

/// Some triangles of a mesh as a shape of its own.
fn cut(shape: &Shape, triangles: &[usize]) -> Shape {
    let mesh = match &shape.geometry {
        Geometry::Mesh(mesh) => some_of(mesh, triangles),
        Geometry::Instance(instance) => some_of(&instance.flattened(), triangles),
        _ => return shape.clone(),
    };
    Shape { geometry: Geometry::Mesh(Arc::new(mesh)), ..shape.clone() }
}

/// The triangles of a mesh that are not among these.
fn others(shape: &Shape, triangles: &[usize]) -> Vec<usize> {
    let Geometry::Mesh(mesh) = &shape.geometry else { return Vec::new() };
    let among: BTreeSet<usize> = triangles.iter().copied().collect();
    (0..mesh.triangles.len()).filter(|t| !among.contains(t)).collect()
}

/// Bodies of equal priority and different volumes that come close to each other, and which lie in which.
struct Nesting {
    bodies: Bodies,
    /// For each body those that hold it.
    holders: Vec<Vec<usize>>,
    /// Pairs of which neither holds the other.
    apart: Vec<[usize; 2]>,
}

impl Nesting {
    fn of(scene: &Scene) -> Self {
        let close = close_volumes(scene);
        let bodies = Bodies::of_interiors(scene, |i| close.contains(&i));
        let list = &bodies.list;
        let mut nesting = Nesting { holders: vec![Vec::new(); list.len()], apart: Vec::new(), bodies: Bodies::default() };
        let boxes: Vec<Bounds> = list.iter().map(|b| b.bounds).collect();
        let priority = |b: &Body| scene.interiors[b.interior].priority;
        let mut pairs = 0;
        meeting(&boxes, |i, j| {
            let (a, b) = (&list[i], &list[j]);
            if a.interior == b.interior || priority(a) != priority(b) || !a.is_closed || !b.is_closed {
                return true;
            }
            pairs += 1;
            match (a.holds(b), b.holds(a)) {
                (true, false) => nesting.holders[j].push(i),
                (false, true) => nesting.holders[i].push(j),
                _ => nesting.apart.push([i, j]),
            }
            pairs < MOST_PAIRS
        });
        Nesting { bodies, ..nesting }
    }

    /// How many bodies of other content than the next hold each: those that hold a body of its own volume hold it as well.
    fn depths(&self) -> Vec<u32> {
        let mut depths: Vec<u32> = vec![0; self.holders.len()];
        // A body is done once all of its holders are: at the latest after as many turns as there are bodies.
        for _ in 0..depths.len() {
            let mut changed = false;
            for (body, holders) in self.holders.iter().enumerate() {
                let depth = holders.iter().map(|&h| depths[h] + 1).max().unwrap_or(0);
                changed |= std::mem::replace(&mut depths[body], depth) != depth;
            }
            if !changed {
                break;
            }
        }
        depths
    }
}

/// Interiors whose box meets that of another of the same priority.
fn close_volumes(scene: &Scene) -> BTreeSet<usize> {
    let mut boxes: HashMap<usize, Bounds> = HashMap::new();
    for shape in &scene.shapes {
        if let Some(interior) = scene.volume_of(shape) {
            let b = boxes.entry(interior).or_insert(Bounds::EMPTY);
            *b = b.union(bounds(&shape.geometry));
        }
    }
    let (interiors, boxes): (Vec<usize>, Vec<Bounds>) = boxes.into_iter().unzip();
    let mut close = BTreeSet::new();
    let priority = |i: usize| scene.interiors[interiors[i]].priority;
    meeting(&boxes, |i, j| {
        if priority(i) == priority(j) {
            close.extend([interiors[i], interiors[j]]);
        }
        true
    });
    close
}

/// Calls `met` for every two boxes that have a point in common, until it says no. False if not all pairs were looked at.
fn meeting(boxes: &[Bounds], mut met: impl FnMut(usize, usize) -> bool) -> bool {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| boxes[a].min.x.total_cmp(&boxes[b].min.x));
    let mut open: Vec<usize> = Vec::new();
    let mut looked_at = 0;
    for &i in &order {
        open.retain(|&j| boxes[j].max.x >= boxes[i].min.x);
        looked_at += open.len();
        let mut near = open.iter().filter(|&&j| boxes[j].overlaps(&boxes[i]));
        if looked_at > MOST_BOXES || !near.all(|&j| met(j.min(i), j.max(i))) {
            return false;
        }
        open.push(i);
    }
    true
}

/// How many different volumes there are in one place, at most, by the boxes of their bodies.
pub(crate) fn most_overlapping(scene: &Scene) -> usize {
    let count = scene.shapes.iter().filter_map(|s| scene.volume_of(s)).collect::<BTreeSet<usize>>().len();
    if count <= 4 {
        return count;
    }
    let (mut boxes, mut of): (Vec<Bounds>, Vec<usize>) = (Vec::new(), Vec::new());
    // Surfaces that are not closed by themselves count together.
    let mut open: HashMap<usize, Vec<&Geometry>> = HashMap::new();
    let mut closed: HashMap<*const Mesh, bool> = HashMap::new();
    for shape in &scene.shapes {
        let Some(interior) = scene.volume_of(shape) else { continue };
        let is_closed = match &shape.geometry {
            Geometry::Instance(i) => *closed.entry(Arc::as_ptr(i.mesh())).or_insert_with(|| area_vector(i.mesh()).is_none()),
            Geometry::Mesh(mesh) => area_vector(mesh).is_none(),
            Geometry::Sphere { .. } => true,
            _ => false,
        };
        if is_closed {
            boxes.push(bounds(&shape.geometry));
            of.push(interior);
        } else {
            open.entry(interior).or_default().push(&shape.geometry);
        }
    }
    for (interior, parts) in open {
        let mut b = parts.iter().fold(Bounds::EMPTY, |b, g| b.union(bounds(g)));
        let upwards = |g: &&Geometry| if let Geometry::Mesh(mesh) = g { area_vector(mesh).map_or(0.0, |v| v.y) } else { 0.0 };
        if parts.iter().map(upwards).sum::<f64>() > 0.0 {
            // A sheet that faces upwards is the surface of something deep.
            b.min.y = f64::NEG_INFINITY;
        }
        boxes.push(b);
        of.push(interior);
    }
    let mut near: Vec<BTreeSet<usize>> = of.iter().map(|&i| BTreeSet::from([i])).collect();
    // In a place where most of them overlap the box that begins last along x meets all others, and begins within them.
    let all_seen = meeting(&boxes, |i, j| {
        let last = if boxes[i].min.x > boxes[j].min.x { i } else { j };
        near[last].insert(of[i + j - last]);
        if boxes[i].min.x == boxes[j].min.x {
            near[i].insert(of[j]);
        }
        near[last].len() < count
    });
    if !all_seen {
        return count;
    }
    near.iter().map(BTreeSet::len).max().unwrap_or(0)
}

/// The sum of a mesh's area vectors, if they do not cancel.
fn area_vector(mesh: &Mesh) -> Option<DVec3> {
    let (mut sum, mut area) = (DVec3::ZERO, 0.0);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = corners(mesh, t);
        let doubled = (b - a).cross(c - a);
        (sum, area) = (sum + doubled, area + doubled.length());
    }
    (sum.length() >= 1e-6 * area).then_some(sum)
}

/// Shapes of different volumes of equal priority that overlap, neither of which holds the other: for each pair the one that gives way, and the one that
/// rules.
pub(super) fn overlaps(scene: &Scene) -> Vec<[usize; 2]> {
    let nesting = Nesting::of(scene);
    let list = &nesting.bodies.list;
    let rank = |b: &Body| (scene.interiors[b.interior].depth, b.interior);
    let meets = |[i, j]: &[usize; 2]| {
        let (a, b) = if rank(&list[*i]) < rank(&list[*j]) { (&list[*i], &list[*j]) } else { (&list[*j], &list[*i]) };
        a.meets(b).then_some([a.shape, b.shape])
    };
    nesting.apart.iter().filter_map(meets).collect()
}
