//! Rays through a prescription, without approximation, in double precision.

use super::{Prescription, Surface};
use crate::bsdf::fresnel;
use glam::{DVec3, dvec3};

/// A ray in the lens's coordinates: z along the axis, 0 at the first vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensRay {
    /// A point of it, m.
    pub o: DVec3,
    /// Unit direction; z positive from the scene to the film.
    pub d: DVec3,
}

impl LensRay {
    /// Its point in the plane at `z`.
    pub fn at(&self, z: f64) -> DVec3 {
        self.o + (z - self.o.z) / self.d.z * self.d
    }
}

/// What comes out of a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Out {
    /// The ray, from the last surface that it met on.
    pub ray: LensRay,
    /// Share of the light that no surface has reflected and no glass absorbed.
    pub transmission: f64,
    /// The greatest distance from the axis over the semi-diameter of the surface: beyond 1 a rim is in the way.
    pub fill: f64,
}

impl Out {
    /// Whether it passed inside every semi-diameter.
    pub fn is_clear(&self) -> bool {
        self.fill <= 1.0
    }
}

/// Newton's steps at aspheric surfaces at most.
const MOST_STEPS: usize = 50;

impl Surface {
    /// Where a ray meets the surface, in coordinates of its vertex, and the unit normal there, towards +z. `None` if it does not, near the vertex.
    pub fn intersect(&self, ray: LensRay) -> Option<(DVec3, DVec3)> {
        let (d, c) = (ray.d, self.curvature());
        let p = ray.at(0.0);
        // c (x^2 + y^2 + (1 + k) z^2) = 2 z, solved from the plane of the vertex on for the root near it.
        let (a, b) = (c * (1.0 + self.conic * d.z * d.z), d.z - c * (p.x * d.x + p.y * d.y));
        let q = c * (p.x * p.x + p.y * p.y);
        let root = (b * b - a * q).sqrt();
        let mut at = p + q / (b + root.copysign(d.z)) * d;
        if self.aspheric.iter().any(|a| *a != 0.0) {
            for _ in 0..MOST_STEPS {
                let r2 = at.x * at.x + at.y * at.y;
                let f = at.z - self.sag(r2.sqrt());
                let step = f / (d.z - self.slope_over_r(r2) * (at.x * d.x + at.y * d.y));
                at -= step * d;
                if step.abs() <= 1e-16 * (1.0 + at.length()) {
                    break;
                }
            }
        }
        let r2 = at.x * at.x + at.y * at.y;
        let miss = (at.z - self.sag(r2.sqrt())).abs();
        // Of a sphere the far side is no part of the surface.
        if miss.is_nan() || miss > 1e-9 * (self.semi_diameter + r2.sqrt()) {
            return None;
        }
        let slope = self.slope_over_r(r2);
        Some((at, dvec3(-slope * at.x, -slope * at.y, 1.0).normalize()))
    }
}

/// A prescription at one wavelength.
#[derive(Debug, Clone)]
pub struct Tracer<'a> {
    surfaces: &'a [Surface],
    /// Index behind each surface.
    n: Vec<f64>,
    /// Absorption coefficient behind each surface, m^-1.
    absorption: Vec<f64>,
    /// z of each vertex.
    z: Vec<f64>,
}

impl<'a> Tracer<'a> {
    /// `lens` at `nm`.
    pub fn new(lens: &'a Prescription, nm: f64) -> Self {
        let absorption = |s: &Surface| s.glass.as_ref().and_then(|g| g.absorption.as_ref()).map_or(0.0, |a| a.eval(nm));
        Tracer {
            surfaces: &lens.surfaces,
            n: lens.indices(nm),
            absorption: lens.surfaces.iter().map(absorption).collect(),
            z: lens.vertices(),
        }
    }

    /// The ray through the lens: from the scene to the film if its `d.z` is positive, else the other way. `None` where it misses a surface or is reflected
    /// totally.
    pub fn trace(&self, ray: LensRay) -> Option<Out> {
        let (count, forward) = (self.surfaces.len(), ray.d.z > 0.0);
        let mut out = Out { ray, transmission: 1.0, fill: 0.0 };
        for step in 0..count {
            let i = if forward { step } else { count - 1 - step };
            let before = if i == 0 { 1.0 } else { self.n[i - 1] };
            let (n1, n2) = if forward { (before, self.n[i]) } else { (self.n[i], before) };
            let (from, surface) = (out.ray.o, &self.surfaces[i]);
            let vertex = dvec3(0.0, 0.0, self.z[i]);
            let (at, normal) = surface.intersect(LensRay { o: from - vertex, d: out.ray.d })?;
            if step > 0 {
                let gap = if forward { i - 1 } else { i };
                out.transmission *= (-self.absorption[gap] * (at + vertex).distance(from)).exp();
            }
            out.fill = out.fill.max(at.x.hypot(at.y) / surface.semi_diameter);
            let normal = normal * out.ray.d.z.signum();
            let (eta, cos) = (n1 / n2, out.ray.d.dot(normal));
            let cos2_t = 1.0 - eta * eta * (1.0 - cos * cos);
            if cos2_t < 0.0 || cos <= 0.0 {
                return None;
            }
            if eta != 1.0 {
                out.transmission *= 1.0 - fresnel::dielectric(cos, 1.0 / eta);
            }
            let d = eta * out.ray.d + (cos2_t.sqrt() - eta * cos) * normal;
            out.ray = LensRay { o: at + vertex, d: d.normalize() };
        }
        Some(out)
    }
}
