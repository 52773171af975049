//! Where paths start: in which volumes, and on which side of a surface that their sensor or lamp lies in. Nothing here is shared with the GPU's way of
//! finding out.

use super::Stage;
use crate::geometry::world::Hit;
use crate::scene::{Light, Sensor};
use glam::{DVec3, dvec3};

/// Distance below which a point counts as lying on a surface, at coordinates of the size `scale`.
pub(super) fn on_surface(p: DVec3, scale: f64) -> f64 {
    1024.0 * f64::EPSILON * scale.max(p.abs().max_element())
}

/// What has no side of its own counts as a little above where it is.
fn above() -> DVec3 {
    64.0 * dvec3(0.3, 1.0, 0.2)
}

/// The sensor a little to the side that it looks to, so that it lies in no surface of a scene of this size.
pub(super) fn off_surfaces(mut sensor: Sensor, scale: f64) -> Sensor {
    match &mut sensor {
        Sensor::Perspective { eye, frame, lens_radius, .. } => {
            let to = if *lens_radius > 0.0 { -frame.z_axis } else { above() * 0.05 - frame.z_axis * 64.0 };
            *eye += on_surface(*eye, scale) * to;
        }
        Sensor::Orthographic { eye, frame, .. } => *eye -= on_surface(*eye, scale) * frame.z_axis,
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            *origin += on_surface(*origin, scale) * edge_u.cross(*edge_v).normalize();
        }
        Sensor::IrradianceSphere { center, radius } => *radius += on_surface(center.abs() + *radius, scale),
    }
    sensor
}

/// Likewise what is added to the position of a light that is no shape.
pub(super) fn off_light(light: &Light, scale: f64) -> DVec3 {
    let Some(place) = light.placement() else {
        return DVec3::ZERO;
    };
    let to = if place.is_even() { above() } else { place.axis };
    to * on_surface(place.position, scale)
}

impl Stage {
    /// The interiors around `p`, which lies on no surface: those that one who comes down from far above has entered, and not left, on arriving there.
    pub(super) fn interiors_at(&self, p: DVec3) -> Vec<usize> {
        let mut inside = Vec::new();
        if !self.has_interiors {
            return inside;
        }
        let upwards = dvec3(-0.009_1, 1.0, 0.011_3).normalize();
        let met = self.world.crossings(p, upwards);
        let mut last: Option<&Hit> = None;
        for hit in met.iter().rev() {
            let enters = upwards.dot(hit.ng) > 0.0;
            // Two triangles that share the edge are one surface.
            let again = last.is_some_and(|l| l.shape == hit.shape && (upwards.dot(l.ng) > 0.0) == enters && l.t == hit.t);
            last = Some(hit);
            let Some(interior) = self.scene.volume_of(&self.scene.shapes[hit.shape]).filter(|_| !again) else {
                continue;
            };
            if enters {
                inside.push(interior);
            } else if let Some(at) = inside.iter().position(|&i| i == interior) {
                inside.swap_remove(at);
            }
        }
        inside
    }
}
