//! Where light gets through what bends it on its way to what the sensor sees, as far as a few rays tell.

use crate::bsdf::fresnel::{reflect, refract};
use crate::geometry::world::{Hit, Ray, World};
use crate::geometry::{Bounds, Geometry, bounds};
use crate::scene::{Light, Scene, Sensor};
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Rays through the picture, across and down.
const RAYS: u32 = 24;
/// Surfaces that a ray is followed through, at most.
const MOST_SURFACES: u32 = 32;
/// Lamps that places are looked at from, at most.
const MOST_LIGHTS: usize = 32;
/// Triangles that are looked at, at most: a hierarchy over more takes too long.
const MOST_TRIANGLES: usize = 2_000_000;
/// Wavelength by whose index rays are bent, nm.
const WAVELENGTH: f64 = 550.0;

/// For each shape of the scene that `bends` names the places where rays from the sensor cross it, and where straight lines from what they arrive at to the
/// lights do. Nothing of a scene that is too large to look at.
pub(super) fn crossings(scene: &Scene, bends: &[bool]) -> Option<Vec<Vec<DVec3>>> {
    let triangles = |geometry: &Geometry| match geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        Geometry::Instance(instance) => instance.mesh().triangles.len(),
        _ => 1,
    };
    if scene.shapes.iter().map(|s| triangles(&s.geometry)).sum::<usize>() > MOST_TRIANGLES {
        return None;
    }
    let flattened = scene.flattened();
    let world = World::new(flattened.shapes.iter().map(|s| &s.geometry));
    let lamps = lamps(scene);
    let mut sight = Sight { scene, bends, world, lamps, crossed: vec![Vec::new(); scene.shapes.len()] };
    match &scene.sensor {
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            for (u, v) in places() {
                sight.light_up(&Ray::new(*origin + *edge_u * u + *edge_v * v, DVec3::ZERO));
            }
        }
        Sensor::IrradianceSphere { center, radius } => {
            for (u, v) in places() {
                let (y, phi) = (1.0 - 2.0 * v, TAU * u);
                let across = (1.0 - y * y).sqrt();
                sight.light_up(&Ray::new(*center + *radius * dvec3(across * phi.cos(), y, -across * phi.sin()), DVec3::ZERO));
            }
        }
        camera => {
            let aspect = f64::from(scene.film.width) / f64::from(scene.film.height);
            for ray in places().filter_map(|(u, v)| camera.ray(aspect, [u, v])) {
                sight.follow(ray);
            }
        }
    }
    Some(sight.crossed)
}

/// Places of the unit square.
fn places() -> impl Iterator<Item = (f64, f64)> {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(RAYS);
    (0..RAYS * RAYS).map(move |i| (at(i % RAYS), at(i / RAYS)))
}

/// Where light comes from.
enum Lamp {
    /// From a place.
    At(DVec3),
    /// From infinity: the direction towards it.
    Towards(DVec3),
}

fn lamps(scene: &Scene) -> Vec<Lamp> {
    let of_light = |light: &Light| match light {
        Light::Sun { direction, .. } | Light::Beam { direction, .. } => vec![Lamp::Towards(-*direction)],
        // Of a sky, straight up and a few others.
        Light::Constant { .. } | Light::Image(_) => {
            let s = FRAC_1_SQRT_2;
            [(0.0, 1.0, 0.0), (s, s, 0.0), (-s, s, 0.0), (0.0, s, s), (0.0, s, -s)].map(|d| Lamp::Towards(d.into())).into()
        }
        placed => placed.position().map(Lamp::At).into_iter().collect(),
    };
    let of_shape = |geometry: &Geometry| {
        let Bounds { min, max } = bounds(geometry);
        [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| Lamp::At(min.lerp(max, t)))
    };
    let emitters = scene.shapes.iter().filter(|s| s.emission.is_some()).flat_map(|s| of_shape(&s.geometry));
    scene.lights.iter().flat_map(of_light).chain(emitters).take(MOST_LIGHTS).collect()
}

struct Sight<'a> {
    scene: &'a Scene,
    bends: &'a [bool],
    world: World,
    lamps: Vec<Lamp>,
    crossed: Vec<Vec<DVec3>>,
}

impl Sight<'_> {
    /// What a ray meets first, or nothing, and the ray that goes on from there as it came.
    fn next(&mut self, ray: &Ray) -> Option<(Hit, Ray)> {
        let hits = self.world.intersect(ray);
        let first = *hits.first()?;
        for hit in hits.iter().filter(|hit| self.bends[hit.shape]) {
            self.crossed[hit.shape].push(hit.p);
        }
        let on = hits.iter().map(|h| h.prim).collect();
        Some((first, Ray { origin: first.p, dir: ray.dir, t_min: 0.0, on }))
    }

    /// Follows a ray of the sensor as it is bent, up to where it ends.
    fn follow(&mut self, mut ray: Ray) {
        for _ in 0..MOST_SURFACES {
            let Some((hit, mut on)) = self.next(&ray) else { return };
            let material = self.scene.bounding_part(self.scene.shapes[hit.shape].material);
            let opaque = self.scene.materials[material].is_opaque();
            if opaque && !self.bends[hit.shape] {
                return self.light_up(&on);
            }
            let enters = ray.dir.dot(hit.ng) < 0.0;
            let normal = if enters { hit.ng } else { -hit.ng };
            if opaque {
                on.dir = reflect(-ray.dir, normal);
            } else if let Some((interior, _)) = self.scene.materials[material].interface() {
                let index = |i: usize| self.scene.interiors[i].ior.eval(WAVELENGTH);
                let eta = index(interior) / index(0);
                on.dir = refract(-ray.dir, normal, if enters { eta } else { 1.0 / eta }).unwrap_or(reflect(-ray.dir, normal));
            }
            ray = on;
        }
    }

    /// Looks from a place at the lamps.
    fn light_up(&mut self, from: &Ray) {
        for lamp in 0..self.lamps.len() {
            let way = match self.lamps[lamp] {
                Lamp::At(place) => place - from.origin,
                Lamp::Towards(direction) => direction,
            };
            let reach = if let Lamp::At(_) = self.lamps[lamp] { way.length() } else { f64::INFINITY };
            let Some(dir) = way.try_normalize() else { continue };
            let mut ray = Ray { dir, ..from.clone() };
            for _ in 0..MOST_SURFACES {
                let Some((hit, on)) = self.next(&ray) else { break };
                let material = self.scene.bounding_part(self.scene.shapes[hit.shape].material);
                if self.scene.materials[material].is_opaque() || hit.p.distance(from.origin) > reach {
                    break;
                }
                ray = on;
            }
        }
    }
}
