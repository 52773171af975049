//! Of meshes that stand in the world many times: what is worth sharing among their places.

use crate::geometry::{Bounds, Instance, bounds_of_mesh};
use crate::scene::json::LARGEST_LENGTH;
use crate::scene::json::load::Loader;
use crate::scene::json::transform::{Flaw, check_affine};
use crate::scene::mesh;
use crate::scene::{Geometry, Mesh, Scene};
use glam::{DAffine3, DMat3, DMat4};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Smaller meshes are never shared: what they take is less than what it costs to look them up.
const SMALLEST_SHARED: usize = 256;
/// A mesh is shared if its copies beyond the first would have this many triangles, which take some 300 MiB; tracing takes twice as long through two
/// hierarchies as through one (measured on lavapipe).
const SHARED_FROM: usize = 1 << 20;
/// A mesh that is drawn out more than this has the digits of its own space elsewhere than the world needs them.
const MOST_UNEVEN: f64 = 1e3;

impl Scene {
    /// The same with a mesh for every instance.
    pub fn flattened(&self) -> Scene {
        let mut scene = self.clone();
        for shape in &mut scene.shapes {
            if let Geometry::Instance(instance) = &shape.geometry {
                shape.geometry = Geometry::Mesh(Arc::new(instance.flattened()));
            }
        }
        scene
    }
}

/// A mesh as its instances share it.
struct Shared {
    /// What it was made of, which lives as long, so that no other mesh has its address.
    _source: Arc<Mesh>,
    mesh: Arc<Mesh>,
    bounds: Bounds,
    /// Triangles of no area that were left out.
    dropped: usize,
}

/// Meshes met so far that may be worth sharing, by their address and whether they are mirrored.
#[derive(Default)]
pub(in crate::scene) struct SharedMeshes(HashMap<(*const Mesh, bool), Shared>);

impl SharedMeshes {
    /// An instance of `source` under `m`, how many triangles of no area were dropped, and how many are new; `None` if it is better flattened.
    pub(in crate::scene) fn instance(&mut self, source: &Arc<Mesh>, m: &DMat4) -> Result<Option<(Instance, usize, usize)>, Flaw> {
        check_affine(m)?;
        let to_world = DAffine3::from_mat4(*m);
        let linear = to_world.matrix3;
        if source.triangles.len() < SMALLEST_SHARED || norm(&linear) * norm(&linear.inverse()) > 3.0 * MOST_UNEVEN {
            return Ok(None);
        }
        let mirrored = linear.determinant() < 0.0;
        let key = (Arc::as_ptr(source), mirrored);
        let mut new = 0;
        let shared = match self.0.entry(key) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => {
                let (mut mesh, dropped) = mesh::place(source, &DMat4::IDENTITY)?;
                // The transform turns it round once more.
                if mirrored {
                    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
                    mesh.tangents.iter_mut().for_each(|t| t.w = -t.w);
                }
                if mesh.triangles.is_empty() {
                    return Ok(None);
                }
                new = mesh.triangles.len();
                let (bounds, mesh) = (bounds_of_mesh(&mesh), Arc::new(mesh));
                place.insert(Shared { _source: source.clone(), mesh, bounds, dropped })
            }
        };
        let instance = Instance::with_bounds(shared.mesh.clone(), shared.bounds, to_world);
        let reach = instance.bounds().min.abs().max(instance.bounds().max.abs()).max_element();
        if !reach.is_finite() || reach > LARGEST_LENGTH {
            return Err(("the mesh reaches beyond 1e9 m".into(), "use metres: scale the mesh down".into()));
        }
        Ok(Some((instance, shared.dropped, new)))
    }
}

/// Frobenius norm.
fn norm(m: &DMat3) -> f64 {
    m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt()
}

impl Loader {
    /// Instances that are not worth sharing become meshes of their own.
    pub(in crate::scene) fn flatten_the_few(&mut self) {
        // What they were made of is no longer needed beside them: of a large mesh that is much.
        self.shared = SharedMeshes::default();
        let mut uses: HashMap<*const Mesh, usize> = HashMap::new();
        let instances =
            self.scene.shapes.iter().filter_map(|s| if let Geometry::Instance(i) = &s.geometry { Some(i) } else { None });
        instances.for_each(|i| *uses.entry(Arc::as_ptr(i.mesh())).or_default() += 1);
        for shape in &mut self.scene.shapes {
            if let Geometry::Instance(i) = &shape.geometry
                && (uses[&Arc::as_ptr(i.mesh())] - 1) * i.mesh().triangles.len() < SHARED_FROM
            {
                shape.geometry = Geometry::Mesh(Arc::new(i.flattened()));
            }
        }
    }
}
