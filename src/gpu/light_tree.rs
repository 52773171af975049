//! A binary tree over the lights that have a place, so that a point is lit by those that matter to it (Conty Estevez & Kulla, "Importance sampling of
//! many lights with adaptive tree splitting", HPG 2018; traversal: shaders/light/tree.wgsl).

use super::layout::{LightNode, NO_INDEX};
use crate::geometry::{Bounds, bounds, corners, triangle_area};
use crate::scene::{Geometry, Light, Scene};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Bits of a trail, and so the greatest depth.
const DEEPEST: u32 = 31;
/// Places along each axis at which a split is tried.
const BUCKETS: usize = 12;

/// Directions of normals: all within `angle` of `axis`; over all of them light leaves up to a right angle away.
#[derive(Debug, Clone, Copy)]
struct Cone {
    axis: DVec3,
    /// Radians; pi for every direction.
    angle: f64,
}

/// A light, or what several come to.
#[derive(Debug, Clone, Copy)]
pub(super) struct TreeLight {
    bounds: Bounds,
    cone: Cone,
    two_sided: bool,
    /// Share of the scene's light.
    pub share: f64,
}

impl Cone {
    /// Everything.
    const ALL: Cone = Cone { axis: DVec3::Z, angle: PI };

    fn union(self, b: Cone) -> Cone {
        let (a, b) = if self.angle >= b.angle { (self, b) } else { (b, self) };
        let between = a.axis.angle_between(b.axis);
        if (between + b.angle).min(PI) <= a.angle {
            return a;
        }
        let angle = 0.5 * (a.angle + between + b.angle);
        let pivot = a.axis.cross(b.axis);
        if angle >= PI || pivot.length_squared() < 1e-20 {
            return Cone::ALL;
        }
        Cone { axis: glam::DQuat::from_axis_angle(pivot.normalize(), angle - a.angle) * a.axis, angle }
    }

    /// Measure of the directions that light leaves in (Conty Estevez & Kulla, eq. 1, with emission up to a right angle).
    fn measure(&self) -> f64 {
        let (o, w) = (self.angle, (self.angle + FRAC_PI_2).min(PI));
        2.0 * PI * (1.0 - o.cos()) + FRAC_PI_2 * (2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos())
    }
}

impl TreeLight {
    fn union(self, b: TreeLight) -> TreeLight {
        TreeLight {
            bounds: self.bounds.union(b.bounds),
            cone: self.cone.union(b.cone),
            two_sided: self.two_sided || b.two_sided,
            share: self.share + b.share,
        }
    }

    /// What a cluster costs: shares x area of its box x directions.
    fn cost(&self) -> f64 {
        let d = self.bounds.max - self.bounds.min;
        self.share * (d.x * d.y + d.y * d.z + d.z * d.x) * self.cone.measure()
    }

    /// What it could send to `p`, as shaders/light/tree.wgsl has it.
    fn importance(&self, p: DVec3) -> f64 {
        let radius = 0.5 * (self.bounds.max - self.bounds.min).length();
        let v = p - self.center();
        let d2 = v.length_squared();
        let nearest = self.share / d2.max(radius * radius).max(1e-30);
        if d2 <= radius * radius {
            return nearest;
        }
        let cos = self.cone.axis.dot(v) / d2.sqrt();
        let away = if self.two_sided { cos.abs() } else { cos }.clamp(-1.0, 1.0).acos();
        let rest = (away - self.cone.angle - (radius / d2.sqrt()).asin()).max(0.0);
        nearest * rest.cos().max(0.0)
    }

    fn center(&self) -> DVec3 {
        0.5 * (self.bounds.min + self.bounds.max)
    }

    fn node(&self, origin: DVec3, child: u32, light: u32) -> LightNode {
        // A little larger, so that rounding leaves no light outside.
        let radius = 0.5 * (self.bounds.max - self.bounds.min).length();
        let center = (self.center() - origin).as_vec3();
        let slack = 1e-6 * (center.abs().max_element() + radius as f32);
        let angle = (self.cone.angle + 1e-6).min(PI);
        LightNode {
            sphere: center.extend(radius as f32 + slack),
            cone: self.cone.axis.as_vec3().extend(angle.cos() as f32),
            sin_angle: angle.sin() as f32,
            share: self.share as f32,
            child,
            light: light | u32::from(self.two_sided) << 31,
        }
    }
}

/// The lights of a scene that have a place, in the order of their records (lights.rs), each with its power as its share.
pub(super) fn placed(scene: &Scene) -> Vec<TreeLight> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let mut out = Vec::new();
    for shape in &scene.shapes {
        let Some(emission) = shape.emission.as_ref().filter(|e| !e.radiance.is_zero()) else { continue };
        let two_sided = emission.two_sided;
        let exitance = PI * emission.radiance.mean(lo, hi) * if two_sided { 2.0 } else { 1.0 };
        match &shape.geometry {
            Geometry::Mesh(mesh) => out.extend((0..mesh.triangles.len()).map(|t| {
                let [a, b, c] = corners(mesh, t);
                let bounds = Bounds { min: a.min(b).min(c), max: a.max(b).max(c) };
                let axis = (b - a).cross(c - a).normalize_or(DVec3::Z);
                TreeLight { bounds, cone: Cone { axis, angle: 0.0 }, two_sided, share: exitance * triangle_area([a, b, c]) }
            })),
            other => {
                let cone = match other {
                    Geometry::Disc { normal, .. } => Cone { axis: *normal, angle: 0.0 },
                    _ => Cone::ALL,
                };
                out.push(TreeLight { bounds: bounds(other), cone, two_sided, share: exitance * crate::geometry::area(other) });
            }
        }
    }
    for light in &scene.lights {
        let at = |p: &DVec3, reach: f64| Bounds { min: *p - reach, max: *p + reach };
        let (bounds, cone, share) = match light {
            Light::Point { position, intensity } => (at(position, 0.0), Cone::ALL, 4.0 * PI * intensity.mean(lo, hi)),
            Light::Spot { position, direction, intensity, cos_outer, .. } => {
                let cone = Cone { axis: *direction, angle: cos_outer.clamp(-1.0, 1.0).acos() };
                (at(position, 0.0), cone, 2.0 * PI * (1.0 - cos_outer) * intensity.mean(lo, hi))
            }
            Light::Profile { position, axes, intensity, profile } => {
                // Light leaves up to a right angle off the cone.
                let cone = Cone { axis: axes.z_axis, angle: (profile.reach() - FRAC_PI_2).max(0.0) };
                (at(position, 0.0), cone, profile.solid_angle() * intensity.mean(lo, hi))
            }
            Light::Beam { origin, direction, radius, irradiance } => {
                let cone = Cone { axis: *direction, angle: 0.0 };
                (at(origin, *radius), cone, PI * radius * radius * irradiance.mean(lo, hi))
            }
            Light::Sun { .. } | Light::Constant { .. } | Light::Image(_) => continue,
        };
        out.push(TreeLight { bounds, cone, two_sided: false, share });
    }
    out
}

/// Fewer lights than this are chosen from by power.
const FEWEST: usize = 64;
/// Points of the scene that are asked whether lights differ for them.
const POINTS: usize = 64;
/// The tree is of use from here on: how much larger the mean square of what a light sample finds is where lights are chosen by power, shadows left out. It
/// takes about as much more time as there are levels (`abbe bench --scaling` measures both).
const CONTRAST: f64 = 3.0;

/// Does a tree over the scene's lights pay? It does where there are many, spread apart, of which a place sees few well.
pub fn pays(scene: &Scene) -> bool {
    let mut lights = placed(scene);
    if lights.len() < FEWEST {
        return false;
    }
    let total: f64 = lights.iter().map(|l| l.share).sum();
    lights.iter_mut().for_each(|l| l.share /= total);
    let points = places(scene);
    let contrasts = points.iter().map(|&p| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for light in lights.iter().filter(|l| l.share > 0.0) {
            let seen = light.importance(p);
            sum += seen;
            squares += seen * seen / light.share;
        }
        // Where nothing shines, nothing is to be chosen.
        (sum > 0.0).then(|| squares / (sum * sum))
    });
    let contrasts: Vec<f64> = contrasts.flatten().collect();
    // The logarithm, since one place beside a lamp should not decide.
    let mean = contrasts.iter().map(|c| c.ln()).sum::<f64>() / contrasts.len().max(1) as f64;
    mean.exp() > CONTRAST
}

/// Points on what is lit, spread over the primitives.
fn places(scene: &Scene) -> Vec<DVec3> {
    let lit: Vec<_> = scene.shapes.iter().filter(|s| s.emission.is_none()).map(|s| &s.geometry).collect();
    let each = POINTS.div_ceil(lit.len().max(1));
    let step = lit.len().div_ceil(POINTS).max(1);
    let on = |geometry: &Geometry| -> Vec<DVec3> {
        match geometry {
            Geometry::Mesh(mesh) => {
                // Corners and middles of evenly chosen triangles: a wall has but two.
                let middle = |i: usize| {
                    let [a, b, c] = corners(mesh, i * mesh.triangles.len() / each);
                    let (u, v) = ((0.755 * i as f64).fract(), (0.57 * i as f64).fract());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    a + u * (b - a) + v * (c - a)
                };
                (0..each).map(middle).collect()
            }
            other => {
                let b = bounds(other);
                vec![0.5 * (b.min + b.max)]
            }
        }
    };
    lit.into_iter().step_by(step).flat_map(on).collect()
}

/// The tree's nodes (two children of a node in a row, the root first) and for each light its trail: bit i is 1 where the way to it takes the second
/// child at depth i. Positions are relative to `origin`.
pub(super) fn build(lights: &[TreeLight], origin: DVec3) -> (Vec<LightNode>, Vec<u32>) {
    let mut tree = Builder { lights, origin, nodes: Vec::new(), trails: vec![0; lights.len()] };
    if !lights.is_empty() {
        tree.nodes.push(LightNode::default());
        tree.grow(0, &mut (0..lights.len()).collect::<Vec<_>>(), 0, 0);
    }
    (tree.nodes, tree.trails)
}

struct Builder<'a> {
    lights: &'a [TreeLight],
    origin: DVec3,
    nodes: Vec<LightNode>,
    trails: Vec<u32>,
}

impl Builder<'_> {
    fn grow(&mut self, node: usize, of: &mut [usize], depth: u32, trail: u32) {
        let lights = self.lights;
        let all = of.iter().map(|&i| lights[i]).reduce(TreeLight::union).expect("a node has lights");
        if let [only] = of {
            self.nodes[node] = all.node(self.origin, NO_INDEX, *only as u32);
            self.trails[*only] = trail;
            return;
        }
        let split = self.split(of, depth);
        let (lower, upper) = of.split_at_mut(split);
        let child = self.nodes.len();
        self.nodes[node] = all.node(self.origin, child as u32, 0);
        self.nodes.extend([LightNode::default(); 2]);
        self.grow(child, lower, depth + 1, trail);
        self.grow(child + 1, upper, depth + 1, trail | 1 << depth);
    }

    /// Sorts the lights of a node into two; returns how many are in the first.
    fn split(&self, of: &mut [usize], depth: u32) -> usize {
        let lights = self.lights;
        let centers = of.iter().map(|&i| lights[i].center()).fold(Bounds::EMPTY, |b, c| b.union(Bounds { min: c, max: c }));
        let extent = centers.max - centers.min;
        let bucket = |i: usize, axis: usize| {
            let t = (lights[i].center()[axis] - centers.min[axis]) / extent[axis];
            ((t * BUCKETS as f64) as usize).min(BUCKETS - 1)
        };
        let longest = extent.max_element();
        let mut best: Option<(f64, usize, usize)> = None;
        // With as many lights as the bits left can just tell apart, only halving will do.
        let must_halve = usize::BITS - (of.len() - 1).leading_zeros() >= DEEPEST - depth;
        for axis in (0..3).filter(|&a| extent[a] > 0.0 && !must_halve) {
            let mut buckets: [Option<TreeLight>; BUCKETS] = [None; BUCKETS];
            for &i in of.iter() {
                let b = &mut buckets[bucket(i, axis)];
                *b = Some(b.map_or(lights[i], |b| b.union(lights[i])));
            }
            for at in 1..BUCKETS {
                let side = |b: &[Option<TreeLight>]| b.iter().flatten().copied().reduce(TreeLight::union);
                if let (Some(lower), Some(upper)) = (side(&buckets[..at]), side(&buckets[at..])) {
                    // Thin boxes are to be cut across.
                    let cost = (lower.cost() + upper.cost()) * longest / extent[axis];
                    if best.is_none_or(|b| cost < b.0) {
                        best = Some((cost, axis, at));
                    }
                }
            }
        }
        match best {
            Some((_, axis, at)) => {
                of.sort_by_key(|&i| bucket(i, axis) >= at);
                of.partition_point(|&i| bucket(i, axis) < at)
            }
            None => of.len() / 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn light(p: DVec3, axis: DVec3) -> TreeLight {
        let bounds = Bounds { min: p - 0.01, max: p + 0.01 };
        TreeLight { bounds, cone: Cone { axis, angle: 0.0 }, two_sided: false, share: 1.0 }
    }

    fn scattered(n: u32) -> Vec<TreeLight> {
        let x = |i: u32, k: u32| f64::from((i * k) % 1009) / 1009.0;
        let axis = |i: u32| dvec3(x(i, 31) - 0.5, x(i, 37) - 0.5, x(i, 41) - 0.49).normalize();
        (1..=n).map(|i| light(dvec3(x(i, 17), x(i, 23), x(i, 29)), axis(i))).collect()
    }

    #[test]
    fn every_trail_leads_to_its_light() {
        let lights = scattered(777);
        let (nodes, trails) = build(&lights, DVec3::ZERO);
        for (i, trail) in trails.iter().enumerate() {
            let (mut at, mut depth) = (0, 0);
            while nodes[at].child != NO_INDEX {
                at = nodes[at].child as usize + (trail >> depth & 1) as usize;
                depth += 1;
            }
            assert_eq!(nodes[at].light as usize, i);
        }
    }

    #[test]
    fn nodes_hold_the_spheres_shares_and_directions_of_their_lights() {
        let lights = scattered(300);
        let (nodes, trails) = build(&lights, DVec3::ZERO);
        assert!((f64::from(nodes[0].share) - 300.0).abs() < 1e-3);
        for (l, trail) in lights.iter().zip(trails) {
            let (mut at, mut depth) = (0, 0);
            loop {
                let n = nodes[at];
                let far = l.center().as_vec3().distance(n.sphere.truncate());
                assert!(far <= n.sphere.w, "{far} {n:?}");
                assert!(l.cone.axis.as_vec3().dot(n.cone.truncate()) >= n.cone.w - 1e-6, "{n:?}");
                if n.child == NO_INDEX {
                    break;
                }
                at = n.child as usize + (trail >> depth & 1) as usize;
                depth += 1;
            }
        }
    }

    #[test]
    fn lights_at_one_place_are_no_deeper_than_a_trail() {
        let lights = vec![light(DVec3::ONE, DVec3::Y); 5000];
        let (nodes, trails) = build(&lights, DVec3::ZERO);
        assert_eq!(nodes.len(), 2 * 5000 - 1);
        assert!(trails.iter().all(|t| *t < 1 << 13));
    }

    #[test]
    fn a_line_of_ever_farther_lights_is_no_deeper_than_a_trail() {
        let lights: Vec<_> = (0..600).map(|i| light(DVec3::X * 1.5f64.powi(i), DVec3::Y)).collect();
        let (nodes, trails) = build(&lights, DVec3::ZERO);
        let depth = |trail: u32| {
            let (mut at, mut depth) = (0, 0);
            while nodes[at].child != NO_INDEX {
                at = nodes[at].child as usize + (trail >> depth & 1) as usize;
                depth += 1;
            }
            depth
        };
        assert!(trails.iter().all(|t| depth(*t) <= DEEPEST));
    }
}
