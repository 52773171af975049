//! What geometry there is.

use super::Instance;
use glam::{DVec2, DVec3, DVec4};
use std::sync::Arc;

/// World-space geometry. The outward normal of a triangle is the right-hand one of its vertex order.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// A triangle mesh.
    Mesh(Arc<Mesh>),
    /// A large triangle mesh that stands in many places.
    Instance(Instance),
    /// A sphere.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius > 0.
        radius: f64,
    },
    /// A flat disc.
    Disc {
        /// Centre.
        center: DVec3,
        /// Unit normal.
        normal: DVec3,
        /// Radius > 0.
        radius: f64,
    },
    /// The lateral surface of a cylinder, normal away from the axis; caps are discs.
    Cylinder {
        /// Centre of the base.
        base: DVec3,
        /// Unit axis from base to top.
        axis: DVec3,
        /// Length along the axis > 0.
        length: f64,
        /// Radius > 0.
        radius: f64,
    },
}

/// Triangles in world space.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// Unit shading normals per vertex, or empty for a faceted mesh.
    pub normals: Vec<DVec3>,
    /// Texture coordinates per vertex, (0, 0) being the upper left corner of a picture and (1, 1) the lower right; or empty.
    pub uvs: Vec<DVec2>,
    /// Tangents per vertex, for materials with a grain or a picture of normals, or empty: the direction of growing u, and 1, or -1 where the picture is seen mirrored.
    pub tangents: Vec<DVec4>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Texture coordinates at the barycentric coordinates of the second and third corner of triangle `t`; (0, 0) without any.
    pub fn uv(&self, t: usize, [b, c]: [f64; 2]) -> DVec2 {
        match self.uvs.as_slice() {
            [] => DVec2::ZERO,
            uvs => {
                let [p, q, r] = self.triangles[t].map(|v| uvs[v as usize]);
                p * (1.0 - b - c) + q * b + r * c
            }
        }
    }
}
