//! What light paths are aimed at: spheres around everything that can bend light.

use super::seen;
use crate::geometry::{Bounds, bounds};
use crate::scene::{Geometry, Scene, Shape, bounds_of_all};
use glam::{BVec3, DVec3, Vec4};

/// More shapes than this share one sphere: every light path looks at all spheres.
const MOST: usize = 8;
/// Of what has this share of the scene's radius and more only a part may count: that by which light gets to what is seen,
const WIDE: f64 = 0.1;
/// if the radius of that part is less than this share of all of it.
const SEEN: f64 = 0.25;
/// Radius of that part over the distance from its middle of the places at this rank, of those that are known of it: a view up to the horizon has few far away.
const MARGIN: f64 = 1.5;
const RANK: f64 = 0.75;
/// And its least share of the radius of all.
const LEAST: f64 = 1e-4;
/// Radius over that of the next sphere within: light comes from around that part, too, the less the further away.
const STEP: f64 = 4.0;

/// What light paths are aimed at (shaders/light/aim.wgsl).
#[derive(Debug)]
pub struct Targets {
    /// Centres and radii, m.
    pub spheres: Vec<(DVec3, f64)>,
    /// Whether some lie within each other, around the part that counts of something wide.
    pub nested: bool,
    /// The part that counts of each body, or all of it: the least of its spheres.
    pub parts: Vec<(DVec3, f64)>,
}

impl Targets {
    /// Of a scene. Without guiding, or with nothing to aim at, one sphere around the scene; the parts are the same with it and without.
    pub(super) fn new(scene: &Scene, guiding: bool) -> Self {
        let targets = Self::of_bodies(scene);
        if guiding { targets } else { Targets { spheres: vec![bounds_of_all(&scene.shapes).ball()], nested: false, ..targets } }
    }

    fn of_bodies(scene: &Scene) -> Self {
        let bends: Vec<bool> = scene.shapes.iter().map(|s| bends(scene, s.material)).collect();
        let shapes: Vec<usize> = (0..bends.len()).filter(|&i| bends[i]).collect();
        let mut bodies: Vec<&[usize]> =
            shapes.chunk_by(|&a, &b| scene.are_one_piece(&scene.shapes[a], &scene.shapes[b])).collect();
        let around = bounds_of_all(&scene.shapes).ball();
        if bodies.is_empty() {
            return Targets::plain(vec![around]);
        }
        if bodies.len() > MOST {
            bodies = vec![&shapes];
        }
        let all = |body: &[usize], bounds: &dyn Fn(usize) -> Bounds| body.iter().fold(Bounds::EMPTY, |b, &i| b.union(bounds(i)));
        let whole = |body: &&[usize]| match scene.shapes[body[0]] {
            Shape { geometry: Geometry::Sphere { center, radius }, .. } if body.len() == 1 => (center, radius),
            _ => all(body, &|i| bounds(&scene.shapes[i].geometry)).ball(),
        };
        let spheres: Vec<(DVec3, f64)> = bodies.iter().map(whole).collect();
        let is_large = |sphere: &(DVec3, f64)| sphere.1 >= WIDE * around.1 && !is_in_view(scene, *sphere);
        if !spheres.iter().any(is_large) {
            return Targets::plain(spheres);
        }
        let Some(crossings) = seen::crossings(scene, &bends) else { return Targets::plain(spheres) };
        let part = |(sphere, body): (&(DVec3, f64), &&[usize])| {
            let crossed: Vec<DVec3> = body.iter().flat_map(|&i| crossings[i].iter().copied()).collect();
            let (center, radius) = middle(&crossed);
            let radius = (MARGIN * radius).max(LEAST * sphere.1);
            if is_large(sphere) && !crossed.is_empty() && radius < SEEN * sphere.1 { (center, radius) } else { *sphere }
        };
        let parts: Vec<(DVec3, f64)> = spheres.iter().zip(&bodies).map(part).collect();
        let around = |(part, whole): (&(DVec3, f64), &(DVec3, f64))| {
            let (center, most) = (part.0, whole.1.max(part.1 * 1.5));
            std::iter::successors(Some(part.1), |r| Some(STEP * r)).take_while(move |r| *r < most).map(move |r| (center, r))
        };
        let nested = parts != spheres;
        Targets { spheres: parts.iter().zip(&spheres).flat_map(around).collect(), nested, parts }
    }

    fn plain(spheres: Vec<(DVec3, f64)>) -> Self {
        Targets { parts: spheres.clone(), spheres, nested: false }
    }

    /// As the shaders read them: relative to `origin`, and a little larger, so that rounding does not leave out an edge.
    pub(super) fn records(&self, origin: DVec3) -> Vec<Vec4> {
        self.spheres.iter().map(|&(c, r)| (c - origin).as_vec3().extend((r * 1.0001) as f32)).collect()
    }
}

/// Median of each coordinate, and the distance from there at [`RANK`].
fn middle(places: &[DVec3]) -> (DVec3, f64) {
    let at = |rank: f64, mut values: Vec<f64>| {
        let last = values.len().saturating_sub(1);
        if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by((rank * last as f64) as usize, f64::total_cmp).1 }
    };
    let center = DVec3::from_array([0, 1, 2].map(|axis| at(0.5, places.iter().map(|p| p[axis]).collect())));
    (center, at(RANK, places.iter().map(|p| p.distance(center)).collect()))
}

/// Whether all of a sphere is before the camera and in its picture.
fn is_in_view(scene: &Scene, (center, radius): (DVec3, f64)) -> bool {
    let aspect = f64::from(scene.film.width) / f64::from(scene.film.height);
    let corner = |i: u32| DVec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), DVec3::ONE, DVec3::NEG_ONE);
    (0..8).all(|i| scene.sensor.has_in_view(aspect, center + radius * corner(i)) == Some(true))
}

fn bends(scene: &Scene, material: usize) -> bool {
    scene.made_of(material).into_iter().any(|m| scene.materials[m].bends())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, load_str};
    use std::path::Path;

    /// Of a lake `width` metres wide.
    fn lake(width: f64, camera: serde_json::Value) -> Scene {
        let sheet = |y: f64| {
            let h = 0.5 * width;
            serde_json::json!({"corner": [-h, y, h], "edge_u": [width, 0, 0], "edge_v": [0, 0, -width]})
        };
        let scene = serde_json::json!({
            "film": {"width": 8, "height": 8, "range_nm": [400, 700], "bins": 1},
            "camera": camera,
            "materials": {"water": {"dielectric": {"ior": 1.5}}, "mud": {"diffuse": {"reflectance": 0.5}}},
            "shapes": [{"quad": sheet(0.0), "material": "water"}, {"quad": sheet(-3.0), "material": "mud"}],
            "lights": [{"sun": {"direction": [0.6, -0.8, 0], "angle_deg": 0.53, "irradiance": 1}}],
        });
        load_str(&scene.to_string(), Path::new("lake"), Path::new("."), &LoadOptions::default()).expect("a scene")
    }

    fn targets(width: f64, camera: serde_json::Value) -> Targets {
        Targets::new(&lake(width, camera), true)
    }

    /// A square metre about (x, 0, 0) from above.
    fn above(x: f64) -> serde_json::Value {
        serde_json::json!({"orthographic": {"eye": [x, 2, 0], "target": [x, 0, 0], "up": [0, 0, -1], "height": 1}})
    }

    #[test]
    fn of_a_view_up_to_the_horizon_what_is_near_counts() {
        let camera = serde_json::json!({"perspective": {"eye": [0, 1.7, 0], "target": [0, 1.5, -5], "vfov_deg": 40}});
        let lake = targets(1000.0, camera);
        let (center, radius) = lake.parts[0];
        // The lower edge of the picture is 4.3 m away, and half of the water's rows are nearer than 9 m.
        assert!(lake.nested && radius < 50.0 && center.distance(DVec3::new(0.0, 0.0, -9.0)) < radius, "{lake:?}");
    }

    #[test]
    fn of_something_wide_the_part_that_is_looked_through_counts() {
        let lake = targets(1000.0, above(10.0));
        assert!(lake.nested);
        let [(center, radius)] = lake.parts[..] else { panic!("{lake:?}") };
        // Straight lines from the ground to the sun cross the water 2.25 m west of where it is looked through.
        for place in [10.5, 9.5, 9.5 - 2.25] {
            assert!(center.distance(DVec3::new(place, 0.0, 0.0)) < radius, "{lake:?}");
        }
        assert!(radius < 4.0 && lake.spheres[0] == lake.parts[0], "{lake:?}");
        assert!(lake.spheres.len() > 3 && lake.spheres.windows(2).all(|s| s[0].1 < s[1].1), "{lake:?}");
    }

    #[test]
    fn parts_are_the_same_without_guiding() {
        let scene = lake(1000.0, above(10.0));
        let (guided, plain) = (Targets::new(&scene, true), Targets::new(&scene, false));
        assert_eq!(guided.parts, plain.parts);
        assert!(!plain.nested && plain.spheres.len() == 1 && plain.spheres[0].1 > 500.0, "{plain:?}");
    }

    #[test]
    fn of_a_pond_all_counts() {
        let pond = targets(12.0, above(4.0));
        assert!(!pond.nested && pond.spheres == pond.parts, "{pond:?}");
        assert!((pond.spheres[0].1 - 6.0 * 2f64.sqrt()).abs() < 1e-9);
    }
}
