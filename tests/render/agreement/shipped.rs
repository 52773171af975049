//! Every scene that ships. Where its lamp is too small for the backward estimator to hit, the lamp is enlarged on both sides.

use super::compare::gpu_agrees_with_reference;
use abbe::scene::{Estimator, Geometry, LoadOptions, Mesh, Scene, Sensor, load};
use glam::{DVec3, dvec3};
use std::path::Path;
use std::sync::Arc;

/// Few, since the reference follows every wavelength of a dispersed path for itself.
const BINS: u32 = 5;

/// A scene file as 16 x 16 pixels.
pub fn shipped(file: &str, bins: u32) -> Scene {
    let options = LoadOptions { width: Some(16), height: Some(16), channels: Some(bins), ..LoadOptions::default() };
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(file), &options).expect("a scene that ships")
}

/// The scene with another lamp in place of its only one.
fn with_lamp(mut scene: Scene, lamp: Geometry) -> Scene {
    let mut lamps = scene.shapes.iter_mut().filter(|s| s.emission.is_some());
    lamps.next().expect("a lamp").geometry = lamp;
    assert!(lamps.next().is_none(), "a second lamp");
    scene
}

fn sphere(center: [f64; 3], radius: f64) -> Geometry {
    Geometry::Sphere { center: center.into(), radius }
}

fn disc_facing_down(center: [f64; 3], radius: f64) -> Geometry {
    Geometry::Disc { center: center.into(), normal: -DVec3::Y, radius }
}

/// The scene measured by an irradiance sensor in place of its camera. The forward estimator sees every path to it, whatever the size of
/// the lights.
fn measured(mut scene: Scene, origin: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Scene {
    scene.sensor = Sensor::IrradiancePlane { origin: origin.into(), edge_u: edge_u.into(), edge_v: edge_v.into() };
    scene.reference = Estimator::Forward;
    scene
}

/// The floor of the Cornell box.
fn on_the_floor(scene: Scene) -> Scene {
    measured(scene, [-1.0, 1e-3, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])
}

/// The scene of the barrel without its tube, which would hide an enlarged lamp.
fn without_tube(mut scene: Scene) -> Scene {
    let shapes = scene.shapes.len();
    // Nothing else is as black in front of the lamp: it reaches from the ceiling half-way to the prism, 5 cm wide.
    scene
        .shapes
        .retain(|s| !matches!(&s.geometry, Geometry::Mesh(m) if m.positions.iter().all(|p| p.x.abs() < 0.3 && p.y > 1.3)));
    assert_eq!(scene.shapes.len(), shapes - 1, "one tube");
    scene
}

/// A lamp that fills the slit of Newton's experiment, so that much of its light meets the prism.
fn slit() -> Geometry {
    let (corner, along, up) = (dvec3(-0.245, 0.895, -0.1), DVec3::Z * 0.2, DVec3::Y * 0.01);
    let positions = vec![corner, corner + up, corner + up + along, corner + along];
    Geometry::Mesh(Arc::new(Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }))
}

macro_rules! agree {
    ($($(#[$soak:meta])? $name:ident, $spp:expr, $coarseness:expr, $scene:expr;)*) => {
        $(#[test]
        $(#[$soak])?
        fn $name() {
            gpu_agrees_with_reference(stringify!($name), &$scene, $spp, $coarseness);
        })*

        /// Every scene here, by name.
        pub fn all() -> Vec<(&'static str, fn() -> Scene)> {
            vec![$((stringify!($name), || $scene)),*]
        }
    };
}

// Name, samples per pixel in each batch, coarseness of the errors that count, scene.
agree! {
    #[ignore = "long: in tools/soak"] compare_cornell_spheres, 32, 1.0, with_lamp(shipped("compare/cornell_spheres.json", BINS), disc_facing_down([0.0, 1.98, 0.0], 0.9));
    compare_cornell_prism, 32, 1.0, with_lamp(shipped("compare/cornell_prism.json", BINS), disc_facing_down([0.0, 1.98, 0.0], 0.9));
    compare_fog, 72, 1.0, with_lamp(shipped("compare/fog.json", BINS), disc_facing_down([0.0, 1.98, 0.0], 0.9));
    compare_barrel, 96, 1.0, without_tube(with_lamp(shipped("compare/barrel.json", BINS), disc_facing_down([-0.25, 1.9, 0.0], 0.5)));
    #[ignore = "long: in tools/soak"] cornell_spheres, 24, 1.0, with_lamp(shipped("cornell_spheres.json", BINS), disc_facing_down([0.0, 1.98, 0.0], 0.9));
    cornell_spheres_dispersed, 32, 1.0, on_the_floor(shipped("cornell_spheres_dispersed.json", BINS));
    #[ignore = "long: in tools/soak"] prism, 320, 1.0, on_the_floor(shipped("prism.json", BINS));
    #[ignore = "long: in tools/soak"] fog, 48, 1.0, on_the_floor(shipped("fog.json", BINS));
    #[ignore = "long: in tools/soak"] barrel, 176, 1.0, on_the_floor(shipped("barrel.json", BINS));
    #[ignore = "long: in tools/soak"] bunny_light, 96, 1.0, on_the_floor(shipped("bunny_light.json", BINS));
    #[ignore = "long: in tools/soak"] nephroid, 24, 1.0, measured(shipped("nephroid.json", BINS), [-1.0, 1e-3, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    #[ignore = "long: in tools/soak"] newton, 88, 1.0, measured(shipped("newton.json", BINS), [-0.5, 1e-3, 0.5], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    #[ignore = "long: in tools/soak"] compare_newton, 48, 1.0, with_lamp(shipped("compare/newton.json", BINS), slit());
    compare_bunny_light, 96, 1.2, shipped("compare/bunny_light.json", BINS);
    #[ignore = "long: in tools/soak"] compare_nephroid, 176, 1.0, with_lamp(shipped("compare/nephroid.json", BINS), sphere([-7.0, 3.2, 0.0], 2.0));
    #[ignore = "long: in tools/soak"] compare_pool, 208, 3.5, with_lamp(shipped("compare/pool.json", BINS), sphere([3.5, 7.0, -2.0], 2.0));
}
