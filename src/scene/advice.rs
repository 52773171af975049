//! What is probably not meant in a scene that is right by the letter: each line says what, where, and what to do about it.

mod sight;

use crate::geometry::{Bounds, bounds, corners};
use crate::scene::bounds_of_all;
use crate::scene::initial_interiors;
use crate::scene::mesh;
use crate::scene::texture;
use crate::scene::volumes::overlaps;
use crate::scene::weld::{Edge, Weld};
use crate::scene::{Geometry, Interior, Light, Mesh, Scene, Shape};
use glam::{DVec2, DVec3};
use sight::sight;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// Glass larger than this, or scenes larger than [`LARGEST_SCENE`], were probably made in millimetres; m.
const LARGEST_GLASS: f64 = 20.0;
/// See [`LARGEST_GLASS`].
const LARGEST_SCENE: f64 = 1000.0;
/// What a table of 8192 by 8192 texels holds, bytes: every adapter has that.
const LARGEST_TABLE: u64 = 1 << 30;
/// Pairs of faces in one plane that are looked at, at most.
const MOST_PAIRS: usize = 100_000;

/// Lamps of which it is looked up whether they lie in glass, at most.
const MOST_LAMPS: usize = 1000;
/// Lines of a kind at most; the others are counted.
const MOST_LINES: usize = 5;

/// Triangles of a scene that is looked through before it is rendered, at most: a second's work.
const MOST_AT_ONCE: usize = 300_000;

/// Advice on a scene, one line each: nothing where nothing looks like a mistake.
pub fn advice(scene: &Scene) -> Vec<String> {
    let slow = [solids, overlapping_volumes, overlapping_faces, lights_inside];
    slow.into_iter().map(|kind| kind(scene)).flat_map(few).chain(quick_advice(scene)).collect()
}

/// Of [`advice`] what takes next to no time: all of it, but for large scenes.
pub fn advice_before_rendering(scene: &Scene) -> Vec<String> {
    if scene.triangles() > MOST_AT_ONCE { quick_advice(scene) } else { advice(scene) }
}

fn quick_advice(scene: &Scene) -> Vec<String> {
    let kinds = [unlit, inside_out, units, large_pictures, sight].into_iter().map(|kind| kind(scene));
    [scene.warnings.clone()].into_iter().chain(kinds).flat_map(few).collect()
}

/// The first few of these lines, and how many more there are.
fn few(mut lines: Vec<String>) -> Vec<String> {
    let more = lines.len().saturating_sub(MOST_LINES);
    if more > 0 {
        lines.truncate(MOST_LINES);
        lines.push(format!("and {more} more like the last one; what helps it helps them"));
    }
    lines
}

/// Volumes whose triangles face inwards.
fn inside_out(scene: &Scene) -> Vec<String> {
    let mut volumes: HashMap<*const Mesh, f64> = HashMap::new();
    let is_inside_out = |shape: &&Shape| match &shape.geometry {
        Geometry::Mesh(mesh) => mesh::volume(mesh) < 0.0,
        Geometry::Instance(instance) => {
            let own = *volumes.entry(Arc::as_ptr(instance.mesh())).or_insert_with(|| mesh::volume(instance.mesh()));
            own * instance.to_world().matrix3.determinant() < 0.0
        }
        _ => false,
    };
    let volumes = scene.shapes.iter().filter(|s| scene.volume_of(s).is_some());
    let line = |s: &Shape| {
        format!(
            "the triangles of {:?} face inwards, so its inside is outside; turn them round (Blender: Mesh > Normals > Recalculate Outside)",
            s.name
        )
    };
    volumes.filter(is_inside_out).map(line).collect()
}

fn emits(shape: &Shape) -> bool {
    shape.emission.as_ref().is_some_and(|e| !e.radiance.is_zero())
}

fn unlit(scene: &Scene) -> Vec<String> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    if scene.lights.iter().all(|light| light.is_dark(lo, hi)) && !scene.shapes.iter().any(emits) {
        return vec!["nothing gives light, so the picture will be black; add \"lights\", or \"emission\" to a shape".into()];
    }
    Vec::new()
}

/// Are the surfaces of volumes closed, and are their faces turned one way?
fn solids(scene: &Scene) -> Vec<String> {
    let mut parts: BTreeMap<usize, Vec<&Shape>> = BTreeMap::new();
    for shape in &scene.shapes {
        if let Some(interior) = scene.volume_of(shape) {
            parts.entry(interior).or_default().push(shape);
        }
    }
    let mut out = Vec::new();
    parts.iter().for_each(|(&interior, parts)| solid(scene, interior, parts, &mut out));
    out
}

/// All shapes that bound this volume count together, and other surfaces where they close it.
fn solid(scene: &Scene, interior: usize, parts: &[&Shape], out: &mut Vec<String>) {
    let name = &scene.interiors[interior].name;
    let is_disc = |at: DVec3| {
        scene.shapes.iter().any(|s| matches!(&s.geometry, Geometry::Disc { center, .. } if center.distance(at) < 1e-6))
    };
    // Edges by the places of their ends, of which those within rounding (in seams, of single precision) are one: how often they are passed one way and
    // the other.
    let mut edges: HashMap<Edge, [u32; 2]> = HashMap::new();
    let size = parts.iter().fold(Bounds::EMPTY, |b, s| b.union(bounds(&s.geometry)));
    let weld = Weld::new(size);
    let (mut area, mut sum) = (0.0, DVec3::ZERO);
    for shape in parts {
        match &shape.geometry {
            Geometry::Mesh(mesh) => {
                for t in 0..mesh.triangles.len() {
                    let c = corners(mesh, t);
                    let normal = (c[1] - c[0]).cross(c[2] - c[0]);
                    (area, sum) = (area + normal.length(), sum + normal);
                    for (edge, way) in weld.edges(c) {
                        edges.entry(edge).or_default()[way] += 1;
                    }
                }
            }
            Geometry::Cylinder { base, axis, length, .. } if !is_disc(*base) || !is_disc(*base + *axis * *length) => out.push(format!(
                "the cylinder {:?} of {name:?} has no ends, so light gets in and out where there is no surface; add \"capped\": true",
                shape.name
            )),
            _ => {}
        }
    }
    let mut open: BTreeSet<Edge> = edges.iter().filter(|(_, [a, b])| a + b == 1).map(|(edge, _)| *edge).collect();
    let is_near = |s: &&Shape| scene.volume_of(s) != Some(interior) && bounds(&s.geometry).overlaps(&size);
    for other in scene.shapes.iter().filter(is_near) {
        if let (Geometry::Mesh(mesh), false) = (&other.geometry, open.is_empty()) {
            (0..mesh.triangles.len()).flat_map(|t| weld.edges(corners(mesh, t))).for_each(|(edge, _)| {
                open.remove(&edge);
            });
        }
    }
    let open = open.len();
    // A sheet that faces upwards is the surface of something deep, such as water.
    let is_sheet = sum.y > 0.5 * area;
    if open > 0 && !is_sheet {
        out.push(format!(
            "the surface of {name:?} has a hole ({open} edges belong to one face only), so light gets in and out where there is no surface; close the \
             mesh and merge its vertices, or use \"thin_dielectric\" for a pane"
        ));
    } else if edges.values().any(|&[a, b]| a.abs_diff(b) >= 2) {
        out.push(format!(
            "neighbouring faces of {name:?} are turned different ways, so inside and outside change places; recalculate the normals \
             (Blender: Mesh > Normals > Recalculate Outside)"
        ));
    }
}

/// Volumes of equal priority that overlap, none of which lies within the other.
pub fn overlapping_volumes(scene: &Scene) -> Vec<String> {
    let name = |shape: usize| &scene.shapes[shape].name;
    let line = |[under, over]: [usize; 2]| {
        format!(
            "{:?} and {:?} overlap with the same priority, and there {:?} rules as it comes later; give one of them a greater \"priority\", or move them \
             apart",
            name(under),
            name(over),
            name(over)
        )
    };
    overlaps(scene).into_iter().map(line).collect()
}

/// A triangle in its plane.
struct Face {
    shape: usize,
    corners: [DVec2; 3],
}

/// Opaque faces of two shapes that lie in one plane, overlap and look the same way: which of them is seen is up to chance. (Faces that touch back to back, as
/// of a box on a table, are never seen.)
fn overlapping_faces(scene: &Scene) -> Vec<String> {
    let size = bounds_of_all(&scene.shapes);
    if size.is_empty() {
        return Vec::new();
    }
    let scale = (size.max - size.min).length().max(1e-9);
    let opaque = |m: usize| scene.made_of(m).into_iter().all(|m| scene.materials[m].is_opaque());
    let mut planes: HashMap<[i64; 4], Vec<Face>> = HashMap::new();
    for (index, shape) in scene.shapes.iter().enumerate().filter(|(_, s)| opaque(s.material)) {
        let Geometry::Mesh(mesh) = &shape.geometry else { continue };
        for t in 0..mesh.triangles.len() {
            let c = corners(mesh, t);
            let n = (c[1] - c[0]).cross(c[2] - c[0]).normalize_or_zero();
            let at = (c[0] - size.min).dot(n) / scale;
            let key = [n.x * 1e5, n.y * 1e5, n.z * 1e5, at * 1e7].map(|v| v.round() as i64);
            let (x, y) = n.any_orthonormal_pair();
            let corners = c.map(|p| DVec2::new(p.dot(x), p.dot(y)));
            planes.entry(key).or_default().push(Face { shape: index, corners });
        }
    }
    let mut pairs = 0;
    let mut said: BTreeSet<[usize; 2]> = BTreeSet::new();
    'all: for faces in planes.values() {
        for (i, a) in faces.iter().enumerate() {
            for b in &faces[..i] {
                pairs += 1;
                if pairs > MOST_PAIRS {
                    break 'all;
                }
                let shapes = [a.shape.min(b.shape), a.shape.max(b.shape)];
                if a.shape != b.shape && !said.contains(&shapes) && overlap(&a.corners, &b.corners) {
                    said.insert(shapes);
                }
            }
        }
    }
    let name = |shape: usize| &scene.shapes[shape].name;
    let line = |[a, b]: [usize; 2]| {
        format!(
            "{:?} and {:?} overlap in one plane, and which is seen is up to rounding; move them apart or remove one",
            name(a),
            name(b)
        )
    };
    said.into_iter().map(line).collect()
}

/// Do two triangles share an area? By their separating axes; a touch within 1e-6 of their size is none.
fn overlap(a: &[DVec2; 3], b: &[DVec2; 3]) -> bool {
    let edges = |t: &[DVec2; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let range = |t: &[DVec2; 3], axis: DVec2| {
        let along = t.map(|p| p.dot(axis));
        (along.into_iter().fold(f64::INFINITY, f64::min), along.into_iter().fold(f64::NEG_INFINITY, f64::max))
    };
    edges(a).into_iter().chain(edges(b)).all(|edge| {
        let axis = edge.perp().normalize_or_zero();
        let ((a0, a1), (b0, b1)) = (range(a, axis), range(b, axis));
        a1.min(b1) - a0.max(b0) > 1e-6 * (a1 - a0).min(b1 - b0)
    })
}

/// Lamps in glass: mostly those that were meant to stand before it.
fn lights_inside(scene: &Scene) -> Vec<String> {
    let placed = |light: &Light| Some((format!("a {}", light.name()), light.position()?));
    let mut places: Vec<(String, DVec3)> = scene.lights.iter().filter_map(placed).collect();
    for shape in scene.shapes.iter().filter(|s| emits(s) && scene.volume_of(s).is_none()) {
        let at = match &shape.geometry {
            Geometry::Mesh(mesh) => corners(mesh, 0).iter().sum::<DVec3>() / 3.0,
            Geometry::Instance(instance) => 0.5 * (instance.bounds().min + instance.bounds().max),
            Geometry::Sphere { center, .. } | Geometry::Disc { center, .. } => *center,
            Geometry::Cylinder { base, axis, length, .. } => *base + *axis * (0.5 * length),
            Geometry::LensFace(face) => face.ends()[0],
        };
        places.push((format!("the lamp {:?}", shape.name), at));
    }
    places.truncate(MOST_LAMPS);
    let points: Vec<DVec3> = places.iter().map(|(_, p)| *p).collect();
    let around: &Interior = &scene.interiors[0];
    let line = |((what, _), inside): (&(String, DVec3), Vec<usize>)| {
        let glass = inside.iter().map(|&i| &scene.interiors[i]).find(|i| i.ior != around.ior)?;
        Some(format!("{what} lies inside {:?}; if it should shine on it from outside, move it out", glass.name))
    };
    places.iter().zip(initial_interiors(scene, &points)).filter_map(line).collect()
}

/// Pictures with the texture coordinates of all triangles, where they are more than usual adapters hold.
fn large_pictures(scene: &Scene) -> Vec<String> {
    let bytes = texture::bytes(scene);
    if bytes <= LARGEST_TABLE {
        return Vec::new();
    }
    vec![format!(
        "pictures on surfaces take {} MiB, and usual adapters hold {} MiB of them; use smaller pictures, or fewer colours that multiply them",
        bytes >> 20,
        LARGEST_TABLE >> 20
    )]
}

fn units(scene: &Scene) -> Vec<String> {
    let size = |b: Bounds| if b.is_empty() { 0.0 } else { (b.max - b.min).max_element() };
    let whole = size(bounds_of_all(&scene.shapes));
    let is_glass = |s: &&Shape| scene.materials[scene.bounding_part(s.material)].interface().is_some();
    let glass =
        scene.shapes.iter().filter(is_glass).map(|s| (size(bounds(&s.geometry)), &s.name)).max_by(|a, b| a.0.total_cmp(&b.0));
    let remedy = "lengths are metres: if they were meant as millimetres, write \"unit\": \"mm\" beside the shape's or mesh's other keys, or scale everything by 0.001";
    match glass {
        Some((size, name)) if size > LARGEST_GLASS => vec![format!("the glass {name:?} is {size:.0} m across; {remedy}")],
        _ if whole > LARGEST_SCENE => vec![format!("the scene is {whole:.0} m across; {remedy}")],
        _ => Vec::new(),
    }
}
