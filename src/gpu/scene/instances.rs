//! Meshes that stand in many places: a hierarchy for each in its own space, of which the leaves of the scene's hierarchy name the first node and the
//! transform. Boxes are met by the ray in the mesh's space; triangles are carried into the world and met there, so that watertight edges, error
//! bounds and distances are those of any other triangle (traversal: shaders/geometry/trace.wgsl, shaders/geometry/instances.wgsl).

use super::primitives::Primitives;
use crate::error::{Error, Result};
use crate::geometry::bounds_of_mesh;
use crate::gpu::layout::{self, GRANULE};
use crate::scene::{self, Mesh, Scene, Sensor};
use glam::{DVec3, UVec4};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Tables of instances.
#[derive(Default)]
pub(super) struct Instances {
    /// Their records, and then the instance of every [`GRANULE`] numbers of primitives, four to a texel.
    pub table: Vec<UVec4>,
    /// The number of the first primitive that is part of an instance.
    pub first_number: u32,
    /// Where in the table the instances of numbers begin.
    pub first_owner: u32,
    /// Every shared mesh, and where its triangles are in the buffers.
    pub meshes: Vec<(Arc<Mesh>, Vec<u32>)>,
}

/// A mesh in the buffers.
struct Placed {
    root: u32,
    first: u32,
    middle: DVec3,
}

/// Appends the meshes of `instances` (with their materials) to `out`, which has all else. The scene is `extent` metres wide.
pub(super) fn build(
    instances: &[(&scene::Instance, usize)],
    scene: &Scene,
    extent: f64,
    origin: DVec3,
    out: &mut Primitives,
) -> Result<Instances> {
    if instances.is_empty() {
        return Ok(Instances::default());
    }
    let reach = extent + distance_of_sensor(scene, origin);
    let mut paddings: HashMap<*const Mesh, f64> = HashMap::new();
    for (instance, _) in instances {
        let inverse = instance.to_world().matrix3.inverse();
        let stretch = inverse.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        let padding = paddings.entry(Arc::as_ptr(instance.mesh())).or_default();
        // The ray in the mesh's space is off by some roundings of the world's size, and so is the triangle that is met in the world.
        *padding = padding.max(stretch * reach * 0.5f64.powi(19));
    }
    let top_stack = std::mem::take(&mut out.stack);
    let mut known: HashMap<*const Mesh, Placed> = HashMap::new();
    let mut made = Instances::default();
    let mut records = Vec::with_capacity(instances.len());
    let mut owners = Vec::new();
    let first_number = ((out.primitives.len() / 3) as u32).next_multiple_of(GRANULE);
    for (index, (instance, material)) in instances.iter().enumerate() {
        let mesh = instance.mesh();
        let key = Arc::as_ptr(mesh);
        let placed = match known.entry(key) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let own = bounds_of_mesh(mesh);
                let middle = 0.5 * (own.min + own.max);
                let first = (out.primitives.len() / 3) as u32;
                let (root, place) = out.append_mesh(mesh, middle, paddings[&key] as f32)?;
                made.meshes.push((mesh.clone(), place));
                new.insert(Placed { root, first, middle })
            }
        };
        let number = u64::from(first_number) + u64::from(GRANULE) * owners.len() as u64;
        owners.extend(std::iter::repeat_n(index as u32, mesh.triangles.len().div_ceil(GRANULE as usize)));
        if number + mesh.triangles.len() as u64 >= u64::from(u32::MAX - GRANULE) {
            let problem = "the scene has more than 4 billion triangles, all instances counted";
            return Err(Error::usage(problem, "use fewer instances or coarser meshes"));
        }
        let (to_world, to_mesh) = (instance.to_world(), instance.to_world().inverse());
        let rows = |m: glam::DMat3, t: DVec3| [0, 1, 2].map(|i| m.row(i).extend(t[i]).as_vec4());
        let [to_world_x, to_world_y, to_world_z] = rows(to_world.matrix3, to_world.transform_point3(placed.middle) - origin);
        let [to_mesh_x, to_mesh_y, to_mesh_z] = rows(to_mesh.matrix3, to_mesh.transform_point3(origin) - placed.middle);
        records.push(layout::Instance {
            to_world_x,
            to_world_y,
            to_world_z,
            to_mesh_x,
            to_mesh_y,
            to_mesh_z,
            root: placed.root,
            first_number: (number as u32).wrapping_sub(placed.first),
            material: *material as u32,
            pad_0: 0,
        });
    }
    // What waits in the scene's hierarchy while a mesh's is searched: the rest of a leaf and of a node.
    out.stack += top_stack + 2;
    made.table = bytemuck::cast_slice::<layout::Instance, UVec4>(&records).to_vec();
    made.first_owner = made.table.len() as u32;
    made.first_number = first_number;
    owners.resize(owners.len().next_multiple_of(4), 0);
    made.table.extend(owners.chunks_exact(4).map(UVec4::from_slice));
    Ok(made)
}

/// How far rays start from the scene's middle.
fn distance_of_sensor(scene: &Scene, origin: DVec3) -> f64 {
    let (center, around) = match &scene.sensor {
        Sensor::Perspective { eye, lens_radius, .. } => (*eye, *lens_radius),
        Sensor::Orthographic { eye, height, .. } => {
            (*eye, height * f64::from(scene.film.width).max(f64::from(scene.film.height)) / f64::from(scene.film.height))
        }
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => (*origin, edge_u.length() + edge_v.length()),
        Sensor::IrradianceSphere { center, radius } => (*center, *radius),
    };
    (center - origin).length() + around
}
