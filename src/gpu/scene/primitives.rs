//! Geometry in the order of the BVH's leaves, three vec4s a primitive, relative to the scene's middle so that single precision suffices far
//! from the origin. Below the leaves of meshes that stand in many places hang hierarchies of their own (instances.rs).

use super::instances::{self, Instances};
use crate::error::{Error, Result};
use crate::geometry::{Bounds, LensForm, bounds as bounds_of, bvh, corners};
use crate::gpu::layout::{self, NO_INDEX};
use crate::scene::{Geometry, Mesh, Scene};
use glam::{DVec3, Vec3, Vec4};
use std::collections::HashMap;

/// Buffers of the geometry.
#[derive(Default)]
pub(super) struct Primitives {
    /// BVH nodes.
    pub nodes: Vec<[u32; 20]>,
    /// Three vec4s per primitive. Triangle: vertices; else position, axis, (radius, length, 0). The w's: kind and material, light, first normal. Then the
    /// rows of faces of lenses.
    pub primitives: Vec<Vec4>,
    /// Three shading normals per triangle of a smooth mesh, and then three tangents if the mesh has them (w of the first normal is 1, else 0).
    pub normals: Vec<Vec4>,
    /// Position in the buffers of the primitive numbered in the scene's order, an instance being one of them.
    pub place: Vec<u32>,
    /// Traversal stack entries.
    pub stack: u32,
    /// What stands in many places.
    pub instances: Instances,
}

/// One primitive in its mesh's or the scene's order.
struct Primitive {
    kind: u32,
    material: usize,
    light: u32,
    rows: [Vec3; 3],
    normals: Option<[Vec3; 3]>,
    tangents: Option<[Vec4; 3]>,
    /// It has texture coordinates.
    is_mapped: bool,
    /// Box of a face of a lens.
    face: Option<Box<[Vec3; 2]>>,
}

impl Primitive {
    fn triangle(mesh: &Mesh, t: usize, local: impl Fn(DVec3) -> Vec3, material: usize, light: u32) -> Self {
        let (corners, at) = (corners(mesh, t), mesh.triangles[t].map(|i| i as usize));
        let tangents = (!mesh.tangents.is_empty()).then(|| at.map(|i| mesh.tangents[i].as_vec4()));
        let normals = match mesh.normals.as_slice() {
            // What has tangents has normals.
            [] => tangents.map(|_| [(corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize().as_vec3(); 3]),
            normals => Some(at.map(|i| normals[i].as_vec3())),
        };
        let is_mapped = !mesh.uvs.is_empty();
        Primitive {
            kind: layout::PRIMITIVE_TRIANGLE,
            material,
            light,
            rows: corners.map(local),
            normals,
            tangents,
            is_mapped,
            face: None,
        }
    }

    /// What sets it apart from others; none for what counts however often it is there.
    fn content(&self) -> Option<Vec<u32>> {
        let vectors = self.rows.iter().chain(self.normals.iter().flatten()).flat_map(|v| v.to_array());
        let numbers = vectors.chain(self.tangents.iter().flatten().flat_map(|t| t.to_array())).map(f32::to_bits);
        let counts = self.light != NO_INDEX || self.is_mapped;
        (!counts).then(|| numbers.chain([self.kind, self.material as u32]).collect())
    }

    fn bounds(&self) -> (Vec3, Vec3) {
        if let Some([lo, hi]) = self.face.as_deref() {
            return (*lo, *hi);
        }
        let [a, b, c] = self.rows;
        match self.kind {
            layout::PRIMITIVE_TRIANGLE => (a.min(b).min(c), a.max(b).max(c)),
            layout::PRIMITIVE_SPHERE => (a - c.x, a + c.x),
            layout::PRIMITIVE_INSTANCE => (a, b),
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
    let extent = if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).max_element() };
    let mut all = Vec::new();
    let mut instances = Vec::new();
    let mut lens_rows = Vec::new();
    for shape in &scene.shapes {
        let light = |at: usize| light_of.get(at).copied().unwrap_or(NO_INDEX);
        let material = shape.material;
        let mut add = |kind, rows| {
            let light = light(all.len());
            all.push(Primitive { kind, material, light, rows, normals: None, tangents: None, is_mapped: false, face: None });
        };
        match &shape.geometry {
            Geometry::Mesh(mesh) => {
                for t in 0..mesh.triangles.len() {
                    all.push(Primitive::triangle(mesh, t, local, material, light(all.len())));
                }
            }
            Geometry::Instance(instance) => {
                // Its triangles are carried into the world with a few roundings more than others.
                let slack = extent * 0.5f64.powi(20);
                let number = Vec3::new(f32::from_bits(instances.len() as u32), 0.0, 0.0);
                let [lo, hi] = [instance.bounds().min - slack, instance.bounds().max + slack].map(local);
                add(layout::PRIMITIVE_INSTANCE, [lo, hi, number]);
                instances.push((instance, material));
            }
            Geometry::Sphere { center, radius } => {
                add(layout::PRIMITIVE_SPHERE, [local(*center), Vec3::ZERO, Vec3::new(*radius as f32, 0.0, 0.0)]);
            }
            Geometry::Disc { center, normal, radius } => {
                add(layout::PRIMITIVE_DISC, [local(*center), normal.as_vec3(), Vec3::new(*radius as f32, 0.0, 0.0)]);
            }
            Geometry::Cylinder { base, axis, length, radius } => {
                let size = Vec3::new(*radius as f32, *length as f32, 0.0);
                add(layout::PRIMITIVE_CYLINDER, [local(*base), axis.as_vec3(), size]);
            }
            Geometry::LensFace(face) => {
                let first = lens_rows.len() as u32;
                let form = add_lens_rows(&face.form, &mut lens_rows);
                let size = Vec3::new(face.radius() as f32, f32::from_bits(first), f32::from_bits(form));
                let rows = [local(face.base), face.axis.as_vec3(), size];
                let whole = bounds_of(&shape.geometry);
                let face = Some(Box::new([whole.min, whole.max].map(local)));
                let (kind, light) = (layout::PRIMITIVE_LENS_FACE, NO_INDEX);
                all.push(Primitive { kind, material, light, rows, normals: None, tangents: None, is_mapped: false, face });
            }
        }
    }
    let mut out = Primitives::default();
    out.place = out.append(&all, extent as f32 * 0.5f32.powi(22))?;
    drop(all);
    out.instances = instances::build(&instances, scene, extent, origin, &mut out)?;
    let first = out.primitives.len() as u32;
    for rows in out.primitives.chunks_exact_mut(3).filter(|rows| rows[0].w.to_bits() >> 29 == layout::PRIMITIVE_LENS_FACE) {
        rows[2].y = f32::from_bits(rows[2].y.to_bits() + first);
    }
    out.primitives.extend(lens_rows);
    Ok(out)
}

/// Adds the rows of a face of a lens; returns which form it has.
fn add_lens_rows(form: &LensForm, rows: &mut Vec<Vec4>) -> u32 {
    let side = |is_upper: &bool| if *is_upper { 1.0 } else { -1.0 };
    match form {
        LensForm::Edge { from, to, .. } => {
            rows.push(Vec4::new(*from as f32, *to as f32, 0.0, 0.0));
            layout::LENS_EDGE
        }
        LensForm::Annulus { height, inner, is_upper, .. } => {
            rows.push(Vec4::new(*height as f32, *inner as f32, 0.0, side(is_upper)));
            layout::LENS_ANNULUS
        }
        LensForm::Surface { profile, vertex, edge, radius, is_upper } => {
            let (low, high) = profile.range(*radius);
            rows.push(Vec4::new(*edge as f32, *vertex as f32, profile.curvature as f32, side(is_upper)));
            let count = f32::from_bits(profile.aspheric.len() as u32);
            rows.push(Vec4::new(profile.conic as f32, count, low as f32, high as f32));
            let scaled = profile.aspheric.iter().enumerate().map(|(i, a)| (a * radius.powi(2 * i as i32 + 2)) as f32);
            let scaled: Vec<f32> = scaled.collect();
            rows.extend(scaled.chunks(4).map(|four| Vec4::from_array([0, 1, 2, 3].map(|i| four.get(i).copied().unwrap_or(0.0)))));
            layout::LENS_SURFACE
        }
    }
}

impl Primitives {
    /// Adds the triangles of `mesh` around `middle` as a hierarchy of their own; returns its first node and where the triangles are.
    pub(super) fn append_mesh(&mut self, mesh: &Mesh, middle: DVec3, padding: f32) -> Result<(u32, Vec<u32>)> {
        let root = self.nodes.len() as u32;
        let local = |p: DVec3| (p - middle).as_vec3();
        let all: Vec<_> = (0..mesh.triangles.len()).map(|t| Primitive::triangle(mesh, t, local, 0, NO_INDEX)).collect();
        Ok((root, self.append(&all, padding)?))
    }

    /// Adds a hierarchy over these primitives, each box grown by `padding`; returns where they are in the buffers.
    fn append(&mut self, all: &[Primitive], padding: f32) -> Result<Vec<u32>> {
        let (first_node, first) = (self.nodes.len() as u32, (self.primitives.len() / 3) as u32);
        if first as usize + all.len() >= 1 << 29 {
            return Err(Error::usage("the scene has more than 536 million primitives", "use coarser meshes"));
        }
        let boxes: Vec<_> = all.iter().map(Primitive::bounds).collect();
        let mut heaps = bvh::heaps(&boxes);
        let copies = remove_copies(&mut heaps, all);
        if heaps.iter().any(|heap| bvh::in_one_place(heap, &boxes) > bvh::MOST_IN_ONE_PLACE) {
            let problem = format!("more than {} surfaces lie in one place", bvh::MOST_IN_ONE_PLACE);
            return Err(Error::usage(
                problem,
                "remove the copies, or scale the scene if single precision cannot tell them apart",
            ));
        }
        let bvh = bvh::build(&boxes, padding, &heaps, |i| !copies.contains_key(&i));
        self.stack = self.stack.max(bvh.stack);
        self.nodes.extend(bvh.nodes.into_iter().map(|mut node| {
            node[4] += first_node;
            node[5] += first;
            node
        }));
        let mut place = vec![0; all.len()];
        for (at, &index) in bvh.order.iter().enumerate() {
            let p = &all[index as usize];
            place[index as usize] = first + at as u32;
            let first_normal = p.normals.map_or(NO_INDEX, |_| self.normals.len() as u32);
            let are_followed = f32::from(u8::from(p.tangents.is_some()));
            self.normals.extend(p.normals.into_iter().flatten().map(|n| n.extend(are_followed)));
            self.normals.extend(p.tangents.into_iter().flatten());
            let words = [p.kind << 29 | p.material as u32, p.light, first_normal];
            self.primitives.extend(p.rows.iter().zip(words).map(|(r, w)| r.extend(f32::from_bits(w))));
        }
        copies.iter().for_each(|(&copy, &original)| place[copy as usize] = place[original as usize]);
        Ok(place)
    }
}

/// Takes those out of heaps that are the same as another: a ray meets one as well as many. Returns of each which one stays.
fn remove_copies(heaps: &mut [Vec<u32>], all: &[Primitive]) -> HashMap<u32, u32> {
    let mut copies = HashMap::new();
    for heap in heaps {
        let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
        heap.retain(|&i| {
            let Some(content) = all[i as usize].content() else { return true };
            let original = *known.entry(content).or_insert(i);
            if original != i {
                copies.insert(i, original);
            }
            original == i
        });
    }
    copies
}
