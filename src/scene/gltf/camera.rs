//! Cameras of a glTF file, and one for files that have none.

use crate::error::Result;
use crate::scene::bounds_of_all;
use crate::scene::gltf::light::pose;
use crate::scene::json::{LARGEST_LENGTH, Node};
use crate::scene::{Sensor, Shape};
use glam::{DMat3, DMat4, DVec3};

/// The camera of this node under `world`, and the width over height of what it is meant for, if it says so.
pub(in crate::scene) fn sensor(node: &Node, world: &DMat4) -> Result<(Sensor, Option<f64>)> {
    let (eye, frame) = pose(node, world)?;
    if let Some(perspective) = node.get("perspective") {
        let half = 0.5 * perspective.need("yfov")?.within(1e-6, 3.13)?;
        let aspect = perspective.get("aspectRatio").map(|a| a.within(1e-3, 1e3)).transpose()?;
        let sensor =
            Sensor::Perspective { eye, frame, tan_half_vfov: half.tan(), lens_radius: 0.0, focus_distance: 1.0, optics: None };
        return Ok((sensor, aspect));
    }
    let orthographic = node.need("orthographic")?;
    // A negative one mirrors the picture, which cameras do not.
    let half = |key: &str| -> Result<f64> {
        let node = orthographic.need(key)?;
        let size = node.number()?.abs();
        if !(1e-12..=LARGEST_LENGTH).contains(&size) {
            return Err(node.fail(format!("{size} m is out of range"), "lengths are metres, from 1e-12 to 1e9"));
        }
        Ok(size)
    };
    let (x, y) = (half("xmag")?, half("ymag")?);
    Ok((Sensor::Orthographic { eye, frame, height: 2.0 * y }, Some((x / y).clamp(1e-3, 1e3))))
}

/// A camera of 40 degrees, a little from above and the side, that sees all shapes (which here are meshes).
pub(in crate::scene) fn framing(shapes: &[Shape]) -> Sensor {
    let bounds = bounds_of_all(shapes);
    let (lo, hi) = (bounds.min, bounds.max);
    let radius = (0.5 * (hi - lo).length()).max(1e-9);
    let half = 20f64.to_radians();
    let backward = DVec3::new(0.4, 0.35, 1.0).normalize();
    let distance = 1.05 * radius / half.sin();
    let right = DVec3::Y.cross(backward).normalize();
    Sensor::Perspective {
        eye: 0.5 * (lo + hi) + backward * distance,
        frame: DMat3::from_cols(right, backward.cross(right), backward),
        tan_half_vfov: half.tan(),
        lens_radius: 0.0,
        focus_distance: distance,
        optics: None,
    }
}
