//! Transforms in double precision, and what they do to geometry.

use crate::error::Result;
use crate::scene::Geometry;
use crate::scene::json::{LARGEST_LENGTH, Node};
use crate::scene::mesh;
use glam::{DMat3, DMat4, DQuat, DVec3, DVec4, EulerRot};
use serde_json::Value;
use std::sync::Arc;

/// What is wrong and what to do about it, where the caller knows the place.
pub type Flaw = (String, String);

/// A transform: four rows of a 4x4 matrix, an object with `matrix` or with `scale`, `rotate_deg` (with `axis`) and `translate` applied in this
/// order, or an array of such objects applied first to last.
pub fn parse(node: &Node) -> Result<DMat4> {
    let steps = match node.value {
        Value::Array(items) if items.first().is_some_and(Value::is_object) => node.array(1)?,
        Value::Array(_) => return rows(node),
        _ => vec![node.clone()],
    };
    steps.iter().try_fold(DMat4::IDENTITY, |so_far, step| Ok(self::step(step)? * so_far))
}

fn step(node: &Node) -> Result<DMat4> {
    node.object("transform")?;
    if let Some(matrix) = node.get("matrix") {
        if node.value.as_object().is_some_and(|o| o.len() > 1) {
            return Err(node.fail("\"matrix\" stands beside other keys", "use an array of transforms, applied first to last"));
        }
        return rows(&matrix);
    }
    let scale = match node.get("scale") {
        None => DVec3::ONE,
        Some(n) if n.value.is_number() => DVec3::splat(n.number()?),
        Some(n) => DVec3::from_array(n.numbers()?),
    };
    if scale.min_element().abs() == 0.0 || scale.to_array().contains(&0.0) {
        return Err(node.fail("a scale of 0 leaves nothing", "use a scale that is not 0"));
    }
    let rotation = match (node.get("rotate_deg"), node.get("axis")) {
        (None, None) => DQuat::IDENTITY,
        (Some(angle), Some(axis)) => DQuat::from_axis_angle(axis.direction()?, angle.number()?.to_radians()),
        (Some(angles), None) => {
            if angles.value.is_number() {
                return Err(
                    angles.fail("an angle without an axis", "add \"axis\": [x, y, z], or give three angles about x, y and z")
                );
            }
            let [x, y, z] = angles.numbers()?.map(f64::to_radians);
            DQuat::from_euler(EulerRot::ZYX, z, y, x) // about x first, then y, then z
        }
        (None, Some(axis)) => return Err(axis.fail("an axis without an angle", "add \"rotate_deg\"")),
    };
    let translation = node.get("translate").map_or(Ok(DVec3::ZERO), |n| n.point())?;
    Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation))
}

fn rows(node: &Node) -> Result<DMat4> {
    let rows = node.array(4)?;
    if rows.len() != 4 {
        return Err(node.fail(format!("{} rows", rows.len()), "give four rows of four numbers"));
    }
    let mut m = [DVec4::ZERO; 4];
    for (row, out) in rows.iter().zip(&mut m) {
        *out = DVec4::from_array(row.numbers()?);
    }
    if m[3] != DVec4::W {
        return Err(rows[3].fail("the last row is not [0, 0, 0, 1]", "use an affine matrix, written row by row"));
    }
    let matrix = DMat4::from_cols(m[0], m[1], m[2], m[3]).transpose();
    check_affine(&matrix).map_err(|(problem, remedy)| node.fail(problem, remedy))?;
    Ok(matrix)
}

/// Is the matrix finite and invertible?
pub fn check_affine(m: &DMat4) -> std::result::Result<(), Flaw> {
    let linear = DMat3::from_mat4(*m);
    let inverse = linear.inverse();
    if !(m.is_finite() && linear.determinant() != 0.0 && inverse.is_finite()) {
        return Err(("the transform is singular or not finite".into(), "use one that can be undone".into()));
    }
    Ok(())
}

/// The factor by which a similarity scales lengths; none if the matrix shears or scales unevenly.
fn similarity(m: &DMat3) -> Option<f64> {
    let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis];
    let scale = m.determinant().abs().cbrt();
    let tolerance = 1e-9 * scale * scale;
    let even = [a, b, c].iter().all(|v| (v.length_squared() - scale * scale).abs() <= tolerance);
    let square = [a.dot(b), b.dot(c), c.dot(a)].iter().all(|d| d.abs() <= tolerance);
    (even && square && scale > 0.0 && scale.is_finite()).then_some(scale)
}

/// Geometry under a transform; the outward side stays outward, also under mirroring. The second value counts dropped triangles.
///
/// Errors: singular or not finite; a round shape that would not stay round; a mesh that [`mesh::place`] refuses; anything beyond 1e9 m.
pub fn apply(m: &DMat4, geometry: &Geometry) -> std::result::Result<(Geometry, usize), Flaw> {
    check_affine(m)?;
    let linear = DMat3::from_mat4(*m);
    let round = || {
        similarity(&linear).ok_or_else(|| {
            (
                "a sphere, disc, cylinder or lens cannot be scaled unevenly".to_string(),
                "scale it evenly, or use a mesh".to_string(),
            )
        })
    };
    let direction = |d: DVec3| (linear * d).normalize();
    let placed = match geometry {
        Geometry::Mesh(mesh) => {
            let (mesh, dropped) = mesh::place(mesh, m)?;
            return Ok((Geometry::Mesh(Arc::new(mesh)), dropped));
        }
        // Only what a scene file describes is placed.
        Geometry::Instance(instance) => return apply(m, &Geometry::Mesh(Arc::new(instance.flattened()))),
        Geometry::Sphere { center, radius } => {
            Geometry::Sphere { center: m.transform_point3(*center), radius: radius * round()? }
        }
        Geometry::Disc { center, normal, radius } => {
            Geometry::Disc { center: m.transform_point3(*center), normal: direction(*normal), radius: radius * round()? }
        }
        Geometry::Cylinder { base, axis, length, radius } => {
            let scale = round()?;
            let base = m.transform_point3(*base);
            Geometry::Cylinder { base, axis: direction(*axis), length: length * scale, radius: radius * scale }
        }
        Geometry::LensFace(face) => Geometry::LensFace(face.placed(|p| m.transform_point3(p), direction, round()?)),
    };
    let (at, sizes) = match &placed {
        Geometry::Sphere { center, radius } | Geometry::Disc { center, radius, .. } => (*center, [*radius, *radius]),
        Geometry::Cylinder { base, length, radius, .. } => (*base, [*length, *radius]),
        Geometry::LensFace(face) => (face.base, [face.radius(), face.radius()]),
        Geometry::Mesh(_) | Geometry::Instance(_) => (DVec3::ZERO, [1.0, 1.0]),
    };
    let near = at.is_finite() && at.abs().max_element() <= LARGEST_LENGTH;
    if !near || sizes.iter().any(|s| !(1e-12..=LARGEST_LENGTH).contains(s)) {
        return Err(("the shape's place or size is beyond 1e-12 to 1e9 m".into(), "use metres of a sensible size".into()));
    }
    Ok((placed, 0))
}
