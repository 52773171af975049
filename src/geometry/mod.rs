//! The kinds of geometry, their measures, the hierarchy that the GPU traces ([`bvh`]), and rays against geometry in double precision ([`world`]).

pub mod bvh;
mod instance;
mod intersect;
mod lens_face;
pub(crate) mod profile;
mod types;
pub mod world;

pub use instance::{Instance, transformed};
pub use lens_face::{LensFace, LensForm};
pub use profile::Profile;
pub use types::{Coordinates, Geometry, Mesh};

use glam::DVec3;
use std::f64::consts::PI;

/// Axis-aligned bounding box, (least, greatest) corner; inverted (infinite) when empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub min: DVec3,
    /// Greatest corner.
    pub max: DVec3,
}

impl Bounds {
    /// Of nothing.
    pub const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The least box around both.
    pub fn union(self, b: Bounds) -> Bounds {
        Bounds { min: self.min.min(b.min), max: self.max.max(b.max) }
    }

    /// True if the boxes share a point.
    pub fn overlaps(&self, b: &Bounds) -> bool {
        self.min.cmple(b.max).all() && b.min.cmple(self.max).all()
    }

    /// True if nothing was ever added.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Centre and radius of the ball around the box; around nothing, of 1 m about the origin.
    pub fn ball(&self) -> (DVec3, f64) {
        if self.is_empty() { (DVec3::ZERO, 1.0) } else { (0.5 * (self.min + self.max), 0.5 * (self.max - self.min).length()) }
    }
}

/// Bounding box of a shape's geometry.
pub fn bounds(geometry: &Geometry) -> Bounds {
    match geometry {
        Geometry::Mesh(mesh) => bounds_of_mesh(mesh),
        Geometry::Instance(instance) => instance.bounds(),
        Geometry::Sphere { center, radius } => Bounds { min: center - radius, max: center + radius },
        Geometry::Disc { center, normal, radius } => {
            let half = disc_half_extent(*normal, *radius);
            Bounds { min: center - half, max: center + half }
        }
        Geometry::Cylinder { base, axis, length, radius } => {
            let half = disc_half_extent(*axis, *radius);
            let top = base + axis * length;
            Bounds { min: base.min(top) - half, max: base.max(top) + half }
        }
        Geometry::LensFace(face) => face.bounds(),
    }
}

/// Bounding box of a mesh's triangles.
pub fn bounds_of_mesh(mesh: &Mesh) -> Bounds {
    let corners = mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]);
    corners.fold(Bounds::EMPTY, |b, p| b.union(Bounds { min: p, max: p }))
}

/// Half extents of the box around a disc: radius times the sine of the angle between normal and axis.
fn disc_half_extent(normal: DVec3, radius: f64) -> DVec3 {
    (DVec3::ONE - normal * normal).max(DVec3::ZERO).map(f64::sqrt) * radius
}

/// Corners of triangle `t`.
pub fn corners(mesh: &Mesh, t: usize) -> [DVec3; 3] {
    mesh.triangles[t].map(|i| mesh.positions[i as usize])
}

/// Surface area of one side of a shape's geometry, m^2.
pub fn area(geometry: &Geometry) -> f64 {
    let of_mesh = |mesh: &Mesh| (0..mesh.triangles.len()).map(|t| triangle_area(corners(mesh, t))).sum();
    match geometry {
        Geometry::Mesh(mesh) => of_mesh(mesh),
        Geometry::Instance(instance) => of_mesh(&instance.flattened()),
        Geometry::Sphere { radius, .. } => 4.0 * PI * radius * radius,
        Geometry::Disc { radius, .. } => PI * radius * radius,
        Geometry::Cylinder { length, radius, .. } => 2.0 * PI * radius * length,
        Geometry::LensFace(face) => face.sums().0,
    }
}

/// Area of a triangle, m^2.
pub fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
