//! Bodies: connected surfaces that bound one volume, with the cavities in them. What lies in what is found from their surfaces by points and rays.

use super::Scene;
use super::inside::{crossings, up};
use super::volumes::MOST_BOXES;
use super::weld::Weld;
use crate::geometry::world::{Ray, World};
use crate::geometry::{Bounds, Geometry, Instance, LensForm, Mesh, bounds, corners};
use glam::{DAffine3, DVec3};
use std::cell::OnceCell;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::rc::Rc;
use std::sync::Arc;

/// Points of a body's triangles beside the outermost.
const CENTROIDS: usize = 8;
/// Copies of a mesh with more parts than this count as bodies whole.
const MOST_PARTS: usize = 16;

/// A closed surface around a volume, or an open one.
pub(super) struct Body {
    /// The first of its shapes.
    pub shape: usize,
    /// What it is a body of.
    pub interior: usize,
    pub bounds: Bounds,
    /// Whether its surface has an inside.
    pub is_closed: bool,
    /// Volume by its surface, m^3: negative for a cavity.
    volume: f64,
    /// Points of its surface, and normals there.
    points: Vec<(DVec3, DVec3)>,
    /// The surfaces around it.
    solids: Vec<Placed>,
}

/// Surfaces in a space of their own, of meshes some triangles perhaps.
struct Solid {
    parts: Vec<(Geometry, Option<Vec<usize>>)>,
    world: OnceCell<World>,
}

/// A solid, and the way to its space.
struct Placed {
    solid: Rc<Solid>,
    to_solid: DAffine3,
}

/// Which body each triangle of a shape is part of.
pub(super) enum Part {
    Whole(usize),
    Split(Vec<usize>),
}

/// The bodies of some shapes.
#[derive(Default)]
pub(super) struct Bodies {
    pub list: Vec<Body>,
    /// By shape.
    pub of: HashMap<usize, Part>,
}

/// What is summed over a surface.
#[derive(Clone)]
pub(super) struct Sums {
    shape: usize,
    bounds: Bounds,
    /// Twice the area's vector, and twice the area.
    vector: DVec3,
    area: f64,
    /// m^3, where it is closed; negative if it faces inwards.
    pub volume: f64,
    /// Ends of tubes that no disc closes yet.
    open_ends: i32,
    pub parts: Vec<(usize, Option<Vec<usize>>)>,
    points: Vec<(DVec3, DVec3)>,
}

impl Bodies {
    /// The bodies of interior `interior` that `shapes` bound.
    fn add(&mut self, scene: &Scene, interior: usize, shapes: &[usize]) {
        let whole = shapes.iter().fold(Bounds::EMPTY, |b, &s| b.union(bounds(&scene.shapes[s].geometry)));
        let mut weld = Weld::new(whole);
        let nodes: Vec<Vec<usize>> = shapes.iter().map(|&s| weld.add(&scene.shapes[s].geometry)).collect();
        let mut sums: Vec<Sums> = Vec::new();
        let mut of_root: HashMap<usize, usize> = HashMap::new();
        let mut of: Vec<(usize, Part)> = Vec::new();
        // The parts of a mesh that stands in many places are found once.
        let mut parts_of_mesh: HashMap<*const Mesh, Vec<(Rc<Solid>, Sums)>> = HashMap::new();
        let mut placed: HashMap<usize, Placed> = HashMap::new();
        for (&shape, nodes) in shapes.iter().zip(&nodes) {
            let geometry = &scene.shapes[shape].geometry;
            if let Geometry::Instance(instance) = geometry {
                let parts = parts_of_mesh.entry(Arc::as_ptr(instance.mesh())).or_insert_with(|| {
                    let mesh = Geometry::Mesh(instance.mesh().clone());
                    parts(instance.mesh())
                        .into_iter()
                        .map(|part| (Rc::new(Solid::of(&part.parts, |_| mesh.clone())), part))
                        .collect()
                });
                of.push((shape, split(parts, sums.len(), instance.mesh().triangles.len())));
                for (solid, part) in parts.iter() {
                    placed.insert(sums.len(), Placed { solid: solid.clone(), to_solid: instance.to_world().inverse() });
                    sums.push(part.placed(shape, instance));
                }
                continue;
            }
            let mut mine: HashMap<usize, Vec<usize>> = HashMap::new();
            let mut order = Vec::new();
            for (t, &node) in nodes.iter().enumerate() {
                let root = weld.surface(node);
                mine.entry(root)
                    .or_insert_with(|| {
                        order.push(root);
                        Vec::new()
                    })
                    .push(t);
            }
            let mut split = vec![0; nodes.len()];
            for root in &order {
                let triangles = &mine[root];
                let is_whole = order.len() == 1;
                let part = summed(shape, geometry, (!is_whole).then(|| triangles.clone())).with_points(geometry);
                let body = *of_root.entry(*root).or_insert(sums.len());
                triangles.iter().for_each(|&t| split[t] = body);
                match sums.get_mut(body) {
                    Some(sum) => sum.add(part),
                    None => sums.push(part),
                }
            }
            of.push((shape, if order.len() == 1 { Part::Whole(split[0]) } else { Part::Split(split) }));
        }
        let mut body = |(i, sums): (usize, Sums)| {
            let here = || Placed {
                solid: Rc::new(Solid::of(&sums.parts, |s| scene.shapes[s].geometry.clone())),
                to_solid: DAffine3::IDENTITY,
            };
            let solids = vec![placed.remove(&i).unwrap_or_else(here)];
            let (is_closed, Sums { shape, bounds, volume, points, .. }) = (sums.is_closed(), sums);
            Body { shape, interior, bounds, is_closed, volume, points, solids }
        };
        let bodies: Vec<Body> = sums.into_iter().enumerate().map(&mut body).collect();
        let (bodies, index) = with_cavities(bodies, self.list.len());
        self.list.extend(bodies);
        self.of.extend(of.into_iter().map(|(shape, part)| match part {
            Part::Whole(b) => (shape, Part::Whole(index[b])),
            Part::Split(list) => (shape, Part::Split(list.into_iter().map(|b| index[b]).collect())),
        }));
    }

    /// The bodies of these interiors.
    pub fn of_interiors(scene: &Scene, which: impl Fn(usize) -> bool) -> Self {
        let mut shapes: HashMap<usize, Vec<usize>> = HashMap::new();
        for (i, shape) in scene.shapes.iter().enumerate() {
            if let Some(interior) = scene.volume_of(shape).filter(|&i| which(i)) {
                shapes.entry(interior).or_default().push(i);
            }
        }
        let mut interiors: Vec<usize> = shapes.keys().copied().collect();
        interiors.sort_unstable();
        let mut bodies = Bodies::default();
        interiors.iter().for_each(|i| bodies.add(scene, *i, &shapes[i]));
        bodies
    }
}

/// The same with cavities as part of the least body that surrounds each, and where each then is, counted from `first`.
fn with_cavities(mut bodies: Vec<Body>, first: usize) -> (Vec<Body>, Vec<usize>) {
    let mut holder: Vec<usize> = (0..bodies.len()).collect();
    let (cavities, solids): (Vec<usize>, Vec<usize>) =
        (0..bodies.len()).filter(|&b| bodies[b].is_closed).partition(|&b| bodies[b].volume < 0.0);
    let are_few = cavities.len().saturating_mul(solids.len()) <= MOST_BOXES;
    for cavity in cavities {
        let holds = |b: &usize| are_few && bodies[*b].surrounds(&bodies[cavity]);
        match solids.iter().copied().filter(holds).min_by(|&a, &b| bodies[a].volume.total_cmp(&bodies[b].volume)) {
            Some(around) => holder[cavity] = around,
            None => bodies[cavity].is_closed = false,
        }
    }
    let mut index = vec![0; bodies.len()];
    let (mut list, mut cavities): (Vec<Body>, Vec<(usize, Body)>) = (Vec::new(), Vec::new());
    for (i, body) in bodies.into_iter().enumerate() {
        if holder[i] == i {
            index[i] = first + list.len();
            list.push(body);
        } else {
            cavities.push((i, body));
        }
    }
    for (i, cavity) in cavities {
        index[i] = index[holder[i]];
        let body = &mut list[index[i] - first];
        body.points.extend(cavity.points);
        body.solids.extend(cavity.solids);
    }
    (list, index)
}

/// Each connected part of a mesh in its own space, or all as one.
fn parts(mesh: &Arc<Mesh>) -> Vec<Sums> {
    let geometry = Geometry::Mesh(mesh.clone());
    let mut weld = Weld::new(bounds(&geometry));
    let nodes = weld.add(&geometry);
    let mut parts: HashMap<usize, Vec<usize>> = HashMap::new();
    for (t, node) in nodes.into_iter().enumerate() {
        parts.entry(weld.surface(node)).or_default().push(t);
    }
    let of = |triangles| summed(0, &geometry, triangles).with_points(&geometry);
    if parts.len() == 1 || parts.len() > MOST_PARTS {
        return vec![of(None)];
    }
    let mut parts: Vec<Vec<usize>> = parts.into_values().collect();
    parts.sort_by_key(|p| p[0]);
    parts.into_iter().map(|triangles| of(Some(triangles))).collect()
}

/// Which of these parts each triangle of a mesh is of, counted from `first`.
fn split(parts: &[(Rc<Solid>, Sums)], first: usize, triangles: usize) -> Part {
    if parts.len() == 1 {
        return Part::Whole(first);
    }
    let mut of = vec![first; triangles];
    for (i, (_, part)) in parts.iter().enumerate() {
        part.parts.iter().filter_map(|(_, list)| list.as_ref()).flatten().for_each(|&t| of[t] = first + i);
    }
    Part::Split(of)
}

/// Some triangles of a shape, or all of it.
pub(super) fn summed(shape: usize, geometry: &Geometry, triangles: Option<Vec<usize>>) -> Sums {
    let mut sums = Sums {
        shape,
        bounds: Bounds::EMPTY,
        vector: DVec3::ZERO,
        area: 0.0,
        volume: 0.0,
        open_ends: 0,
        parts: Vec::new(),
        points: Vec::new(),
    };
    match geometry {
        Geometry::Mesh(mesh) => {
            let mut add = |t: usize| {
                let c = corners(mesh, t);
                let doubled = (c[1] - c[0]).cross(c[2] - c[0]);
                sums.vector += doubled;
                sums.area += doubled.length();
                sums.volume += c[0].dot(doubled) / 6.0;
                sums.bounds = c.iter().fold(sums.bounds, |b, &p| b.union(Bounds { min: p, max: p }));
            };
            match &triangles {
                Some(list) => list.iter().for_each(|&t| add(t)),
                None => (0..mesh.triangles.len()).for_each(add),
            }
        }
        Geometry::Disc { center, normal, radius } => {
            let doubled = *normal * (2.0 * PI * radius * radius);
            (sums.vector, sums.area, sums.open_ends) = (doubled, doubled.length(), -1);
            sums.volume = center.dot(doubled) / 6.0;
            sums.bounds = bounds(geometry);
        }
        Geometry::Cylinder { length, radius, .. } => {
            (sums.area, sums.open_ends) = (4.0 * PI * radius * length, 2);
            sums.volume = PI * radius * radius * length * 2.0 / 3.0;
            sums.bounds = bounds(geometry);
        }
        Geometry::Sphere { radius, .. } => {
            (sums.area, sums.volume) = (8.0 * PI * radius * radius, 4.0 / 3.0 * PI * radius.powi(3));
            sums.bounds = bounds(geometry);
        }
        Geometry::LensFace(face) => {
            let (area, vector, volume) = face.sums();
            (sums.vector, sums.area, sums.volume) = (2.0 * vector, 2.0 * area, volume);
            sums.open_ends = match face.form {
                LensForm::Edge { .. } => 2,
                LensForm::Annulus { .. } => 0,
                LensForm::Surface { .. } => -1,
            };
            sums.bounds = bounds(geometry);
        }
        Geometry::Instance(_) => {}
    }
    sums.parts.push((shape, triangles));
    sums
}

impl Sums {
    pub fn add(&mut self, more: Sums) {
        self.bounds = self.bounds.union(more.bounds);
        self.vector += more.vector;
        self.area += more.area;
        self.volume += more.volume;
        self.open_ends += more.open_ends;
        self.parts.extend(more.parts);
        self.points.extend(more.points);
    }

    /// The same surface, turned round.
    pub fn turned(self) -> Self {
        Sums { vector: -self.vector, volume: -self.volume, ..self }
    }

    pub fn is_closed(&self) -> bool {
        self.open_ends == 0 && self.vector.length() < 1e-6 * self.area
    }

    fn with_points(self, geometry: &Geometry) -> Self {
        let points = self.parts.iter().flat_map(|(_, triangles)| points(geometry, triangles.as_deref())).collect();
        Sums { points, ..self }
    }

    /// The same of an instance, for a part of its mesh.
    fn placed(&self, shape: usize, instance: &Instance) -> Sums {
        let m = instance.to_world();
        // Area vectors become these (their order of corners stays), volumes the determinant's share.
        let (det, cofactors) = (m.matrix3.determinant(), m.matrix3.inverse().transpose() * m.matrix3.determinant());
        let corner = |i: u32| {
            let pick = |bit: u32, lo: f64, hi: f64| if i >> bit & 1 == 1 { hi } else { lo };
            let (lo, hi) = (self.bounds.min, self.bounds.max);
            m.transform_point3(DVec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z)))
        };
        Sums {
            shape,
            bounds: (0..8).map(corner).fold(Bounds::EMPTY, |b, p| b.union(Bounds { min: p, max: p })),
            vector: cofactors * self.vector,
            area: cofactors.x_axis.length().max(cofactors.y_axis.length()).max(cofactors.z_axis.length()) * self.area,
            volume: det * self.volume,
            open_ends: 0,
            parts: self.parts.iter().map(|(_, triangles)| (shape, triangles.clone())).collect(),
            points: self.points.iter().map(|(p, n)| (m.transform_point3(*p), (cofactors * *n).normalize_or_zero())).collect(),
        }
    }
}

/// Directions in which a body's outermost points are looked for: to faces, edges and corners of a cube.
fn directions() -> impl Iterator<Item = DVec3> {
    let step = |i: i32| f64::from(i % 3 - 1);
    (0..27).filter(|&i| i != 13).map(move |i| DVec3::new(step(i), step(i / 3), step(i / 9)).normalize())
}

/// Points of a surface and their normals.
fn points(geometry: &Geometry, triangles: Option<&[usize]>) -> Vec<(DVec3, DVec3)> {
    let mut out = Vec::new();
    match geometry {
        Geometry::Mesh(mesh) => of_mesh(mesh, triangles, &mut out),
        Geometry::Instance(_) => {}
        Geometry::Sphere { center, radius } => out.extend(directions().map(|d| (*center + d * *radius, d))),
        Geometry::Disc { center, normal, radius } => {
            let (x, y) = normal.any_orthonormal_pair();
            out.extend((0..8).map(|i| {
                let (sin, cos) = (f64::from(i) * PI / 4.0).sin_cos();
                (*center + (x * cos + y * sin) * (0.999 * radius), *normal)
            }));
        }
        Geometry::Cylinder { base, axis, length, radius } => {
            let (x, y) = axis.any_orthonormal_pair();
            out.extend((0..24).map(|i| {
                let (sin, cos) = (f64::from(i) * PI / 4.0).sin_cos();
                let n = x * cos + y * sin;
                (*base + *axis * (length * [0.001, 0.5, 0.999][i as usize / 8]) + n * *radius, n)
            }));
        }
        Geometry::LensFace(face) => out.extend(face.points()),
    }
    out
}

/// The outermost corners of a mesh, and the middles of a few triangles.
fn of_mesh(mesh: &Mesh, triangles: Option<&[usize]>, out: &mut Vec<(DVec3, DVec3)>) {
    let count = triangles.map_or(mesh.triangles.len(), <[usize]>::len);
    let number = |i: usize| triangles.map_or(i, |list| list[i]);
    let mut near = |t: usize, corner: Option<usize>| {
        let c = corners(mesh, t);
        let middle = (c[0] + c[1] + c[2]) / 3.0;
        let p = corner.map_or(middle, |k| c[k].lerp(middle, 1e-3));
        out.push((p, (c[1] - c[0]).cross(c[2] - c[0]).normalize_or_zero()));
    };
    for d in directions() {
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for t in (0..count).map(number) {
            for (k, p) in corners(mesh, t).into_iter().enumerate() {
                if p.dot(d) > best.0 {
                    best = (p.dot(d), t, k);
                }
            }
        }
        near(best.1, Some(best.2));
    }
    (0..count).step_by(count.div_ceil(CENTROIDS)).for_each(|i| near(number(i), None));
}

impl Solid {
    fn of(parts: &[(usize, Option<Vec<usize>>)], geometry: impl Fn(usize) -> Geometry) -> Self {
        Solid { parts: parts.iter().map(|(shape, list)| (geometry(*shape), list.clone())).collect(), world: OnceCell::new() }
    }

    fn world(&self) -> &World {
        self.world.get_or_init(|| {
            let some = |(geometry, list): &(Geometry, Option<Vec<usize>>)| match (geometry, list) {
                (Geometry::Mesh(mesh), Some(list)) => Geometry::Mesh(Arc::new(some_of(mesh, list))),
                _ => geometry.clone(),
            };
            World::new(&self.parts.iter().map(some).collect::<Vec<_>>())
        })
    }
}

impl Placed {
    /// How often its surfaces are around a point of the world, cavities counted off.
    fn count(&self, p: DVec3) -> i64 {
        let mut count = 0;
        let ray = Ray::new(self.to_solid.transform_point3(p), up());
        crossings(self.solid.world(), ray, |_, entered| count += if entered { -1 } else { 1 });
        // Mirrored, its triangles are turned the other way round.
        if self.to_solid.matrix3.determinant() < 0.0 { -count } else { count }
    }
}

impl Body {
    /// Is `p` inside?
    fn contains(&self, p: DVec3) -> bool {
        let b = &self.bounds;
        b.min.cmple(p).all() && p.cmple(b.max).all() && self.solids.iter().map(|solid| solid.count(p)).sum::<i64>() > 0
    }

    /// Points of its surface, moved a hair towards its outside (or, for -1, its inside).
    fn near_surface(&self, side: f64) -> impl Iterator<Item = DVec3> {
        let size = (self.bounds.max - self.bounds.min).length();
        let step = side * (1e-6 * size + 1e-12 * self.bounds.min.abs().max(self.bounds.max.abs()).max_element());
        self.points.iter().map(move |(p, n)| *p + *n * step)
    }

    /// Do all points of that surface lie within this one?
    fn surrounds(&self, b: &Body) -> bool {
        self.bounds.overlaps(&b.bounds) && b.near_surface(1.0).chain(b.near_surface(-1.0)).all(|p| self.contains(p))
    }

    /// Does `b` lie wholly within it? (Faces may coincide.)
    pub fn holds(&self, b: &Body) -> bool {
        let slack = DVec3::splat(1e-6 * (self.bounds.max - self.bounds.min).length());
        let fits = (self.bounds.min - slack).cmple(b.bounds.min).all() && b.bounds.max.cmple(self.bounds.max + slack).all();
        fits && b.near_surface(-1.0).all(|p| self.contains(p)) && !self.near_surface(1.0).any(|p| b.contains(p))
    }

    /// Have the two a part in common?
    pub fn meets(&self, b: &Body) -> bool {
        self.near_surface(-1.0).any(|p| b.contains(p)) || b.near_surface(-1.0).any(|p| self.contains(p))
    }
}

/// A mesh of some of the triangles.
pub(super) fn some_of(mesh: &Mesh, triangles: &[usize]) -> Mesh {
    Mesh { triangles: triangles.iter().map(|&t| mesh.triangles[t]).collect(), ..mesh.clone() }
}
