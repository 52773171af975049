//! Where rays meet the kinds of geometry. A ray that leaves a surface names the primitives it leaves: flat ones cannot be met again, and
//! of a curved one only the other crossing counts, so no offset is needed at any scale.

use super::{Coordinates, Geometry, Mesh};
use glam::{DVec2, DVec3};

/// A half line.
#[derive(Clone)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Unit direction.
    pub dir: DVec3,
    /// Hits at or before this distance do not count.
    pub t_min: f64,
    /// Primitives that `origin` lies on.
    pub on: Vec<u32>,
}

impl Ray {
    /// From `origin` along the unit vector `dir`, on no primitive.
    pub fn new(origin: DVec3, dir: DVec3) -> Self {
        Self { origin, dir, t_min: 0.0, on: Vec::new() }
    }
}

/// A crossing of a primitive.
#[derive(Clone, Copy)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f64,
    /// Number of the primitive, as in [`World::first_prim`](super::world::World::first_prim).
    pub prim: u32,
    /// Index of the shape.
    pub shape: usize,
    /// The crossing, put back on the primitive.
    pub p: DVec3,
    /// Unit outward normal of the geometry.
    pub ng: DVec3,
    /// Unit shading normal on the same side.
    pub ns: DVec3,
    /// What pictures are looked up by.
    pub uv: Coordinates,
}

/// What a primitive says about a ray: distance, point, geometric normal, shading normal, texture coordinates.
pub(super) type Crossing = (f64, DVec3, DVec3, DVec3, Coordinates);

/// The nearest crossing beyond `t_min`; `on` says that the origin lies on this very primitive.
pub(super) fn intersect(geometry: &Geometry, triangle: usize, ray: &Ray, on: bool) -> Option<Crossing> {
    match geometry {
        Geometry::Mesh(mesh) if !on => intersect_triangle(mesh, triangle, ray),
        Geometry::Disc { center, normal, radius } if !on => {
            let t = (*center - ray.origin).dot(*normal) / ray.dir.dot(*normal);
            let p = ray.origin + ray.dir * t;
            let p = p - *normal * (p - *center).dot(*normal);
            (t > ray.t_min && t.is_finite() && (p - *center).length_squared() <= radius * radius).then_some((
                t,
                p,
                *normal,
                *normal,
                DVec2::ZERO.into(),
            ))
        }
        Geometry::Mesh(_) | Geometry::Instance(_) | Geometry::Disc { .. } => None,
        Geometry::Sphere { center, radius } => {
            let oc = ray.origin - *center;
            roots(oc, ray.dir, *radius, on).into_iter().find(|&t| t > ray.t_min && t.is_finite()).map(|t| {
                let n = (oc + ray.dir * t).normalize();
                (t, *center + n * *radius, n, n, DVec2::ZERO.into())
            })
        }
        Geometry::Cylinder { base, axis, length, radius } => {
            let across = |v: DVec3| v - *axis * v.dot(*axis);
            let (oc, d) = (ray.origin - *base, across(ray.dir));
            let speed = d.length();
            if speed == 0.0 {
                return None;
            }
            roots(across(oc), d / speed, *radius, on)
                .into_iter()
                .map(|t| t / speed)
                .filter(|&t| t > ray.t_min && t.is_finite())
                .find_map(|t| {
                    let p = oc + ray.dir * t;
                    let (height, n) = (p.dot(*axis), across(p).normalize());
                    (0.0..=*length).contains(&height).then(|| (t, *base + *axis * height + n * *radius, n, n, DVec2::ZERO.into()))
                })
        }
        Geometry::LensFace(face) => {
            let t = face.crossings(ray.origin, ray.dir, on).into_iter().find(|&t| t > ray.t_min && t.is_finite())?;
            let (p, n) = face.at(ray.origin + ray.dir * t);
            Some((t, p, n, n, DVec2::ZERO.into()))
        }
    }
}

/// Distances along unit `d` at which `|oc + t d| = radius`, in order, without cancellation; infinite where there is none. From a point `on`
/// the surface one crossing is the point itself, and the other follows without looking at how far rounding took the point off.
fn roots(oc: DVec3, d: DVec3, radius: f64, on: bool) -> [f64; 2] {
    const NONE: [f64; 2] = [f64::INFINITY; 2];
    let b = oc.dot(d);
    if on {
        return [-2.0 * b, f64::INFINITY];
    }
    let miss = (oc - d * b).length();
    if miss > radius {
        return NONE;
    }
    let half_chord = ((radius - miss) * (radius + miss)).sqrt();
    let q = -b - half_chord.copysign(b);
    if q == 0.0 {
        return NONE;
    }
    let distance = oc.length();
    let other = (distance - radius) * (distance + radius) / q;
    [q.min(other), q.max(other)]
}

/// Watertight: edge functions are triple products, which two triangles at a shared edge compute with exactly opposite signs.
fn intersect_triangle(mesh: &Mesh, triangle: usize, ray: &Ray) -> Option<Crossing> {
    let [i, j, k] = mesh.triangles[triangle].map(|v| v as usize);
    let [pa, pb, pc] = [mesh.positions[i], mesh.positions[j], mesh.positions[k]];
    let [a, b, c] = [pa - ray.origin, pb - ray.origin, pc - ray.origin];
    let (u, v, w) = (ray.dir.dot(c.cross(b)), ray.dir.dot(a.cross(c)), ray.dir.dot(b.cross(a)));
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let normal = (pb - pa).cross(pc - pa).normalize();
    let t = a.dot(normal) / ray.dir.dot(normal);
    let det = u + v + w;
    // A comparison that NaN (needle triangles, rays in the plane) fails.
    if !(t > ray.t_min && t.is_finite() && det != 0.0) {
        return None;
    }
    let (u, v, w) = (u / det, v / det, w / det);
    let ns = match mesh.normals.as_slice() {
        [] => normal,
        n => {
            let ns = (n[i] * u + n[j] * v + n[k] * w).try_normalize().unwrap_or(normal);
            if ns.dot(normal) < 0.0 { -ns } else { ns }
        }
    };
    Some((t, pa * u + pb * v + pc * w, normal, ns, mesh.coordinates(triangle, [v, w])))
}

/// Smallest box around a primitive, (lower, upper).
pub(super) fn bounds(geometry: &Geometry, triangle: usize) -> (DVec3, DVec3) {
    if let Geometry::Mesh(mesh) = geometry {
        let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
        return (a.min(b).min(c), a.max(b).max(c));
    }
    let whole = super::bounds(geometry);
    (whole.min, whole.max)
}
