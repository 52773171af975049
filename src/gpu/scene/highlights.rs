//! Small bright lamps, whose mirror images in glass camera paths look for (shaders/light/highlight.wgsl).

use crate::geometry::{Bounds, bounds};
use crate::scene::{Geometry, Light, Scene};
use glam::{DVec3, Vec4};
use std::f64::consts::PI;

/// So many lamps.
const MOST: usize = 8;
/// A sun's distance over the radius of the scene: so far that all of the scene sees it in one direction.
const AFAR: f64 = 1e5;

/// Spheres around the lamps of the greatest radiance, brightest first: centre relative to `origin`, radius, m. Where there are more than there is room for, the
/// image of a dim one is found as rarely as glass reflects.
pub(super) fn brightest(scene: &Scene, around: Bounds, origin: DVec3) -> Vec<Vec4> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let lamps = scene.shapes.iter().filter_map(|shape| {
        let radiance = shape.emission.as_ref().map(|e| e.radiance.mean(lo, hi)).filter(|&radiance| radiance > 0.0)?;
        let (center, radius) = match shape.geometry {
            Geometry::Sphere { center, radius } => (center, radius),
            ref geometry => bounds(geometry).ball(),
        };
        Some((radiance, center - origin, radius))
    });
    let afar = AFAR * around.ball().1.max(1.0);
    let suns = scene.lights.iter().filter_map(|light| match light {
        Light::Sun { direction, cos_angle, irradiance } if *cos_angle < 1.0 => {
            let sin_squared = (1.0 - cos_angle) * (1.0 + cos_angle);
            Some((irradiance.mean(lo, hi) / (PI * sin_squared), -*direction * afar, sin_squared.sqrt() * afar))
        }
        _ => None,
    });
    let mut all: Vec<(f64, DVec3, f64)> = lamps.chain(suns).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    // A little larger, so that rounding does not leave out an edge.
    all.iter().take(MOST).map(|(_, center, radius)| center.as_vec3().extend((radius * 1.001) as f32)).collect()
}
