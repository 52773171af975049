//! Small bright lamps and suns, whose mirror images in glass camera paths look for (shaders/light/highlight.wgsl).

use crate::geometry::{Bounds, bounds};
use crate::scene::{EnvironmentMap, Geometry, Light, Scene};
use glam::{DVec3, Vec4};
use std::f64::consts::PI;

/// So many lamps.
const MOST: usize = 8;
/// A sun's distance over the radius of the scene: so far that all of the scene sees it in one direction.
const AFAR: f64 = 1e5;
/// Of a sun in a picture the greatest angle, which is what shaders take for small.
const WIDEST: f64 = 0.25;

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
    let suns = scene.lights.iter().filter_map(|light| {
        let (radiance, direction, sin) = match light {
            Light::Sun { direction, cos_angle, irradiance } if *cos_angle < 1.0 => {
                let sin_squared = (1.0 - cos_angle) * (1.0 + cos_angle);
                (irradiance.mean(lo, hi) / (PI * sin_squared), -*direction, sin_squared.sqrt())
            }
            Light::Image(map) => {
                let (radiance, direction, angle) = sun_of(map)?;
                (radiance * map.illuminant.mean(lo, hi), direction, angle.sin())
            }
            _ => return None,
        };
        Some((radiance, direction * afar, sin * afar))
    });
    let mut all: Vec<(f64, DVec3, f64)> = lamps.chain(suns).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    // A little larger, so that rounding does not leave out an edge.
    all.iter().take(MOST).map(|(_, center, radius)| center.as_vec3().extend((radius * 1.001) as f32)).collect()
}

/// The brightest texel of a picture of the surroundings, with all that are at least half as bright, if those lie close together, as the Sun's do: radiance over the
/// illuminant, direction, angle of a cone around them.
fn sun_of(map: &EnvironmentMap) -> Option<(f64, DVec3, f64)> {
    let solid_angle = |texel: usize| map.solid_angle(texel / map.width as usize);
    let radiances: Vec<f64> = map.weights().iter().enumerate().map(|(texel, weight)| weight / solid_angle(texel)).collect();
    let brightest = (0..radiances.len()).max_by(|&a, &b| radiances[a].total_cmp(&radiances[b]))?;
    let direction = map.direction(brightest);
    let bright = (0..radiances.len()).filter(|&texel| radiances[texel] >= 0.5 * radiances[brightest]);
    let off = bright.map(|texel| direction.dot(map.direction(texel)).clamp(-1.0, 1.0).acos()).fold(0.0, f64::max);
    let angle = off + 0.5 * (2.0f64.sqrt() * PI) / f64::from(map.height).min(f64::from(map.width) / 2.0);
    (radiances[brightest] > 0.0 && angle < WIDEST).then_some((radiances[brightest], direction, angle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::EnvironmentTexels;
    use crate::spectrum::Spectrum;
    use glam::{DMat3, dvec3};

    /// A grey picture with some texels so many times as bright.
    fn picture(bright: &[(u32, u32)], times: f32) -> EnvironmentMap {
        let (width, height) = (64, 32);
        let scale = |i: u32| if bright.contains(&(i % width, i / width)) { times } else { 1.0 };
        let texels = EnvironmentTexels::Colors((0..width * height).map(|i| [0.0, 0.0, 0.0, scale(i)]).collect());
        EnvironmentMap { width, height, texels, illuminant: Spectrum::Constant(1.0), to_local: DMat3::IDENTITY }
    }

    #[test]
    fn the_sun_of_a_picture_is_found_and_a_bright_window_is_none() {
        // u = (8 + 1/2) / 64 and v = (8 + 1/2) / 32: both angles are about 45 degrees.
        let (radiance, direction, angle) = sun_of(&picture(&[(8, 8)], 1000.0)).expect("a sun");
        let a = PI * 8.5 / 32.0;
        assert!((radiance - 500.0).abs() < 1e-3, "{radiance}");
        assert!(direction.distance(dvec3(a.sin() * a.cos(), a.cos(), a.sin() * a.sin())) < 1e-12, "{direction}");
        // Half the diagonal of a texel.
        assert!((0.06..0.08).contains(&angle), "{angle}");
        let (.., wider) = sun_of(&picture(&[(8, 8), (9, 8)], 1000.0)).expect("a sun");
        assert!(wider > angle + 0.06 && wider < 0.2, "{wider}");
        assert!(sun_of(&picture(&[(8, 8), (40, 8)], 1000.0)).is_none());
        assert!(sun_of(&picture(&[], 1.0)).is_none());
        assert!(sun_of(&picture(&[(8, 8)], 1.5)).is_none());
    }
}
