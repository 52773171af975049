//! Triangle meshes: files of four formats into one form, checked and placed in the world.

pub(in crate::scene) mod instance;
mod obj;
mod ply;
mod stl;

use crate::geometry::transformed;
use crate::scene::json::LARGEST_LENGTH;
use crate::scene::json::transform::Flaw;
use crate::scene::{Geometry, Mesh};
use glam::{DMat3, DMat4, DVec2, DVec3};
use std::path::Path;

/// A picture is repeated at most this often: whole numbers are exact in single precision up to 16 times that.
const MOST_REPEATS: f64 = 1e6;

/// Reads a PLY, OBJ or STL file by its extension.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Mesh, Flaw> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let mesh = match extension.as_str() {
        "ply" => ply::read(bytes)?,
        "obj" => obj::read(bytes)?,
        "stl" => stl::read(bytes)?,
        _ => return Err((format!("meshes of kind {extension:?} cannot be read"), "use .ply, .obj, .stl, .glb or .gltf".into())),
    };
    if mesh.triangles.is_empty() {
        return Err(("the mesh has no triangles".into(), "export it with faces".into()));
    }
    Ok(mesh)
}

/// The mesh in the world: indices and coordinates checked, normals by the inverse transpose, winding turned under mirroring so that outward stays
/// outward, triangles of no area dropped and counted; none may be left.
pub fn place(mesh: &Mesh, m: &DMat4) -> Result<(Mesh, usize), Flaw> {
    let count = mesh.positions.len();
    if !mesh.normals.is_empty() && mesh.normals.len() != count {
        return Err((format!("{} normals for {count} vertices", mesh.normals.len()), "give one normal per vertex".into()));
    }
    if !mesh.uvs.is_empty() && mesh.uvs.len() != count {
        let problem = format!("{} texture coordinates for {count} vertices", mesh.uvs.len());
        return Err((problem, "give one pair per vertex".into()));
    }
    if !mesh.tangents.is_empty() && mesh.tangents.len() != count {
        return Err((format!("{} tangents for {count} vertices", mesh.tangents.len()), "give one per vertex".into()));
    }
    if let Some(i) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err((format!("triangle {i} names a vertex that is not among the {count}"), "export the mesh again".into()));
    }
    let mut used = vec![false; count];
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    if let Some(i) = mesh.positions.iter().zip(&used).position(|(p, used)| *used && !p.is_finite()) {
        return Err((format!("vertex {i} is not finite"), "export the mesh again".into()));
    }
    let linear = DMat3::from_mat4(*m);
    let mut placed = transformed(mesh, m);
    let is_far = |p: &DVec3| !p.is_finite() || p.abs().max_element() > LARGEST_LENGTH;
    // Vertices without triangles may be anywhere.
    placed.positions.iter_mut().zip(&used).filter(|(p, used)| !**used && is_far(p)).for_each(|(p, _)| *p = DVec3::ZERO);
    for uvs in [&mut placed.uvs, &mut placed.more_uvs] {
        uvs.iter_mut().zip(&used).filter(|(_, used)| !**used).for_each(|(uv, _)| *uv = DVec2::ZERO);
    }
    if let Some(i) = placed.positions.iter().position(is_far) {
        return Err((format!("vertex {i} lies beyond 1e9 m"), "use metres: scale the mesh down".into()));
    }
    let mirrored = linear.determinant() < 0.0;
    if mirrored {
        placed.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        placed.tangents.iter_mut().for_each(|t| t.w = -t.w);
    }
    let Mesh { positions, triangles, .. } = &mut placed;
    triangles.retain(|t| !is_flat(t.map(|v| positions[v as usize])));
    let dropped = mesh.triangles.len() - triangles.len();
    if placed.normals.contains(&DVec3::ZERO) {
        let computed = smooth_normals(&placed);
        for (normal, own) in placed.normals.iter_mut().zip(computed) {
            if *normal == DVec3::ZERO {
                *normal = own;
            }
        }
    }
    Ok((placed, dropped))
}

/// Can a picture be put on this?
pub fn check_uvs(geometry: &Geometry) -> Result<(), Flaw> {
    let (uvs, more) = match geometry {
        Geometry::Mesh(mesh) => (mesh.uvs.as_slice(), mesh.more_uvs.as_slice()),
        Geometry::Instance(instance) => (instance.mesh().uvs.as_slice(), instance.mesh().more_uvs.as_slice()),
        _ => (&[][..], &[][..]),
    };
    if uvs.is_empty() {
        let remedy = "use a quad, or a mesh exported with texture coordinates (UVs)";
        return Err(("a picture is to be put on a shape without texture coordinates".into(), remedy.into()));
    }
    match uvs.iter().chain(more).position(|uv| !uv.is_finite() || uv.abs().max_element() > MOST_REPEATS) {
        Some(i) => Err((format!("the texture coordinates of vertex {i} are beyond 1e6"), "export the mesh again".into())),
        None => Ok(()),
    }
}

/// Has the triangle no area in double precision?
fn is_flat([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() <= f64::EPSILON * longest
}

/// Unit normals per vertex, the mean of the adjacent faces by area; for a vertex without faces or where they cancel, +Y.
pub fn smooth_normals(mesh: &Mesh) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let area = (b - a).cross(c - a);
        t.iter().for_each(|&v| sums[v as usize] += area);
    }
    sums.into_iter().map(|n| n.normalize_or(DVec3::Y)).collect()
}

/// Volume of a closed surface (its area vectors cancel), m^3: negative if its triangles face inwards. 0 if it is open.
pub fn volume(mesh: &Mesh) -> f64 {
    let origin = mesh.triangles.first().map_or(DVec3::ZERO, |t| mesh.positions[t[0] as usize]);
    let (mut open, mut area, mut volume) = (DVec3::ZERO, 0.0, 0.0);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize] - origin);
        let doubled = (b - a).cross(c - a);
        open += doubled;
        area += doubled.length();
        volume += a.dot(doubled);
    }
    if open.length() < 1e-6 * area { volume / 6.0 } else { 0.0 }
}
