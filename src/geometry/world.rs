//! Geometry in double precision under a plain median-split tree.

use super::Geometry;
pub use super::intersect::{Hit, Ray};
use super::intersect::{bounds, intersect};
use glam::DVec3;

/// Hits whose distances differ by less than this share of the coordinates' size are one place.
const COINCIDENT: f64 = 64.0 * f64::EPSILON;

/// The geometry of all shapes, ready for rays.
pub struct World {
    shapes: Vec<Geometry>,
    /// Shape and triangle of each primitive.
    prims: Vec<(u32, u32)>,
    nodes: Vec<Node>,
    /// Size of the greatest coordinate, for error bounds.
    pub extent: f64,
}

struct Node {
    lo: DVec3,
    hi: DVec3,
    /// Primitives of a leaf, or the second child (the first follows its parent).
    what: Content,
}

enum Content {
    Leaf(Vec<u32>),
    Inner(usize),
}

/// Nodes to visit. The tree halves its primitives, of which there are fewer than 2^32, so it is never deeper.
struct Stack {
    nodes: [usize; 33],
    len: usize,
}

impl Stack {
    /// With the root.
    fn new(nodes: &[Node]) -> Self {
        Stack { nodes: [0; 33], len: nodes.len().min(1) }
    }

    fn push(&mut self, node: usize) {
        self.nodes[self.len] = node;
        self.len += 1;
    }

    fn pop(&mut self) -> Option<usize> {
        self.len = self.len.checked_sub(1)?;
        Some(self.nodes[self.len])
    }
}

impl World {
    /// Of shapes with this geometry, none of them instances: those are never met.
    pub fn new<'a>(shapes: impl IntoIterator<Item = &'a Geometry>) -> Self {
        let shapes: Vec<Geometry> = shapes.into_iter().cloned().collect();
        let mut prims = Vec::new();
        for (s, geometry) in shapes.iter().enumerate() {
            let count = if let Geometry::Mesh(mesh) = geometry { mesh.triangles.len() } else { 1 };
            prims.extend((0..count).map(|t| (s as u32, t as u32)));
        }
        let boxes: Vec<_> = prims.iter().map(|&(s, t)| bounds(&shapes[s as usize], t as usize)).collect();
        let extent = boxes.iter().map(|(lo, hi)| lo.abs().max(hi.abs()).max_element()).fold(0.0, f64::max);
        let mut world = Self { shapes, prims, nodes: Vec::new(), extent };
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        if !order.is_empty() {
            world.build(&boxes, &mut order);
        }
        world
    }

    fn build(&mut self, boxes: &[(DVec3, DVec3)], prims: &mut [u32]) {
        let all = |f: fn(DVec3, DVec3) -> DVec3, g: &dyn Fn(usize) -> DVec3| {
            prims.iter().map(|&p| g(p as usize)).reduce(f).unwrap_or(DVec3::ZERO)
        };
        let middle = |p: usize| boxes[p].0 + boxes[p].1;
        // A hair wider than its contents, so that rounding in the slab test never loses a hit and no ray runs in a face of the box.
        let pad = DVec3::splat(8.0 * f64::EPSILON * self.extent);
        let (lo, hi) = (all(DVec3::min, &|p| boxes[p].0) - pad, all(DVec3::max, &|p| boxes[p].1) + pad);
        let spread = all(DVec3::max, &middle) - all(DVec3::min, &middle);
        let node = self.nodes.len();
        self.nodes.push(Node { lo, hi, what: Content::Leaf(prims.to_vec()) });
        if prims.len() > 4 && spread.max_element() > 0.0 {
            let axis = spread.max_position();
            let half = prims.len() / 2;
            prims.select_nth_unstable_by(half, |&a, &b| middle(a as usize)[axis].total_cmp(&middle(b as usize)[axis]));
            let (first, second) = prims.split_at_mut(half);
            self.build(boxes, first);
            self.nodes[node].what = Content::Inner(self.nodes.len());
            self.build(boxes, second);
        }
    }

    /// The nearest place the ray meets: every primitive there, one hit per shape and side. Empty if the ray escapes.
    pub fn intersect(&self, ray: &Ray) -> Vec<Hit> {
        let mut hits: Vec<Hit> = Vec::new();
        let mut nearest = f64::INFINITY;
        let size = self.extent.max(ray.origin.abs().max_element());
        let inv = ray.dir.recip();
        let mut stack = Stack::new(&self.nodes);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            let (a, b) = ((node.lo - ray.origin) * inv, (node.hi - ray.origin) * inv);
            let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
            let reach = nearest + COINCIDENT * (size + nearest);
            if leave * (1.0 + 4.0 * f64::EPSILON) < enter.max(0.0) || enter > reach {
                continue;
            }
            match &node.what {
                Content::Inner(second) => {
                    stack.push(*second);
                    stack.push(index + 1);
                }
                Content::Leaf(prims) => {
                    for &prim in prims {
                        let (shape, triangle) = self.prims[prim as usize];
                        let geometry = &self.shapes[shape as usize];
                        if let Some((t, p, ng, ns, uv)) = intersect(geometry, triangle as usize, ray, ray.on.contains(&prim)) {
                            nearest = nearest.min(t);
                            hits.push(Hit { t, prim, shape: shape as usize, p, ng, ns, uv });
                        }
                    }
                }
            }
        }
        let reach = nearest + COINCIDENT * (size + nearest);
        hits.retain(|h| h.t <= reach);
        hits.sort_by_key(|h| (h.shape, h.prim));
        hits
    }

    /// All crossings of a half line from `origin` along unit `dir`, nearest first.
    pub fn crossings(&self, origin: DVec3, dir: DVec3) -> Vec<Hit> {
        let mut hits: Vec<Hit> = Vec::new();
        let inv = dir.recip();
        let mut stack = Stack::new(&self.nodes);
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            let (a, b) = ((node.lo - origin) * inv, (node.hi - origin) * inv);
            if a.max(b).min_element() * (1.0 + 4.0 * f64::EPSILON) < a.min(b).max_element().max(0.0) {
                continue;
            }
            let prims = match &node.what {
                Content::Inner(second) => {
                    stack.push(*second);
                    stack.push(index + 1);
                    continue;
                }
                Content::Leaf(prims) => prims,
            };
            for &prim in prims {
                let (shape, triangle) = self.prims[prim as usize];
                let mut ray = Ray::new(origin, dir);
                while let Some((t, p, ng, ns, uv)) = intersect(&self.shapes[shape as usize], triangle as usize, &ray, false) {
                    hits.push(Hit { t, prim, shape: shape as usize, p, ng, ns, uv });
                    ray.t_min = t;
                }
            }
        }
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
        hits
    }

    /// The number of a shape's first primitive; its triangles follow in order.
    pub fn first_prim(&self, shape: usize) -> u32 {
        self.prims.partition_point(|&(s, _)| (s as usize) < shape) as u32
    }

    /// Centre and radius of a ball around all shapes and the given points.
    pub fn ball_around(&self, points: &[DVec3]) -> (DVec3, f64) {
        let corners: Vec<DVec3> =
            self.nodes.first().into_iter().flat_map(|n| [n.lo, n.hi]).chain(points.iter().copied()).collect();
        let Some(lo) = corners.iter().copied().reduce(DVec3::min) else { return (DVec3::ZERO, 1.0) };
        let hi = corners.iter().copied().fold(lo, DVec3::max);
        let center = 0.5 * (lo + hi);
        // Never of zero size, else no light could come from it.
        (center, (0.5 * (hi - lo).length()).max(1e-3 * center.length()).max(1e-12) * (1.0 + 1e-9))
    }
}
