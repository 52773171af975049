//! Small scenes.

use abbe::scene::*;
use abbe::spectrum::{Formula, Ior, Spectrum};
use glam::{DMat3, DVec3, dvec3};
use std::f64::consts::PI;
use std::sync::Arc;

pub fn flat(v: f64) -> Spectrum {
    Spectrum::Constant(v)
}

/// Linear from `a` at 400 nm to `b` at 700 nm.
pub fn ramp(a: f64, b: f64) -> Spectrum {
    Spectrum::Table { nm: vec![400.0, 700.0], values: vec![a, b], extend: true }
}

/// A strongly dispersive index.
pub fn flint() -> Ior {
    Ior::new(Formula::Cauchy { coef_um: vec![1.6, 0.03] })
}

pub fn air() -> Interior {
    solid("surroundings", 1.0, 0)
}

pub fn solid(name: &str, n: f64, priority: u8) -> Interior {
    Interior { name: name.into(), ior: Ior::constant(n), sigma_a: flat(0.0), sigma_s: flat(0.0), g: 0.0, priority, depth: 0 }
}

pub fn scene(width: u32, height: u32, count: u32, sensor: Sensor) -> Scene {
    Scene {
        name: "test".into(),
        film: FilmSettings::new(width, height, Bins { min_nm: 400.0, max_nm: 700.0, count }),
        sensor,
        materials: vec![Material::Diffuse { reflectance: flat(0.5).into() }],
        thin_films: Default::default(),
        grains: Default::default(),
        included: Default::default(),
        interiors: vec![air()],
        shapes: vec![],
        lenses: Vec::new(),
        lights: vec![],
        max_depth: 64,
        reference: Estimator::Backward,
        notes: vec![],
        warnings: Vec::new(),
        source_hash: 0,
        sources: Vec::new(),
    }
}

/// The lamp of a file, that shines along `direction` from `position`.
pub fn measured_lamp(position: DVec3, direction: DVec3, intensity: Spectrum) -> Light {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scenes");
    let text = format!(
        r#"{{"film": {{"width": 1, "height": 1}}, "camera": {{"orthographic": {{"eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}}}},
            "lights": [{{"spot": {{"position": [{}, {}, {}], "direction": [{}, {}, {}], "profile": "lamp.ies", "rotate_deg": 30}}}}]}}"#,
        position.x, position.y, position.z, direction.x, direction.y, direction.z
    );
    let scene = load_str(&text, std::path::Path::new("lamp.json"), &folder, &LoadOptions::default()).expect("the lamp");
    let Some(Light::Profile { position, axes, profile, .. }) = scene.lights.into_iter().next() else { panic!("no profile") };
    Light::Profile { position, axes, intensity, profile }
}

pub fn look_at(eye: DVec3, target: DVec3) -> DMat3 {
    let z = (eye - target).normalize();
    let up = if z.y.abs() > 0.99 { DVec3::Z } else { DVec3::Y };
    let x = up.cross(z).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

pub fn pinhole(eye: DVec3, target: DVec3, tan_half_vfov: f64) -> Sensor {
    Sensor::Perspective { eye, frame: look_at(eye, target), tan_half_vfov, lens_radius: 0.0, focus_distance: 1.0, optics: None }
}

pub fn orthographic(eye: DVec3, target: DVec3, height: f64) -> Sensor {
    Sensor::Orthographic { eye, frame: look_at(eye, target), height }
}

pub fn material(scene: &mut Scene, m: Material) -> usize {
    scene.materials.push(m);
    scene.materials.len() - 1
}

pub fn shape(scene: &mut Scene, material: usize, geometry: Geometry) {
    scene.shapes.push(Shape { name: String::new(), geometry, material, interior: None, emission: None });
}

pub fn lamp(scene: &mut Scene, geometry: Geometry, radiance: Spectrum) {
    let emission = Some(Emission { radiance: radiance.into(), two_sided: false });
    scene.shapes.push(Shape { name: "lamp".into(), geometry, material: 0, interior: None, emission });
}

pub fn glass(scene: &mut Scene, interior: Interior, alpha: f64) -> usize {
    scene.interiors.push(interior);
    let interior = scene.interiors.len() - 1;
    material(scene, Material::Dielectric { interior, alpha, tint: None, antireflective: false })
}

pub fn sphere(center: DVec3, radius: f64) -> Geometry {
    Geometry::Sphere { center, radius }
}

pub fn disc(center: DVec3, normal: DVec3, radius: f64) -> Geometry {
    Geometry::Disc { center, normal, radius }
}

/// An axis-aligned box with outward normals.
pub fn cuboid(lo: DVec3, hi: DVec3) -> Geometry {
    let corner = |i: u32| dvec3(pick(i & 1, lo.x, hi.x), pick(i & 2, lo.y, hi.y), pick(i & 4, lo.z, hi.z));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Geometry::Mesh(Arc::new(Mesh { positions: (0..8).map(corner).collect(), triangles, ..Mesh::default() }))
}

pub fn pick(bit: u32, zero: f64, one: f64) -> f64 {
    if bit == 0 { zero } else { one }
}

/// A coarse triangulated ball with the normals of the true one.
pub fn smooth_ball(center: DVec3, radius: f64) -> Geometry {
    let (n, m) = (10u32, 6u32);
    let mut mesh = Mesh::default();
    for j in 0..=m {
        for i in 0..n {
            let (theta, phi) = (PI * f64::from(j) / f64::from(m), 2.0 * PI * f64::from(i) / f64::from(n));
            let d = dvec3(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin());
            mesh.positions.push(center + d * radius);
            mesh.normals.push(d);
        }
    }
    for j in 0..m {
        for i in 0..n {
            let (a, b) = (j * n + i, j * n + (i + 1) % n);
            if j > 0 {
                mesh.triangles.push([a, a + n, b]);
            }
            if j < m - 1 {
                mesh.triangles.push([b, a + n, b + n]);
            }
        }
    }
    Geometry::Mesh(Arc::new(mesh))
}

/// A small open room, lit from above, seen from its front.
pub fn room(bins: u32, size: u32) -> Scene {
    let mut s = scene(size, size, bins, pinhole(dvec3(0.0, 1.0, 3.4), dvec3(0.0, 0.6, 0.0), 0.32));
    // Both estimators mean the same by a depth, and a small one saves time.
    s.max_depth = 10;
    s.materials[0] = Material::Diffuse { reflectance: ramp(0.8, 0.4).into() };
    shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 3.0));
    shape(&mut s, 0, disc(dvec3(0.0, 0.0, -1.0), DVec3::Z, 3.0));
    lamp(&mut s, disc(dvec3(0.0, 2.0, 0.2), -DVec3::Y, 0.8), ramp(1.0, 2.0));
    s
}
