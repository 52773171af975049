//! Geometry in the order of the BVH's leaves, three vec4s a primitive, relative to the scene's middle so that single precision suffices far
//! from the origin.

use super::layout::{self, NO_INDEX};
use crate::error::{Error, Result};
use crate::geometry::{Bounds, bvh, corners};
use crate::scene::{Geometry, Mesh, Scene};
use glam::{DVec3, Vec3, Vec4};

/// Buffers of the geometry.
pub(super) struct Primitives {
    /// BVH nodes.
    pub nodes: Vec<[u32; 20]>,
    /// Three vec4s per primitive. Triangle: vertices; else position, axis, (radius, length, 0). The w's: kind and material, light, first normal.
    pub primitives: Vec<Vec4>,
    /// Three shading normals per triangle of a smooth mesh.
    pub normals: Vec<Vec4>,
    /// Position in the buffers of the primitive numbered in the scene's order.
    pub place: Vec<u32>,
    /// Traversal stack entries.
    pub stack: u32,
}

/// One primitive in the scene's order.
struct Primitive {
    kind: u32,
    material: usize,
    light: u32,
    rows: [Vec3; 3],
    normals: Option<[Vec3; 3]>,
}

impl Primitive {
    fn bounds(&self) -> (Vec3, Vec3) {
        let [a, b, c] = self.rows;
        match self.kind {
            layout::PRIMITIVE_TRIANGLE => (a.min(b).min(c), a.max(b).max(c)),
            layout::PRIMITIVE_SPHERE => (a - c.x, a + c.x),
            _ => {
                let top = a + b * c.y;
                let half = (Vec3::ONE - b * b).max(Vec3::ZERO).map(f32::sqrt) * c.x;
                (a.min(top) - half, a.max(top) + half)
            }
        }
    }
}

/// Lays out all primitives relative to `origin`; `light_of` has the light index of each in the scene's order, NO_INDEX for those that do not emit.
pub(super) fn build(scene: &Scene, bounds: Bounds, origin: DVec3, light_of: &[u32]) -> Result<Primitives> {
    let local = |p: DVec3| (p - origin).as_vec3();
    let mut all = Vec::new();
    for shape in &scene.shapes {
        let mut add = |kind, rows, normals| {
            let light = light_of.get(all.len()).copied().unwrap_or(NO_INDEX);
            all.push(Primitive { kind, material: shape.material, light, rows, normals });
        };
        match &shape.geometry {
            Geometry::Mesh(mesh) => {
                for t in 0..mesh.triangles.len() {
                    add(layout::PRIMITIVE_TRIANGLE, corners(mesh, t).map(local), smooth_normals(mesh, t));
                }
            }
            Geometry::Sphere { center, radius } => {
                add(layout::PRIMITIVE_SPHERE, [local(*center), Vec3::ZERO, Vec3::new(*radius as f32, 0.0, 0.0)], None);
            }
            Geometry::Disc { center, normal, radius } => {
                add(layout::PRIMITIVE_DISC, [local(*center), normal.as_vec3(), Vec3::new(*radius as f32, 0.0, 0.0)], None);
            }
            Geometry::Cylinder { base, axis, length, radius } => {
                let size = Vec3::new(*radius as f32, *length as f32, 0.0);
                add(layout::PRIMITIVE_CYLINDER, [local(*base), axis.as_vec3(), size], None);
            }
        }
    }
    if all.len() >= 1 << 29 {
        return Err(Error::usage("the scene has more than 536 million primitives", "use coarser meshes"));
    }
    let boxes: Vec<_> = all.iter().map(Primitive::bounds).collect();
    let extent = if all.is_empty() { 0.0 } else { (bounds.max - bounds.min).max_element() as f32 };
    let bvh = bvh::build(&boxes, extent * 0.5f32.powi(22));
    let mut out = Primitives {
        nodes: bvh.nodes,
        primitives: Vec::with_capacity(3 * all.len()),
        normals: Vec::new(),
        place: vec![0; all.len()],
        stack: bvh.stack,
    };
    for (place, &index) in bvh.order.iter().enumerate() {
        let p = &all[index as usize];
        out.place[index as usize] = place as u32;
        let first_normal = p.normals.map_or(NO_INDEX, |_| out.normals.len() as u32);
        out.normals.extend(p.normals.into_iter().flatten().map(|n| n.extend(0.0)));
        let words = [p.kind << 30 | p.material as u32, p.light, first_normal];
        out.primitives.extend(p.rows.iter().zip(words).map(|(r, w)| r.extend(f32::from_bits(w))));
    }
    Ok(out)
}

fn smooth_normals(mesh: &Mesh, t: usize) -> Option<[Vec3; 3]> {
    (!mesh.normals.is_empty()).then(|| mesh.triangles[t].map(|i| mesh.normals[i as usize].as_vec3()))
}
