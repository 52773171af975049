//! Meshes that stand in the world many times.

use super::{Bounds, Mesh, bounds_of_mesh};
use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};
use std::sync::Arc;

/// A mesh in its own space, and where it stands in the world.
#[derive(Debug, Clone)]
pub struct Instance {
    mesh: Arc<Mesh>,
    to_world: DAffine3,
    bounds: Bounds,
}

impl Instance {
    /// `mesh` under `to_world`, which must be invertible. A mirrored mesh is outward where its triangles' order says so after mirroring.
    pub fn new(mesh: Arc<Mesh>, to_world: DAffine3) -> Self {
        let own = bounds_of_mesh(&mesh);
        Self::with_bounds(mesh, own, to_world)
    }

    /// Likewise, where the mesh's own box is known.
    pub(crate) fn with_bounds(mesh: Arc<Mesh>, own: Bounds, to_world: DAffine3) -> Self {
        let corner = |i: u32| {
            let side = |bit: u32, lo: f64, hi: f64| if i >> bit & 1 == 1 { hi } else { lo };
            to_world.transform_point3(DVec3::new(
                side(0, own.min.x, own.max.x),
                side(1, own.min.y, own.max.y),
                side(2, own.min.z, own.max.z),
            ))
        };
        let bounds = (0..8).map(corner).fold(Bounds::EMPTY, |b, p| b.union(Bounds { min: p, max: p }));
        Self { mesh, to_world, bounds }
    }

    /// The mesh in its own space: its outward normals are outward in the world as well.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// Puts another mesh of the same shape in its place.
    pub(crate) fn replace(&mut self, mesh: Arc<Mesh>) {
        self.mesh = mesh;
    }

    /// From the mesh's space to the world's.
    pub fn to_world(&self) -> DAffine3 {
        self.to_world
    }

    /// A box in the world around it.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// A mesh of its own, in the world.
    pub fn flattened(&self) -> Mesh {
        transformed(&self.mesh, &DMat4::from(self.to_world))
    }
}

/// The mesh as it is in the world, its triangles in the order they have.
pub fn transformed(mesh: &Mesh, m: &DMat4) -> Mesh {
    let linear = DMat3::from_mat4(*m);
    let inverse_transpose = linear.inverse().transpose();
    let tangent = |t: &DVec4| (linear * t.truncate()).normalize_or_zero().extend(t.w);
    Mesh {
        positions: mesh.positions.iter().map(|&p| m.transform_point3(p)).collect(),
        normals: mesh.normals.iter().map(|&n| (inverse_transpose * n).normalize_or_zero()).collect(),
        uvs: mesh.uvs.clone(),
        more_uvs: mesh.more_uvs.clone(),
        colors: mesh.colors.clone(),
        tangents: mesh.tangents.iter().map(tangent).collect(),
        triangles: mesh.triangles.clone(),
    }
}
