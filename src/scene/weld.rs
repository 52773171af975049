//! Vertices that are one, and the connected surfaces that they make.

use crate::geometry::{Bounds, Geometry};
use glam::DVec3;
use std::collections::HashMap;

/// Vertices whose distance is below this share of the size of all that they may belong to are one.
pub(super) const GRAIN: f64 = 1e-6;

/// An edge by the places of its ends.
pub(super) type Edge = [[i64; 3]; 2];

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

    /// The edges of a triangle that have a length, and which way they are passed.
    pub fn edges(&self, corners: [DVec3; 3]) -> impl Iterator<Item = (Edge, usize)> {
        let ends = corners.map(|p| self.place(p));
        let edges = (0..3).map(move |i| (ends[i], ends[(i + 1) % 3]));
        edges.filter(|(a, b)| a != b).map(|(a, b)| ([a.min(b), a.max(b)], usize::from(a > b)))
    }

    pub fn knows(&self, p: DVec3) -> bool {
        self.places.contains_key(&self.place(p))
    }

    fn node(&mut self, p: DVec3) -> usize {
        let place = self.place(p);
        let sets = &mut self.sets;
        *self.places.entry(place).or_insert_with(|| sets.add())
    }

    /// The surface that a node is of.
    pub fn surface(&mut self, node: usize) -> usize {
        self.sets.root(node)
    }

    /// A node of the surface of each triangle, or of the whole.
    pub fn add(&mut self, geometry: &Geometry) -> Vec<usize> {
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
            Geometry::LensFace(face) => {
                let ends: Vec<usize> = face.ends().into_iter().map(|p| self.node(p)).collect();
                self.sets.unite(ends[0], ends[ends.len() - 1]);
                vec![ends[0]]
            }
            Geometry::Sphere { .. } | Geometry::Instance(_) => vec![self.sets.add()],
        }
    }
}

/// The vertices of a shape.
pub(super) fn connections(geometry: &Geometry) -> Vec<DVec3> {
    match geometry {
        Geometry::Mesh(mesh) => mesh.positions.clone(),
        Geometry::Disc { center, .. } => vec![*center],
        Geometry::Cylinder { base, axis, length, .. } => vec![*base, *base + *axis * *length],
        Geometry::LensFace(face) => face.ends(),
        Geometry::Sphere { .. } | Geometry::Instance(_) => Vec::new(),
    }
}
