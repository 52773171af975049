//! Many lights, chosen by a grid, give the light that they give when chosen by power.
//!
//! Seen to fail: with the probability of a choice taken from the power of the lights where one is hit by chance.

use super::compare::{BATCHES, Batches, agree, pairs};
use crate::adapter;
use crate::scenes::*;
use abbe::integrator::{Feature, Plan, Techniques};
use abbe::scene::{Falloff, Geometry, Light, Mesh, Scene};
use glam::{DVec3, dvec3};
use std::sync::Arc;

/// A room with glass, under lamps of all kinds that have a place.
fn many() -> Scene {
    let mut s = room(4, 32);
    s.shapes.truncate(2);
    let lens = glass(&mut s, solid("glass", 1.5, 0), 0.0);
    shape(&mut s, lens, sphere(dvec3(0.0, 0.4, 0.3), 0.3));
    for i in 0..100 {
        let (x, z) = (f64::from(i % 10) * 0.5 - 2.2, f64::from(i / 10) * 0.5 - 2.2);
        let (at, radiance) = (dvec3(x, 0.3 + 0.1 * f64::from(i % 3), z), ramp(2.0, f64::from(1 + i % 7)));
        match i % 5 {
            0 => lamp(&mut s, sphere(at, 0.03), radiance),
            1 => lamp(&mut s, disc(at, -DVec3::Y, 0.04), radiance),
            2 => lamp(&mut s, cuboid(at, at + 0.05), radiance),
            3 => s.lights.push(Light::Point { position: at, intensity: radiance.scaled(0.004) }),
            _ => s.lights.push(Light::Spot {
                position: at,
                direction: -DVec3::Y,
                intensity: radiance.scaled(0.004),
                cos_inner: 0.9,
                cos_outer: 0.3,
                falloff: Falloff::Smooth,
            }),
        }
    }
    s.lights.push(Light::Constant { radiance: flat(0.02) });
    s
}

/// A room under a wavy sheet of so many lamps that the grid's entries stand for several.
fn sheet() -> Scene {
    const SIDE: u32 = 60;
    let mut s = room(4, 32);
    s.shapes.truncate(2);
    let corner = |i: u32, j: u32| {
        let (x, z) = (f64::from(i) / f64::from(SIDE) - 0.5, f64::from(j) / f64::from(SIDE) - 0.5);
        dvec3(1.6 * x, 1.0 + 0.1 * (25.0 * x).sin() * (20.0 * z).cos(), 1.6 * z)
    };
    let mut mesh = Mesh::default();
    for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))) {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    lamp(&mut s, Geometry::Mesh(Arc::new(mesh)), ramp(1.0, 3.0));
    s.lights.push(Light::Constant { radiance: flat(0.02) });
    s
}

fn chosen_by_a_grid_or_by_power(name: &str, scene: &Scene) {
    let plan = Plan::new(scene, Techniques::default());
    assert!(plan.has(Feature::LightGrid));
    let render = |plan: Plan, seed: u64, spp: u32| {
        let mut integrator = adapter::with_plan(scene, seed, plan).expect("an adapter for the scene");
        let mut batches = Batches::new(scene);
        (0..BATCHES).for_each(|_| batches.add(&mut integrator, scene, spp));
        batches.figures()
    };
    let (grid, power) = (render(plan.clone(), 1, 6), render(plan.with_lights_by_power(), 2, 10));
    agree(name, &pairs(&grid, &power, 3.0), 0.75);
}

#[test]
fn lights_chosen_by_a_grid_give_what_they_give_when_chosen_by_power() {
    chosen_by_a_grid_or_by_power("many lights", &many());
}

#[test]
fn lights_that_share_an_entry_of_a_grid_give_what_they_give_when_chosen_by_power() {
    chosen_by_a_grid_or_by_power("lights that share an entry", &sheet());
}
