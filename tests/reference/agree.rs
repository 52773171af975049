//! Backward against forward: two estimators that share no way of finding a path.

use crate::estimates::agree;
use crate::scenes::*;
use abbe::scene::initial_interiors;
use abbe::scene::*;
use abbe::spectrum::Ior;
use glam::{DMat3, DVec3, dvec2, dvec3};
use std::sync::Arc;

#[test]
fn backward_and_forward_agree_on_a_caustic_of_dispersive_glass() {
    let mut s = room(3, 4);
    // The ball is over the camera's view: its light is seen on the floor, not the ball itself, which no forward path could join.
    let m = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, m, sphere(dvec3(0.0, 1.1, 0.3), 0.4));
    s.sensor = pinhole(dvec3(0.0, 0.5, 2.0), dvec3(0.0, 0.0, 0.3), 0.25);
    s.film.filter = Filter::Tent { radius: 1.0 };
    agree("caustic", &s, 260, 1400);
}

#[test]
fn backward_and_forward_agree_on_rough_surfaces_through_a_pane_and_a_lens() {
    let mut s = room(2, 4);
    // A pane counts as an event where a path is sampled through it, not where it is connected through it.
    s.max_depth = 64;
    let frosted = glass(&mut s, Interior { ior: flint(), sigma_a: ramp(0.0, 1.0), ..solid("flint", 1.0, 1) }, 0.4);
    shape(&mut s, frosted, sphere(dvec3(-0.45, 0.5, 0.0), 0.45));
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    let mixed = material(&mut s, Material::Mix { a: metal, b: 0, weight: ramp(0.2, 0.8).into() });
    shape(&mut s, mixed, sphere(dvec3(0.5, 0.5, 0.2), 0.4));
    let veil = material(&mut s, Material::Boundary { interior: None });
    let veil = material(&mut s, Material::Mix { a: veil, b: 0, weight: ramp(0.9, 0.5).into() });
    shape(&mut s, veil, disc(dvec3(0.2, 0.6, 1.0), dvec3(0.0, 0.6, 0.8), 0.5));
    let pane = material(&mut s, Material::thin_pane(flint()));
    shape(&mut s, pane, disc(dvec3(0.0, 1.0, 2.6), dvec3(0.6, 0.0, 0.8), 0.8));
    if let Sensor::Perspective { lens_radius, focus_distance, .. } = &mut s.sensor {
        (*lens_radius, *focus_distance) = (0.1, 3.0);
    }
    s.film.filter = Filter::Gaussian { sigma: 0.5 };
    agree("rough", &s, 700, 1000);
}

#[test]
fn backward_and_forward_agree_in_fog() {
    let mut s = room(3, 4);
    // Clear around the camera: joining light to it from fog right before it has no finite variance.
    s.interiors.push(Interior { sigma_a: flat(0.05), sigma_s: ramp(0.1, 0.5), g: 0.6, ..solid("haze", 1.0, 0) });
    let haze = material(&mut s, Material::Boundary { interior: Some(1) });
    shape(&mut s, haze, sphere(dvec3(0.0, 0.5, 0.0), 1.5));
    let cloud = Interior { sigma_s: ramp(1.5, 0.5), sigma_a: ramp(0.0, 0.3), g: -0.3, ..solid("cloud", 1.0, 1) };
    s.interiors.push(cloud);
    let m = material(&mut s, Material::Boundary { interior: Some(2) });
    shape(&mut s, m, sphere(dvec3(0.3, 0.8, 0.3), 0.6));
    agree("fog", &s, 480, 700);
}

#[test]
#[ignore = "long: in tools/soak"]
fn backward_and_forward_agree_under_water() {
    // The camera is in the water; light comes in through a wavy-less, open sheet, so radiance is scaled and flux is not.
    let mut s = room(2, 4);
    let water = glass(&mut s, Interior { sigma_a: ramp(0.1, 0.4), ..solid("water", 1.33, 1) }, 0.0);
    shape(&mut s, water, disc(dvec3(0.0, 1.2, 0.0), DVec3::Y, 100.0));
    s.sensor = pinhole(dvec3(0.0, 0.8, 1.2), dvec3(0.0, 0.0, 0.0), 0.25);
    assert_eq!(initial_interiors(&s, &[dvec3(0.0, 0.8, 1.2)]), [vec![1]]);
    agree("under water", &s, 450, 1500);
    s.sensor = Sensor::IrradiancePlane { origin: dvec3(-0.4, 0.3, 0.4), edge_u: DVec3::X * 0.8, edge_v: DVec3::Z * -0.8 };
    agree("irradiance under water", &s, 300, 1500);
}

#[test]
fn backward_and_forward_agree_with_shading_normals() {
    let mut s = room(2, 4);
    shape(&mut s, 0, smooth_ball(dvec3(-0.4, 0.6, 0.0), 0.5));
    let metal = material(&mut s, Material::Conductor { eta: flat(0.5), k: flat(3.0), alpha: 0.5 });
    // A flat tile whose normals all lean: nothing averages out.
    let positions = vec![dvec3(0.1, 0.3, 0.3), dvec3(1.0, 0.3, 0.3), dvec3(1.0, 0.8, -0.4), dvec3(0.1, 0.8, -0.4)];
    let (normals, triangles) = (vec![dvec3(0.5, 0.3, 0.9).normalize(); 4], vec![[0, 1, 2], [0, 2, 3]]);
    shape(&mut s, metal, Geometry::Mesh(Arc::new(Mesh { positions, normals, triangles, ..Mesh::default() })));
    s.sensor = orthographic(dvec3(0.0, 1.2, 3.0), dvec3(0.0, 0.6, 0.0), 1.6);
    agree("shading normals", &s, 600, 1600);
}

#[test]
#[ignore = "long: in tools/soak"]
fn backward_and_forward_agree_where_shading_normals_contradict_the_geometry() {
    let mut s = room(2, 4);
    let paint = material(&mut s, Material::Diffuse { reflectance: flat(0.8).into() });
    let metal = material(&mut s, Material::Conductor { eta: flat(0.5), k: flat(3.0), alpha: 0.6 });
    // A coat that leans elsewhere again.
    let stored = Arc::new(texture::Packed::new(4, vec![205, 90, 220, 0]));
    let image = Arc::new(texture::Image { width: 1, height: 1, texels: texture::Texels::Vectors { stored, scale: 1.0 } });
    let to_image = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let (wrap, factor) = ([texture::Wrap::Repeat; 2], flat(1.0));
    let map = texture::ImageTexture { image, wrap, nearest: false, to_image, factor, cutoff: None, set: 0, tinted: false };
    let normals = CoatNormals::Mapped(Arc::new(map));
    let coated = material(&mut s, Material::Coated { base: paint, ior: flint(), alpha: 0.5, seen: false, normals });
    let sheen = material(&mut s, Material::Sheen { base: paint, color: flat(0.8), alpha: 0.5 });
    // Tiles whose normals lean away from the camera, and some from the light.
    let leaning = [dvec3(0.9, 0.2, 0.35), dvec3(-0.9, 0.1, 0.4), dvec3(0.1, -0.9, 0.3), dvec3(0.2, 0.9, 0.2)];
    for (i, (m, n)) in [paint, metal, coated, sheen].into_iter().zip(leaning).enumerate() {
        let x = 0.5 * i as f64 - 1.0;
        let positions = vec![dvec3(x, 0.2, 0.0), dvec3(x + 0.5, 0.2, 0.0), dvec3(x + 0.5, 1.0, -0.3), dvec3(x, 1.0, -0.3)];
        let (normals, triangles) = (vec![n.normalize(); 4], vec![[0, 1, 2], [0, 2, 3]]);
        let uvs = vec![dvec2(0.0, 0.0), dvec2(1.0, 0.0), dvec2(1.0, 1.0), dvec2(0.0, 1.0)];
        shape(&mut s, m, Geometry::Mesh(Arc::new(Mesh { positions, normals, uvs, triangles, ..Mesh::default() })));
    }
    s.sensor = orthographic(dvec3(1.5, 1.2, 2.0), dvec3(0.0, 0.6, 0.0), 1.2);
    agree("contradicting normals", &s, 450, 3000);
}

#[test]
fn backward_and_forward_agree_through_glass_whose_shading_normals_contradict_the_geometry() {
    // And a pane above the camera's view.
    let mut s = room(2, 4);
    let m = glass(&mut s, solid("glass", 1.5, 1), 0.0);
    shape(&mut s, m, smooth_ball(dvec3(-0.4, 1.1, 0.3), 0.4));
    let pane = material(&mut s, Material::thin_pane(Ior::constant(2.5)));
    shape(&mut s, pane, smooth_ball(dvec3(0.5, 1.1, 0.3), 0.3));
    s.sensor = pinhole(dvec3(0.0, 0.5, 2.0), dvec3(0.0, 0.0, 0.3), 0.25);
    agree("light through contradicting normals", &s, 500, 3000);
}

#[test]
fn backward_and_forward_agree_under_the_sky() {
    let mut s = scene(4, 4, 2, pinhole(dvec3(0.0, 1.0, 3.0), dvec3(0.0, 0.5, 0.0), 0.5));
    shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 2.0));
    shape(&mut s, 0, sphere(dvec3(0.2, 0.5, 0.0), 0.5));
    s.lights.push(Light::Constant { radiance: ramp(0.5, 0.2) });
    let direction = dvec3(-0.3, -1.0, -0.4).normalize();
    s.lights.push(Light::Sun { direction, cos_angle: 0.9, irradiance: ramp(1.0, 2.0) });
    let texels = EnvironmentTexels::Colors((0..32).map(|i| [0.0, 0.0, 0.0, 0.1 * (i % 7) as f32]).collect());
    let to_local = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.3);
    s.lights.push(Light::Image(Arc::new(EnvironmentMap { width: 8, height: 4, texels, illuminant: ramp(1.0, 0.5), to_local })));
    agree("sky", &s, 50, 250);
}
