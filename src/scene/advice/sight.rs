//! Sensors that see nothing, and lights that light nothing, as far as straight lines tell.

use crate::geometry::world::{Ray, World};
use crate::geometry::{Bounds, bounds};
use crate::scene::{Geometry, Light, Material, Mesh, Scene, Sensor, bounds_of_all, initial_interiors};
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Shapes that are looked at, at most: in larger scenes nothing is said.
const MOST_SHAPES: usize = 100_000;
/// Triangles that are looked at one by one, at most; of what is beyond only its bounds count.
const MOST_TRIANGLES: usize = 100_000;
/// Lights that are looked at, at most.
const MOST_LIGHTS: usize = 100;
/// Rays through the picture, across and down, and the square root of the rays of a light.
const RAYS: u32 = 16;

/// What beams and spots light, and what the sensor sees.
pub(super) fn sight(scene: &Scene) -> Vec<String> {
    if scene.shapes.len() > MOST_SHAPES {
        return Vec::new();
    }
    let targets = Targets::new(scene);
    let of_lights = unlit_paths(scene, &targets).into_iter().chain(shut_in(scene, &targets)).chain(suns_below(scene));
    of_lights.chain(blind(scene, &targets)).chain(inside_glass(scene)).chain(lens(scene)).chain(far_away(scene)).collect()
}

/// What rays can meet.
struct Targets {
    /// Of shapes whose primitives are looked at.
    world: World,
    /// Which these are.
    near: Vec<usize>,
    /// Points on those.
    points: Vec<DVec3>,
    /// Bounds of the others.
    boxes: Vec<Bounds>,
}

impl Targets {
    fn new(scene: &Scene) -> Self {
        let (mut near, mut points, mut boxes, mut triangles) = (Vec::<usize>::new(), Vec::new(), Vec::new(), 0);
        // What has neither a surface nor anything behind it is not there.
        let is_there = |m: usize| !matches!(scene.materials[m], Material::Boundary { interior: None });
        for (index, shape) in scene.shapes.iter().enumerate().filter(|(_, s)| is_there(s.material) || s.emission.is_some()) {
            match &shape.geometry {
                Geometry::Mesh(mesh) if triangles + mesh.triangles.len() <= MOST_TRIANGLES => {
                    triangles += mesh.triangles.len();
                    points.extend(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]));
                    near.push(index);
                }
                Geometry::Mesh(_) | Geometry::Instance(_) => boxes.push(bounds(&shape.geometry)),
                Geometry::Sphere { center, .. } | Geometry::Disc { center, .. } => {
                    points.push(*center);
                    near.push(index);
                }
                Geometry::Cylinder { base, axis, length, .. } => {
                    points.extend([0.0, 0.5, 1.0].map(|t| *base + *axis * (t * length)));
                    near.push(index);
                }
                Geometry::LensFace(face) => {
                    points.extend(face.points().into_iter().map(|(p, _)| p));
                    near.push(index);
                }
            }
        }
        Targets { world: World::new(near.iter().map(|&i| &scene.shapes[i].geometry)), near, points, boxes }
    }

    /// Might light meet anything along one of `rays`, or anywhere where `holds` is true? What is large and thin between the rays is not found.
    fn are_met(&self, rays: &[Ray], holds: impl Fn(DVec3) -> bool) -> bool {
        let corner = |b: &Bounds, i: u32| {
            let pick = |bit: u32, lo: f64, hi: f64| if i >> bit & 1 == 1 { hi } else { lo };
            DVec3::new(pick(0, b.min.x, b.max.x), pick(1, b.min.y, b.max.y), pick(2, b.min.z, b.max.z))
        };
        self.points.iter().any(|&p| holds(p))
            || self.boxes.iter().any(|b| holds(0.5 * (b.min + b.max)) || (0..8).any(|i| holds(corner(b, i))))
            || rays.iter().any(|ray| self.boxes.iter().any(|b| crosses(ray, b)) || !self.world.intersect(ray).is_empty())
    }
}

fn crosses(ray: &Ray, b: &Bounds) -> bool {
    let (near, far) = ((b.min - ray.origin) / ray.dir, (b.max - ray.origin) / ray.dir);
    near.min(far).max_element().max(0.0) <= near.max(far).min_element()
}

/// Points evenly over the unit disc (Vogel 1979).
fn disc() -> impl Iterator<Item = DVec2> {
    let n = RAYS * RAYS;
    (0..n).map(move |i| DVec2::from_angle(f64::from(i) * TAU * 0.618_033_988_75) * ((f64::from(i) + 0.5) / f64::from(n)).sqrt())
}

/// Beams and spots that light nothing.
fn unlit_paths(scene: &Scene, targets: &Targets) -> Vec<String> {
    if !scene.interiors[0].sigma_s.is_zero() {
        return Vec::new();
    }
    let sensor = match scene.sensor {
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            let positions = vec![origin, origin + edge_u, origin + edge_u + edge_v, origin + edge_v];
            Some(Geometry::Mesh(Arc::new(Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() })))
        }
        Sensor::IrradianceSphere { center, radius } => Some(Geometry::Sphere { center, radius }),
        Sensor::Perspective { .. } | Sensor::Orthographic { .. } => None,
    };
    let sensor = World::new(&sensor);
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let line = |light: &Light| {
        let (rays, reach) = match light {
            Light::Beam { origin, direction, radius, .. } => {
                let (x, y) = direction.any_orthonormal_pair();
                let start = |d: DVec2| Ray::new(*origin + (x * d.x + y * d.y) * *radius, *direction);
                (disc().map(start).collect::<Vec<_>>(), None)
            }
            Light::Spot { cos_outer, direction, .. } => (Vec::new(), Some((*direction, *cos_outer))),
            Light::Profile { axes, profile, .. } => (Vec::new(), Some((axes.z_axis, profile.reach().cos()))),
            _ => return None,
        };
        let at = light.position()?;
        let rays = match reach {
            None => rays,
            Some((axis, cos)) => {
                let (x, y) = axis.any_orthonormal_pair();
                // Evenly over the directions of the cone: z falls with the square of the radius in the disc.
                let ray = |d: DVec2| {
                    let z = 1.0 - d.length_squared() * (1.0 - cos);
                    let across = d.normalize_or_zero() * (1.0 - z * z).max(0.0).sqrt();
                    Ray::new(at, (axis * z + x * across.x + y * across.y).normalize())
                };
                disc().map(ray).collect()
            }
        };
        let lights_up = |p: DVec3| match (light, reach) {
            (Light::Beam { direction, radius, .. }, _) => {
                let along = (p - at).dot(*direction);
                along > 0.0 && (p - at - *direction * along).length() < *radius
            }
            (_, Some((axis, cos))) => (p - at).dot(axis) > cos * (p - at).length(),
            _ => false,
        };
        let is_lost = !targets.are_met(&rays, lights_up) && rays.iter().all(|ray| sensor.intersect(ray).is_empty());
        is_lost.then(|| format!("the {} at {} meets nothing on its way; turn or move it, or the scene", light.name(), place(at)))
    };
    let lit = scene.lights.iter().filter(|light| !light.is_dark(lo, hi));
    lit.take(MOST_LIGHTS).filter_map(line).collect()
}

fn place(at: DVec3) -> String {
    format!("[{}]", at.to_array().map(|v| format!("{v:.3}")).join(", "))
}

/// Lights of no size in closed opaque things that the sensor is not in.
fn shut_in(scene: &Scene, targets: &Targets) -> Vec<String> {
    let opaque = |m: usize| scene.made_of(m).into_iter().all(|m| scene.materials[m].is_opaque());
    let sensor = match scene.sensor {
        Sensor::Perspective { eye, .. } | Sensor::Orthographic { eye, .. } => eye,
        Sensor::IrradiancePlane { origin, .. } => origin,
        Sensor::IrradianceSphere { center, .. } => center,
    };
    let contains = |shape: usize, p: DVec3| {
        let b = bounds(&scene.shapes[shape].geometry);
        b.min.cmple(p).all() && p.cmple(b.max).all()
    };
    let line = |light: &Light| {
        let at = light.position().filter(|_| !matches!(light, Light::Beam { .. }))?;
        let mut met = BTreeSet::new();
        for d in sphere() {
            let hit = *targets.world.intersect(&Ray::new(at, d)).first()?;
            met.insert(targets.near[hit.shape]);
        }
        let first = *met.first()?;
        let is_shut = met.len() == 1 && opaque(scene.shapes[first].material) && contains(first, at) && !contains(first, sensor);
        let name = &scene.shapes[first].name;
        is_shut.then(|| {
            format!("the {} at {} is shut in {name:?}, which lets no light out; move one of them", light.name(), place(at))
        })
    };
    scene.lights.iter().take(MOST_LIGHTS).filter_map(line).collect()
}

/// Directions evenly over the sphere (a spherical Fibonacci lattice).
fn sphere() -> impl Iterator<Item = DVec3> {
    let n = RAYS * RAYS;
    (0..n).map(move |i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let across = DVec2::from_angle(f64::from(i) * TAU * 0.618_033_988_75) * (1.0 - y * y).sqrt();
        DVec3::new(across.x, y, across.y)
    })
}

/// Suns that shine upwards.
fn suns_below(scene: &Scene) -> Option<String> {
    let is_below = |light: &Light| matches!(light, Light::Sun { direction, .. } if direction.y > 0.5);
    let text = "a sun shines upwards; its \"direction\" is that in which its light travels: turn the signs if it should stand there instead";
    scene.lights.iter().any(is_below).then(|| text.into())
}

/// A lens as wide as what it looks at is far.
fn lens(scene: &Scene) -> Option<String> {
    let Sensor::Perspective { lens_radius, focus_distance, .. } = scene.sensor else { return None };
    (lens_radius > 0.5 * focus_distance).then(|| {
        format!("the lens is {} m wide and in focus at {focus_distance:.3} m; lengths are metres: one of 25 mm has an aperture_radius of 0.0125", 2.0 * lens_radius)
    })
}

/// A camera for which everything is a speck.
fn far_away(scene: &Scene) -> Option<String> {
    let Sensor::Perspective { eye, tan_half_vfov, .. } = scene.sensor else { return None };
    let all = bounds_of_all(&scene.shapes);
    let size = (all.max - all.min).length();
    let pixels = size * f64::from(scene.film.height) / (2.0 * tan_half_vfov * (0.5 * (all.min + all.max)).distance(eye));
    let text = || {
        format!(
            "all shapes together are {size:.3} m large and {pixels:.2} pixels in the picture; move the camera nearer: lengths are metres"
        )
    };
    (pixels < 2.0).then(text)
}

/// A sensor before which there is nothing to be seen.
fn blind(scene: &Scene, targets: &Targets) -> Option<String> {
    let is_sky = |light: &Light| matches!(light, Light::Constant { .. } | Light::Image(_));
    if scene.lights.iter().any(is_sky) || !scene.interiors[0].sigma_s.is_zero() {
        return None;
    }
    let aspect = f64::from(scene.film.width) / f64::from(scene.film.height);
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(RAYS);
    let rays: Vec<Ray> = (0..RAYS * RAYS).filter_map(|i| scene.sensor.ray(aspect, [at(i % RAYS), at(i / RAYS)])).collect();
    match scene.sensor {
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => return looks_away(scene, origin, edge_u.cross(edge_v)),
        Sensor::IrradianceSphere { .. } => return None,
        Sensor::Perspective { .. } | Sensor::Orthographic { .. } => {}
    }
    let sees = |p: DVec3| scene.sensor.has_in_view(aspect, p) == Some(true);
    let sun_seen = scene.lights.iter().any(|light| match light {
        Light::Sun { direction, cos_angle, .. } => {
            *cos_angle < 1.0 && rays.iter().any(|ray| -ray.dir.dot(*direction) > *cos_angle)
                || matches!(scene.sensor, Sensor::Perspective { eye, .. } if sees(eye - *direction))
        }
        _ => false,
    });
    if sun_seen || targets.are_met(&rays, sees) {
        return None;
    }
    let all = bounds_of_all(&scene.shapes);
    Some(if all.is_empty() {
        "the camera sees nothing: there are no shapes, and no light comes from the sky; add \"shapes\"".into()
    } else {
        let middle = place(0.5 * (all.min + all.max));
        format!(
            "the camera sees nothing: no shape lies in its view; the middle of all shapes is {middle}, which could be its \"target\""
        )
    })
}

/// An irradiance plane, all light and shapes being behind its front.
fn looks_away(scene: &Scene, origin: DVec3, normal: DVec3) -> Option<String> {
    let is_before = |p: DVec3| (p - origin).dot(normal) > 0.0;
    let shape_before = |b: Bounds| {
        // The corner that is furthest along the normal.
        let corner = normal.cmpgt(DVec3::ZERO);
        is_before(DVec3::select(corner, b.max, b.min))
    };
    let light_before = |light: &Light| match light {
        Light::Sun { direction, cos_angle, .. } => {
            -direction.dot(normal.normalize()) > -(1.0 - cos_angle * cos_angle).max(0.0).sqrt()
        }
        Light::Beam { origin: at, direction, radius, .. } => {
            direction.dot(normal) < 0.0 && is_before(*at + normal.normalize() * *radius)
        }
        placed => placed.position().is_none_or(is_before),
    };
    let sees = scene.lights.iter().any(light_before) || scene.shapes.iter().any(|s| shape_before(bounds(&s.geometry)));
    let text = "the irradiance plane sees nothing: its front, to which edge_u x edge_v points, looks away from all shapes and lights; swap edge_u and edge_v";
    (!sees).then(|| text.into())
}

/// A camera within a solid glass, which mostly was to stand before it. In water that has a surface and no walls nothing is said.
fn inside_glass(scene: &Scene) -> Option<String> {
    let (Sensor::Perspective { eye, .. } | Sensor::Orthographic { eye, .. }) = scene.sensor else { return None };
    let within = initial_interiors(scene, &[eye]).pop()?;
    let ruling = within.into_iter().max_by_key(|&i| (scene.interiors[i].priority, i))?;
    let around = |b: Bounds| b.min.cmplt(eye).all() && eye.cmplt(b.max).all();
    let bounds_it = |m: usize| scene.materials[scene.bounding_part(m)].interface().is_some_and(|(i, _)| i == ruling);
    let is_solid = scene.shapes.iter().any(|s| bounds_it(s.material) && around(bounds(&s.geometry)));
    let index = |i: usize| scene.interiors[i].ior.nd();
    let name = &scene.interiors[ruling].name;
    (is_solid && index(ruling) > index(0))
        .then(|| format!("the camera stands inside {name:?}; if it should look at that from outside, move it out"))
}
