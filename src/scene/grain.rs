//! The grain of rough metal: what brushing leaves. It is rougher in one direction, in which highlights are drawn out. Where that direction points is said
//! relative to the surface's tangent: that of a glTF file, or the direction of growing u of the texture coordinates, evened out over the triangles around a
//! vertex; where a surface has neither, the level one (for an upward normal, along x).

use crate::bsdf::ggx::Width;
use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use crate::scene::roughness::SMOOTH;
use crate::scene::{Geometry, Mesh, Scene};
use glam::{DVec2, DVec3, DVec4};
use std::collections::HashMap;
use std::sync::Arc;

/// What brushing leaves on rough metal or on a rough pane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grain {
    /// How much rougher it is in one direction, in [0, 1] (KHR_materials_anisotropy's strength).
    pub strength: f64,
    /// Angle of that direction from the surface's tangent, counter-clockwise as seen from outside, rad.
    pub rotation: f64,
}

impl Grain {
    /// GGX widths in that direction (x) and across it (y) of a material of width `alpha`: KHR_materials_anisotropy's `mix(alpha, 1, strength^2)`.
    pub fn width(&self, alpha: f64) -> Width {
        Width { x: alpha + (1.0 - alpha) * self.strength * self.strength, y: alpha }
    }
}

/// `anisotropy` of a conductor or pane.
pub(super) fn grain(node: &Node) -> Result<Grain> {
    node.object("anisotropy")?;
    let rotation = node.get("rotation_deg").map_or(Ok(0.0), |n| n.within(-360.0, 360.0))?;
    Ok(Grain { strength: node.need("strength")?.within(0.0, 1.0)?, rotation: rotation.to_radians() })
}

impl Loader {
    /// Puts a grain on the metal or pane at this index, or in the material; what is smooth becomes as rough as need be.
    pub(super) fn put_grain(&mut self, index: usize, grain: Grain) {
        // Without strength the metal stays what it is.
        if grain.strength > 0.0 {
            for i in self.scene.made_of(index) {
                if let Some(alpha) = self.scene.materials[i].grained_alpha_mut() {
                    *alpha = alpha.max(SMOOTH);
                    self.scene.grains.insert(i, grain);
                }
            }
        }
    }

    /// Gives tangents to the meshes whose materials have a grain.
    pub(super) fn comb(&mut self) {
        let mut combed: HashMap<*const Mesh, Arc<Mesh>> = HashMap::new();
        for i in 0..self.scene.shapes.len() {
            if !self.scene.has_grain(self.scene.shapes[i].material) {
                continue;
            }
            match &mut self.scene.shapes[i].geometry {
                Geometry::Mesh(mesh) => Arc::make_mut(mesh).comb(),
                Geometry::Instance(instance) => {
                    let mesh = combed.entry(Arc::as_ptr(instance.mesh())).or_insert_with(|| {
                        let mut mesh = Mesh::clone(instance.mesh());
                        mesh.comb();
                        Arc::new(mesh)
                    });
                    instance.replace(mesh.clone());
                }
                _ => {}
            }
        }
    }
}

impl Scene {
    /// Does this material look other where a mesh's tangents point elsewhere: by its grain, or a picture of normals?
    pub(super) fn follows_tangents(&self, index: usize) -> bool {
        let is_mapped = |i: &usize| self.materials[*i].normals().is_some();
        self.has_grain(index) || self.made_of(index).iter().any(is_mapped)
    }

    /// Is there a grain in this material?
    pub(super) fn has_grain(&self, index: usize) -> bool {
        self.made_of(index).iter().any(|i| self.grains.contains_key(i))
    }
}

impl Mesh {
    /// Tangents by the texture coordinates, if there are some and no tangents yet.
    pub fn comb(&mut self) {
        if !self.tangents.is_empty() || self.uvs.is_empty() {
            return;
        }
        let mut sums = vec![(DVec3::ZERO, 0.0); self.positions.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            let (along_u, _, mirrored) = self.directions_of_picture(t, 0);
            for &v in corners {
                let (tangent, side) = &mut sums[v as usize];
                *tangent += along_u;
                *side += if mirrored { -1.0 } else { 1.0 };
            }
        }
        self.tangents = sums.into_iter().map(|(t, side)| t.normalize_or_zero().extend(f64::signum(side))).collect();
    }

    /// Where u and v of a set of coordinates grow on triangle `t`, by its area and how often the picture is repeated, and whether the picture is seen mirrored.
    pub(super) fn directions_of_picture(&self, t: usize, set: usize) -> (DVec3, DVec3, bool) {
        let [p, q, r] = self.triangles[t].map(|v| self.positions[v as usize]);
        let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|corner| self.uv(t, set, corner));
        let (e1, e2, d1, d2): (DVec3, DVec3, DVec2, DVec2) = (q - p, r - p, b - a, c - a);
        let side = d1.perp_dot(d2).signum();
        // v grows down the picture, so that one that is not mirrored turns from u to v clockwise.
        ((e1 * d2.y - e2 * d1.y) * side, (e2 * d1.x - e1 * d2.x) * side, side > 0.0)
    }

    /// The tangent at the point `p` of triangle `t`, as in [`Mesh::tangents`]; of length 0 where there is none.
    pub fn tangent(&self, t: usize, p: DVec3) -> DVec4 {
        if self.tangents.is_empty() {
            return DVec4::W;
        }
        let corners = self.triangles[t].map(|v| v as usize);
        let [a, b, c] = corners.map(|v| self.positions[v]);
        let n = (b - a).cross(c - a);
        let (v, w) = ((p - a).cross(c - a).dot(n) / n.length_squared(), (b - a).cross(p - a).dot(n) / n.length_squared());
        let [i, j, k] = corners.map(|v| self.tangents[v]);
        (i * (1.0 - v - w) + j * v + k * w).truncate().normalize_or_zero().extend(i.w)
    }
}

/// The direction in which a surface of outer shading normal `ns` and this tangent has its grain: x of the frame that [`Grain::width`] is meant in.
pub fn direction_of_grain(grain: &Grain, ns: DVec3, tangent: DVec4) -> DVec3 {
    let across = tangent.truncate() - ns * ns.dot(tangent.truncate());
    let level = || if ns.y.abs() > 0.9999 { DVec3::Z.cross(ns) } else { DVec3::Y.cross(ns) };
    let along = across.try_normalize().unwrap_or_else(|| level().normalize());
    let (sin, cos) = grain.rotation.sin_cos();
    along * cos + ns.cross(along) * (sin * tangent.w)
}
