//! What geometry there is.

use super::{Instance, LensFace};
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
    /// A face of a lens.
    LensFace(LensFace),
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
    /// Likewise of a second set, for pictures that say so; or empty.
    pub more_uvs: Vec<DVec2>,
    /// Colours per vertex, of which materials may be tinted: coefficients c0, c1, c2 of a sigmoid and a factor; or empty.
    pub colors: Vec<[f32; 4]>,
    /// Tangents per vertex, for materials with a grain or a picture of normals, or empty: the direction of growing u, and 1, or -1 where the picture is seen mirrored.
    pub tangents: Vec<DVec4>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// White at each vertex: the sigmoid of 0 is a half.
const WHITE: [[f32; 4]; 3] = [[0.0, 0.0, 0.0, 2.0]; 3];

/// What a point of a surface is looked up by in pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    /// Texture coordinates of both sets.
    pub uv: [DVec2; 2],
    /// Colours of the triangle's vertices, as in [`Mesh::colors`].
    pub colors: [[f32; 4]; 3],
    /// How much of each vertex is there.
    pub shares: [f64; 3],
}

impl From<DVec2> for Coordinates {
    fn from(uv: DVec2) -> Self {
        Coordinates { uv: [uv; 2], colors: WHITE, shares: [1.0, 0.0, 0.0] }
    }
}

impl Mesh {
    /// Texture coordinates of a set (0 or 1) at the barycentric coordinates of the second and third corner of triangle `t`; (0, 0) without any.
    pub fn uv(&self, t: usize, set: usize, [b, c]: [f64; 2]) -> DVec2 {
        match if set == 0 { self.uvs.as_slice() } else { self.more_uvs.as_slice() } {
            [] => DVec2::ZERO,
            uvs => {
                let [p, q, r] = self.triangles[t].map(|v| uvs[v as usize]);
                p * (1.0 - b - c) + q * b + r * c
            }
        }
    }

    /// What pictures and tints are looked up by at the barycentric coordinates of the second and third corner of triangle `t`.
    pub fn coordinates(&self, t: usize, [b, c]: [f64; 2]) -> Coordinates {
        let colors = match self.colors.as_slice() {
            [] => WHITE,
            colors => self.triangles[t].map(|v| colors[v as usize]),
        };
        Coordinates { uv: [0, 1].map(|set| self.uv(t, set, [b, c])), colors, shares: [1.0 - b - c, b, c] }
    }
}
