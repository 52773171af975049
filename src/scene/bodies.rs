//! Bodies: connected surfaces that bound one volume, with the cavities in them. What lies in what is found from their surfaces by points and rays.

use super::inside::{crossings, up};
use super::{Passage, Scene, Shape};
use crate::geometry::world::{Ray, World};
use crate::geometry::{Bounds, Geometry, Instance, Mesh, bounds, corners};
use glam::DVec3;
use std::cell::OnceCell;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Vertices whose distance is below this share of the size of all that they may belong to are one.
const GRAIN: f64 = 1e-6;
/// Points of a body's triangles beside the outermost.
const CENTROIDS: usize = 8;
/// Walls of a solid are looked for this many shapes away from its glass.
const FARTHEST: usize = 8;
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
    /// Its shapes, and of meshes which triangles.
    parts: Vec<(usize, Option<Vec<usize>>)>,
    /// Points of its surface, and normals there.
    points: Vec<(DVec3, DVec3)>,
    world: OnceCell<World>,
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
struct Sums {
    shape: usize,
    bounds: Bounds,
    /// Twice the area's vector, and twice the area.
    vector: DVec3,
    area: f64,
    volume: f64,
    /// Ends of tubes that no disc closes yet.
    open_ends: i32,
    parts: Vec<(usize, Option<Vec<usize>>)>,
    points: Vec<(DVec3, DVec3)>,
}

/// Sets that are united.
#[derive(Default)]
struct Sets(Vec<usize>);

impl Sets {
    fn add(&mut self) -> usize {
        self.0.push(self.0.len());
        self.0.len() - 1
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// Vertices by their places, and the surfaces that they are of.
pub(super) struct Weld {
    origin: DVec3,
    grain: f64,
    places: HashMap<[i64; 3], usize>,
    sets: Sets,
}

impl Weld {
    /// Of what is as large as this.
    pub fn new(size: Bounds) -> Self {
        let grain = (GRAIN * (size.max - size.min).length()).max(f64::MIN_POSITIVE);
        Weld { origin: size.min, grain, places: HashMap::new(), sets: Sets::default() }
    }

    /// The place of a vertex.
    pub fn place(&self, p: DVec3) -> [i64; 3] {
        ((p - self.origin) / self.grain).to_array().map(|v| v.round() as i64)
    }

    fn knows(&self, p: DVec3) -> bool {
        self.places.contains_key(&self.place(p))
    }

    fn node(&mut self, p: DVec3) -> usize {
        let place = self.place(p);
        let sets = &mut self.sets;
        *self.places.entry(place).or_insert_with(|| sets.add())
    }

    /// A node of the surface of each triangle, or of the whole.
    fn add(&mut self, geometry: &Geometry) -> Vec<usize> {
        match geometry {
            Geometry::Mesh(mesh) => {
                let nodes: Vec<usize> = mesh.positions.iter().map(|&p| self.node(p)).collect();
                for t in &mesh.triangles {
                    let [a, b, c] = t.map(|v| nodes[v as usize]);
                    self.sets.unite(a, b);
                    self.sets.unite(a, c);
                }
                mesh.triangles.iter().map(|t| nodes[t[0] as usize]).collect()
            }
            Geometry::Disc { center, .. } => vec![self.node(*center)],
            Geometry::Cylinder { base, axis, length, .. } => {
                let ends = [self.node(*base), self.node(*base + *axis * *length)];
                self.sets.unite(ends[0], ends[1]);
                vec![ends[0]]
            }
            Geometry::Sphere { .. } | Geometry::Instance(_) => vec![self.sets.add()],
        }
    }
}

/// Points that tell where a shape is: a ray can be in a face of it only if they are.
fn connections(geometry: &Geometry) -> Vec<DVec3> {
    match geometry {
        Geometry::Mesh(mesh) => mesh.positions.clone(),
        Geometry::Disc { center, .. } => vec![*center],
        Geometry::Cylinder { base, axis, length, .. } => vec![*base, *base + *axis * *length],
        Geometry::Sphere { .. } | Geometry::Instance(_) => Vec::new(),
    }
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
        let mut parts_of_mesh: HashMap<*const Mesh, Vec<Sums>> = HashMap::new();
        for (&shape, nodes) in shapes.iter().zip(&nodes) {
            let geometry = &scene.shapes[shape].geometry;
            if let Geometry::Instance(instance) = geometry {
                let parts = parts_of_mesh.entry(Arc::as_ptr(instance.mesh())).or_insert_with(|| parts(instance.mesh()));
                of.push((shape, split(parts, sums.len(), instance.mesh().triangles.len())));
                sums.extend(parts.iter().map(|part| part.placed(shape, instance)));
                continue;
            }
            let mut mine: HashMap<usize, Vec<usize>> = HashMap::new();
            let mut order = Vec::new();
            for (t, &node) in nodes.iter().enumerate() {
                let root = weld.sets.root(node);
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
        // Bodies, and the cavities in them.
        let mut bodies: Vec<Body> = sums.into_iter().map(|s| s.body(interior)).collect();
        let mut holder: Vec<usize> = (0..bodies.len()).collect();
        for cavity in 0..bodies.len() {
            if bodies[cavity].is_closed && bodies[cavity].volume < 0.0 {
                let holds =
                    |b: &usize| bodies[*b].volume > 0.0 && bodies[*b].is_closed && bodies[*b].surrounds(scene, &bodies[cavity]);
                let around = (0..bodies.len()).filter(holds).min_by(|&a, &b| bodies[a].volume.total_cmp(&bodies[b].volume));
                match around {
                    Some(around) => holder[cavity] = around,
                    None => bodies[cavity].is_closed = false,
                }
            }
        }
        let mut index = vec![usize::MAX; bodies.len()];
        let mut cavities: Vec<(usize, Body)> = Vec::new();
        for (i, body) in bodies.into_iter().enumerate() {
            if holder[i] == i {
                index[i] = self.list.len();
                self.list.push(body);
            } else {
                cavities.push((i, body));
            }
        }
        for (i, cavity) in cavities {
            index[i] = index[holder[i]];
            let body = &mut self.list[index[i]];
            body.parts.extend(cavity.parts);
            body.points.extend(cavity.points);
            body.world = OnceCell::new();
        }
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

/// Each connected part of a mesh in its own space, or all as one.
fn parts(mesh: &Arc<Mesh>) -> Vec<Sums> {
    let geometry = Geometry::Mesh(mesh.clone());
    let mut weld = Weld::new(bounds(&geometry));
    let nodes = weld.add(&geometry);
    let mut parts: HashMap<usize, Vec<usize>> = HashMap::new();
    for (t, node) in nodes.into_iter().enumerate() {
        parts.entry(weld.sets.root(node)).or_default().push(t);
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
fn split(parts: &[Sums], first: usize, triangles: usize) -> Part {
    if parts.len() == 1 {
        return Part::Whole(first);
    }
    let mut of = vec![first; triangles];
    for (i, part) in parts.iter().enumerate() {
        part.parts.iter().filter_map(|(_, list)| list.as_ref()).flatten().for_each(|&t| of[t] = first + i);
    }
    Part::Split(of)
}

/// Some triangles of a shape, or all of it.
fn summed(shape: usize, geometry: &Geometry, triangles: Option<Vec<usize>>) -> Sums {
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
        Geometry::Instance(_) => {}
    }
    sums.parts.push((shape, triangles));
    sums
}

impl Sums {
    fn add(&mut self, more: Sums) {
        self.bounds = self.bounds.union(more.bounds);
        self.vector += more.vector;
        self.area += more.area;
        self.volume += more.volume;
        self.open_ends += more.open_ends;
        self.parts.extend(more.parts);
    }

    fn is_closed(&self) -> bool {
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

    fn body(self, interior: usize) -> Body {
        let is_closed = self.is_closed();
        let Sums { shape, bounds, volume, parts, points, .. } = self;
        Body { shape, interior, bounds, is_closed, volume, parts, points, world: OnceCell::new() }
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

impl Body {
    fn world(&self, scene: &Scene) -> &World {
        self.world.get_or_init(|| {
            let of = |(shape, triangles): &(usize, Option<Vec<usize>>)| {
                let mesh = match &scene.shapes[*shape].geometry {
                    Geometry::Instance(instance) => Arc::new(instance.flattened()),
                    Geometry::Mesh(mesh) => mesh.clone(),
                    other => return other.clone(),
                };
                Geometry::Mesh(match triangles {
                    Some(list) => Arc::new(some_of(&mesh, list)),
                    None => mesh,
                })
            };
            World::new(&self.parts.iter().map(of).collect::<Vec<_>>())
        })
    }

    /// Is `p` inside?
    fn contains(&self, scene: &Scene, p: DVec3) -> bool {
        let b = &self.bounds;
        b.min.cmple(p).all() && p.cmple(b.max).all() && {
            let mut count = 0i64;
            crossings(self.world(scene), Ray::new(p, up()), |_, entered| count += if entered { -1 } else { 1 });
            count > 0
        }
    }

    /// Points of its surface, moved a hair towards its outside (or, for -1, its inside).
    fn near_surface(&self, side: f64) -> impl Iterator<Item = DVec3> {
        let size = (self.bounds.max - self.bounds.min).length();
        let step = side * (1e-6 * size + 1e-12 * self.bounds.min.abs().max(self.bounds.max.abs()).max_element());
        self.points.iter().map(move |(p, n)| *p + *n * step)
    }

    /// Do all points of that surface lie within this one?
    fn surrounds(&self, scene: &Scene, b: &Body) -> bool {
        self.bounds.overlaps(&b.bounds) && b.near_surface(1.0).chain(b.near_surface(-1.0)).all(|p| self.contains(scene, p))
    }

    /// Does `b` lie wholly within it? (Faces may coincide.)
    pub fn holds(&self, scene: &Scene, b: &Body) -> bool {
        let slack = DVec3::splat(1e-6 * (self.bounds.max - self.bounds.min).length());
        let fits = (self.bounds.min - slack).cmple(b.bounds.min).all() && b.bounds.max.cmple(self.bounds.max + slack).all();
        fits && b.near_surface(-1.0).all(|p| self.contains(scene, p)) && !self.near_surface(1.0).any(|p| b.contains(scene, p))
    }

    /// Have the two a part in common?
    pub fn meets(&self, scene: &Scene, b: &Body) -> bool {
        self.near_surface(-1.0).any(|p| b.contains(scene, p)) || b.near_surface(-1.0).any(|p| self.contains(scene, p))
    }
}

/// A mesh of some of the triangles.
pub(super) fn some_of(mesh: &Mesh, triangles: &[usize]) -> Mesh {
    Mesh { triangles: triangles.iter().map(|&t| mesh.triangles[t]).collect(), ..mesh.clone() }
}

/// Opaque shapes that close the surface of a volume, with the triangles that do (or all) and its interior: a solid that is glass on some sides only.
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
            nodes.iter().enumerate().for_each(|(t, &node)| mine.entry(weld.sets.root(node)).or_default().push(t));
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
