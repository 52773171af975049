//! Small scenes, one for each thing that a scene can contain.

use super::textures;
use crate::scenes::*;
use abbe::lens::LensCamera;
use abbe::lens::camera::{Focus, Setting};
use abbe::scene::texture::Spectra;
use abbe::scene::*;
use abbe::spectrum::{Formula, Ior};
use glam::{DMat3, DVec2, DVec3, dvec3};
use std::sync::Arc;

/// A room under a large lamp and a dim sky, which are easy to hit, seen from its front.
pub(super) fn hall(bins: u32) -> Scene {
    let mut s = room(bins, 16);
    s.max_depth = 16;
    s.shapes[2].geometry = disc(dvec3(0.0, 2.2, 0.2), -DVec3::Y, 1.5);
    s.lights.push(Light::Constant { radiance: ramp(0.3, 0.2) });
    s
}

/// The hall with a ball of this material in it.
pub(super) fn ball(bins: u32, make: impl Fn(&mut Scene) -> usize) -> Scene {
    let mut s = hall(bins);
    let m = make(&mut s);
    shape(&mut s, m, sphere(dvec3(0.0, 0.65, 0.2), 0.55));
    s
}

pub(super) fn rough_glass(alpha: f64) -> Scene {
    ball(4, |s| glass(s, Interior { ior: flint(), sigma_a: ramp(0.0, 0.5), ..solid("flint", 1.0, 1) }, alpha))
}

/// A floor seen through a pane that all light to it passes too, under a lamp that is nowhere to be seen: without BSDF-sampled emitter hits only merging finds anything.
pub(super) fn floor_under_glass() -> Scene {
    let mut s = scene(16, 16, 4, pinhole(dvec3(0.0, 2.2, 0.0), DVec3::ZERO, 0.15));
    s.max_depth = 16;
    s.materials[0] = Material::Diffuse { reflectance: ramp(0.8, 0.4).into() };
    shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 3.0));
    let pane = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, pane, cuboid(dvec3(-4.0, 0.25, -4.0), dvec3(4.0, 0.4, 4.0)));
    lamp(&mut s, disc(dvec3(1.2, 1.6, 0.0), dvec3(-0.6, -0.8, 0.0), 0.4), ramp(1.0, 2.0));
    s
}

/// The same with a floor that is a mixture, of which half is not there.
pub(super) fn mixture_under_glass() -> Scene {
    let mut s = floor_under_glass();
    let nothing = material(&mut s, Material::Boundary { interior: None });
    let dark = material(&mut s, Material::Diffuse { reflectance: flat(0.1).into() });
    let veil = material(&mut s, Material::Mix { a: 0, b: nothing, weight: ramp(0.3, 0.6).into() });
    s.shapes[0].material = material(&mut s, Material::Mix { a: dark, b: veil, weight: flat(0.2).into() });
    s
}

pub(super) fn metal_of_a_colour(alpha: f64) -> Scene {
    ball(4, |s| material(s, Material::ColoredConductor { reflectance: ramp(0.3, 0.8).into(), alpha }))
}

pub(super) fn metal(alpha: f64) -> Scene {
    ball(4, |s| material(s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha }))
}

/// Metal balls in water, whose index they see.
pub(super) fn metal_in_water() -> Scene {
    let mut s = hall(4);
    let water = glass(&mut s, Interior { sigma_a: ramp(0.0, 0.3), ..solid("water", 1.33, 1) }, 0.0);
    shape(&mut s, water, cuboid(dvec3(-0.8, 0.05, -0.5), dvec3(0.8, 1.2, 0.8)));
    for (x, alpha) in [(-0.4, 0.0), (0.4, 0.3)] {
        let m = material(&mut s, Material::Conductor { eta: ramp(0.6, 1.2), k: ramp(1.5, 2.5), alpha });
        shape(&mut s, m, sphere(dvec3(x, 0.6, 0.2), 0.35));
    }
    s
}

pub(super) fn pane() -> Scene {
    let mut s = hall(4);
    let pane = material(&mut s, Material::thin_pane(flint()));
    shape(&mut s, pane, disc(dvec3(0.2, 0.7, 0.6), dvec3(0.5, 0.3, 0.8).normalize(), 0.5));
    shape(&mut s, pane, disc(dvec3(-0.4, 0.6, 0.0), dvec3(-0.2, 0.9, 0.3).normalize(), 0.5));
    s
}

pub(super) fn mixture() -> Scene {
    ball(4, |s| {
        let metal = material(s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha: 0.2 });
        let veil = material(s, Material::Boundary { interior: None });
        let veil = material(s, Material::Mix { a: veil, b: 0, weight: ramp(0.7, 0.3).into() });
        material(s, Material::Mix { a: metal, b: veil, weight: ramp(0.2, 0.8).into() })
    })
}

/// Panes that blur and tint: one brushed, one that absorbs, one with a film on its faces of which half is not there; and tinted balls.
pub(super) fn tinted_panes() -> Scene {
    let mut s = hall(4);
    let pane = |alpha, depth| Material::ThinDielectric { ior: flint(), alpha, tint: Some(ramp(0.9, 0.3).into()), depth };
    let blurred = material(&mut s, pane(0.2, flat(0.0)));
    shape(&mut s, blurred, disc(dvec3(0.5, 0.7, 0.6), dvec3(0.4, 0.3, 0.8).normalize(), 0.45));
    let brushed = material(&mut s, pane(0.1, ramp(0.1, 0.5)));
    s.grains.insert(brushed, Grain { strength: 0.7, rotation: 0.6 });
    shape(&mut s, brushed, disc(dvec3(-0.5, 0.8, 0.2), dvec3(-0.3, 0.4, 0.8).normalize(), 0.45));
    let absorbing = material(&mut s, pane(0.0, ramp(0.4, 0.1)));
    shape(&mut s, absorbing, disc(dvec3(0.0, 0.4, 0.9), dvec3(0.0, 0.6, 0.8), 0.3));
    let filmed = material(&mut s, Material::thin_pane(flint()));
    s.thin_films.insert(filmed, ThinFilm { ior: Ior::constant(2.4), thickness_nm: 130.0 });
    let nothing = material(&mut s, Material::NOTHING);
    let filmed = material(&mut s, Material::Mix { a: filmed, b: nothing, weight: flat(0.5).into() });
    shape(&mut s, filmed, disc(dvec3(0.0, 1.2, -0.2), dvec3(0.1, 0.2, 1.0).normalize(), 0.5));
    for (x, alpha) in [(-0.75, 0.0), (0.75, 0.3)] {
        s.interiors.push(solid("tinted", 1.5, 1));
        let interior = s.interiors.len() - 1;
        let mut glass = |antireflective| {
            material(&mut s, Material::Dielectric { interior, alpha, tint: Some(ramp(0.4, 0.9).into()), antireflective })
        };
        let (a, b) = (glass(false), glass(true));
        let ball = material(&mut s, Material::Mix { a, b, weight: ramp(0.2, 0.8).into() });
        shape(&mut s, ball, sphere(dvec3(x, 0.25, 0.4), 0.2));
    }
    s
}

/// Sheets that let light through diffusely: a lampshade, half a sheet, one under lacquer, one under sheen.
pub(super) fn translucent_sheets() -> Scene {
    let mut s = hall(4);
    let sheet = material(&mut s, Material::DiffuseTransmission { transmittance: ramp(0.8, 0.3).into() });
    shape(&mut s, sheet, sphere(dvec3(-0.7, 0.5, 0.2), 0.34));
    let half = material(&mut s, Material::Mix { a: sheet, b: 0, weight: ramp(0.3, 0.8).into() });
    shape(&mut s, half, disc(dvec3(0.1, 1.0, 0.4), dvec3(0.2, 0.3, 0.9).normalize(), 0.4));
    let lacquered = coated(&mut s, half, 0.3);
    shape(&mut s, lacquered, sphere(dvec3(0.7, 0.5, 0.2), 0.34));
    let cloth = material(&mut s, Material::Sheen { base: half, color: ramp(0.9, 0.4), alpha: 0.25 });
    shape(&mut s, cloth, sphere(dvec3(0.0, 0.3, 0.6), 0.25));
    s
}

/// A soap bubble, glass with a film, and rough metal with one.
pub(super) fn films() -> Scene {
    let mut s = hall(4);
    let film = |n: f64, thickness_nm: f64| ThinFilm { ior: Ior::constant(n), thickness_nm };
    let soap = material(&mut s, Material::thin_pane(Ior::constant(1.33)));
    s.thin_films.insert(soap, film(1.33, 350.0));
    shape(&mut s, soap, sphere(dvec3(-0.7, 0.5, 0.2), 0.34));
    let flint = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    s.thin_films.insert(flint, film(2.4, 120.0));
    shape(&mut s, flint, sphere(dvec3(0.0, 0.5, 0.2), 0.34));
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.6, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    s.thin_films.insert(metal, film(1.9, 250.0));
    shape(&mut s, metal, sphere(dvec3(0.7, 0.5, 0.2), 0.34));
    s
}

/// Glass of one index, whose film alone tells wavelengths apart.
pub(super) fn film_on_plain_glass() -> Scene {
    let mut s = hall(4);
    let glass = glass(&mut s, solid("glass", 1.5, 1), 0.0);
    s.thin_films.insert(glass, ThinFilm { ior: Ior::constant(2.4), thickness_nm: 130.0 });
    shape(&mut s, glass, sphere(dvec3(0.0, 0.65, 0.2), 0.55));
    s
}

/// Brushed metal: a ball, a mesh under lacquer, and a wall with a film of which half is as rough in all directions.
pub(super) fn brushed() -> Scene {
    let mut s = hall(4);
    let metal = |s: &mut Scene, alpha: f64| material(s, Material::Conductor { eta: ramp(0.6, 1.2), k: ramp(2.0, 4.0), alpha });
    let ball = metal(&mut s, 0.1);
    s.grains.insert(ball, Grain { strength: 0.8, rotation: 0.6 });
    shape(&mut s, ball, sphere(dvec3(-0.5, 0.45, 0.3), 0.4));
    let mesh = metal(&mut s, 0.05);
    s.grains.insert(mesh, Grain { strength: 0.9, rotation: -1.0 });
    let lacquered = coated(&mut s, mesh, 0.0);
    let (mut whole, wall) = (textures::ball(dvec3(0.5, 0.45, 0.3), 0.4), metal(&mut s, 0.2));
    let Geometry::Mesh(combed) = &mut whole else { unreachable!("a mesh") };
    Arc::make_mut(combed).comb();
    shape(&mut s, lacquered, whole);
    s.grains.insert(wall, Grain { strength: 0.7, rotation: 0.3 });
    s.thin_films.insert(wall, ThinFilm { ior: Ior::constant(1.9), thickness_nm: 250.0 });
    let plain = metal(&mut s, 0.3);
    let wall = material(&mut s, Material::Mix { a: wall, b: plain, weight: flat(0.5).into() });
    let mut quad = textures::quad(dvec3(-1.0, 0.0, -0.4), dvec3(2.0, 0.3, 0.0), dvec3(-0.4, 1.6, 0.0));
    let Geometry::Mesh(combed) = &mut quad else { unreachable!("a mesh") };
    Arc::make_mut(combed).comb();
    shape(&mut s, wall, quad);
    s
}

/// Cloth: over paint, over rough metal in part, and over lacquered metal.
pub(super) fn sheens() -> Scene {
    let mut s = hall(4);
    let sheen = |s: &mut Scene, base, alpha| material(s, Material::Sheen { base, color: ramp(0.9, 0.4), alpha });
    let paint = sheen(&mut s, 0, 0.25);
    shape(&mut s, paint, sphere(dvec3(-0.7, 0.5, 0.2), 0.34));
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.6, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    let part = material(&mut s, Material::Mix { a: metal, b: 0, weight: ramp(0.2, 0.8).into() });
    let narrow = sheen(&mut s, part, 0.02);
    shape(&mut s, narrow, sphere(dvec3(0.0, 0.5, 0.2), 0.34));
    let lacquered = coated(&mut s, metal, 0.0);
    let wide = sheen(&mut s, lacquered, 0.8);
    shape(&mut s, wide, sphere(dvec3(0.7, 0.5, 0.2), 0.34));
    s
}

/// A cloth under a pane that all light to it passes, as of the floor under glass: only merging finds anything without BSDF-sampled emitter hits.
pub(super) fn cloth_under_glass() -> Scene {
    let mut s = floor_under_glass();
    s.shapes[0].material = material(&mut s, Material::Sheen { base: 0, color: ramp(0.5, 1.0), alpha: 0.5 });
    s
}

pub(super) fn coated(s: &mut Scene, base: usize, alpha: f64) -> usize {
    material(s, Material::Coated { base, ior: flint(), alpha, seen: false, normals: CoatNormals::OfBase })
}

pub(super) fn coated_paint(alpha: f64) -> Scene {
    ball(4, |s| coated(s, 0, alpha))
}

/// Smooth lacquer on rough metal, rough lacquer on a mirror, and on a mixture of metal and paint.
pub(super) fn coated_metals() -> Scene {
    let mut s = hall(4);
    for (x, metal, lacquer, paint) in [(-0.7, 0.3, 0.0, 0.0), (0.0, 0.0, 0.2, 0.0), (0.7, 0.3, 0.1, 0.5)] {
        let metal = material(&mut s, Material::Conductor { eta: ramp(0.6, 1.2), k: ramp(2.0, 4.0), alpha: metal });
        let base = material(&mut s, Material::Mix { a: 0, b: metal, weight: flat(paint).into() });
        let m = coated(&mut s, base, lacquer);
        shape(&mut s, m, sphere(dvec3(x, 0.5, 0.2), 0.34));
    }
    s
}

/// A caustic on a floor with satin lacquer.
pub(super) fn caustic_on_coat() -> Scene {
    let mut s = point();
    s.shapes[0].material = coated(&mut s, 0, 0.5);
    s
}

/// A caustic that lacquer on dark paint throws: nothing else is lit.
pub(super) fn caustic_off_coat() -> Scene {
    let (position, target) = (dvec3(0.9, 1.2, 0.2), dvec3(-0.9, 0.8, 0.2));
    let direction = (target - position).normalize();
    let mut s = lit_by(vec![Light::Spot {
        position,
        direction,
        intensity: ramp(1.0, 2.0),
        cos_inner: 0.97,
        cos_outer: 0.95,
        falloff: Falloff::Squared,
    }]);
    s.shapes.truncate(2);
    let dark = material(&mut s, Material::Diffuse { reflectance: flat(0.02).into() });
    let lacquer = coated(&mut s, dark, 0.0);
    shape(&mut s, lacquer, disc(target, dvec3(0.968, -0.251, 0.0).normalize(), 0.4));
    s
}

/// A bubble in glass in water, and two glasses that overlap.
pub(super) fn nested() -> Scene {
    let mut s = hall(4);
    let water = glass(&mut s, Interior { sigma_a: ramp(0.5, 0.1), ..solid("water", 1.33, 1) }, 0.0);
    let flint_ = glass(&mut s, Interior { ior: flint(), sigma_a: ramp(0.1, 0.6), ..solid("flint", 1.0, 2) }, 0.0);
    let bubble = glass(&mut s, solid("bubble", 1.0, 3), 0.0);
    let crown = glass(&mut s, solid("crown", 1.5, 2), 0.0);
    shape(&mut s, water, sphere(dvec3(0.0, 0.7, 0.1), 0.65));
    shape(&mut s, flint_, sphere(dvec3(0.2, 0.8, 0.2), 0.4));
    shape(&mut s, bubble, sphere(dvec3(0.1, 0.7, 0.35), 0.2));
    shape(&mut s, crown, sphere(dvec3(-0.25, 0.6, 0.2), 0.3));
    s
}

/// A block of glass seen from its front: a mixture and a lacquered mixture stand against its back and another within it, with a face in its face each.
pub(super) fn composites_on_glass() -> Scene {
    let mut s = hall(4);
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.6, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    let dark = material(&mut s, Material::Diffuse { reflectance: ramp(0.02, 0.1).into() });
    let mixed = material(&mut s, Material::Mix { a: metal, b: dark, weight: ramp(0.2, 0.8).into() });
    let lacquered = coated(&mut s, mixed, 0.0);
    let block = glass(&mut s, Interior { ior: flint(), sigma_a: ramp(0.1, 0.5), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, block, cuboid(dvec3(-0.9, 0.05, 0.3), dvec3(0.9, 1.2, 0.6)));
    shape(&mut s, mixed, cuboid(dvec3(-0.85, 0.1, -0.2), dvec3(-0.05, 1.1, 0.3)));
    shape(&mut s, lacquered, cuboid(dvec3(0.05, 0.1, -0.2), dvec3(0.85, 1.1, 0.3)));
    shape(&mut s, mixed, cuboid(dvec3(-0.04, 0.3, 0.3), dvec3(0.04, 0.9, 0.45)));
    s
}

/// The same with solids that are glass in part.
pub(super) fn dirty_glass_on_glass() -> Scene {
    let mut s = hall(4);
    let block = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    let crown = glass(&mut s, solid("crown", 1.5, 2), 0.0);
    let dirty = material(&mut s, Material::Mix { a: crown, b: 0, weight: ramp(0.9, 0.5).into() });
    shape(&mut s, block, cuboid(dvec3(-0.8, 0.1, -0.3), dvec3(0.8, 0.5, 0.7)));
    shape(&mut s, dirty, cuboid(dvec3(-0.6, 0.5, -0.1), dvec3(-0.1, 0.9, 0.4)));
    shape(&mut s, dirty, cuboid(dvec3(0.1, 0.1, 0.0), dvec3(0.5, 0.3, 0.4)));
    s
}

pub(super) fn absorbing() -> Scene {
    ball(4, |s| glass(s, Interior { sigma_a: ramp(2.0, 0.2), ..solid("green", 1.5, 1) }, 0.0))
}

pub(super) fn haze() -> Scene {
    let mut s = hall(4);
    s.interiors.push(Interior { sigma_a: flat(0.05), sigma_s: ramp(0.2, 1.0), g: 0.6, ..solid("haze", 1.0, 0) });
    let haze = material(&mut s, Material::Boundary { interior: Some(1) });
    shape(&mut s, haze, sphere(dvec3(0.0, 0.5, 0.0), 1.5));
    s.interiors.push(Interior { sigma_s: ramp(3.0, 1.0), sigma_a: ramp(0.0, 0.3), g: -0.3, ..solid("cloud", 1.0, 1) });
    let cloud = material(&mut s, Material::Boundary { interior: Some(2) });
    shape(&mut s, cloud, sphere(dvec3(-0.4, 0.8, 0.3), 0.5));
    let milky = Interior { sigma_s: ramp(0.5, 2.0), g: 0.2, ..solid("milk", 1.4, 2) };
    let milk = glass(&mut s, milky, 0.0);
    shape(&mut s, milk, sphere(dvec3(0.5, 0.5, 0.4), 0.35));
    s
}

pub(super) fn fog_everywhere() -> Scene {
    let mut s = ball(4, |s| glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0));
    s.interiors[0] = Interior { sigma_s: ramp(0.1, 0.3), sigma_a: flat(0.02), g: 0.3, ..air() };
    s.lights.clear();
    // No camera: joining light to it from fog right before it has no finite variance.
    s.sensor = Sensor::IrradiancePlane { origin: dvec3(-0.8, 0.05, 0.9), edge_u: DVec3::X * 1.6, edge_v: DVec3::Z * -1.6 };
    s
}

/// Lights without size, seen by the forward estimator; nothing smooth is in view but over it.
pub(super) fn lit_by(lights: Vec<Light>) -> Scene {
    let mut s = room(4, 16);
    s.reference = Estimator::Forward;
    s.shapes.truncate(2);
    s.lights = lights;
    let m = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, m, sphere(dvec3(0.0, 1.3, 0.2), 0.35));
    s.sensor = pinhole(dvec3(0.0, 0.6, 2.2), dvec3(0.0, 0.0, 0.2), 0.25);
    s
}

pub(super) fn point() -> Scene {
    lit_by(vec![Light::Point { position: dvec3(0.3, 2.2, 0.4), intensity: ramp(1.0, 2.0) }])
}

pub(super) fn spot() -> Scene {
    let (position, target) = (dvec3(0.3, 2.4, 0.4), dvec3(0.0, 1.2, 0.2));
    let direction = (target - position).normalize();
    lit_by(vec![Light::Spot {
        position,
        direction,
        intensity: ramp(1.0, 2.0),
        cos_inner: 0.95,
        cos_outer: 0.8,
        falloff: Falloff::Smooth,
    }])
}

pub(super) fn measured_lamps() -> Scene {
    let (position, target) = (dvec3(0.3, 2.4, 0.4), dvec3(0.1, 1.2, 0.2));
    lit_by(vec![
        measured_lamp(position, (target - position).normalize(), ramp(1.0, 2.0)),
        measured_lamp(dvec3(-0.5, 1.0, 0.3), dvec3(0.6, 0.1, 0.0).normalize(), ramp(0.5, 0.2)),
    ])
}

pub(super) fn beam() -> Scene {
    let origin = dvec3(0.1, 3.0, 0.2);
    lit_by(vec![Light::Beam { origin, direction: -DVec3::Y, radius: 0.5, irradiance: ramp(1.0, 2.0) }])
}

pub(super) fn parallel_sun() -> Scene {
    lit_by(vec![Light::Sun { direction: dvec3(0.1, -1.0, -0.1).normalize(), cos_angle: 1.0, irradiance: ramp(1.0, 2.0) }])
}

pub(super) fn sky() -> Scene {
    let mut s = ball(4, |s| glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0));
    s.shapes.remove(2);
    s.lights = vec![Light::Constant { radiance: ramp(0.5, 0.2) }];
    let direction = dvec3(-0.3, -1.0, -0.4).normalize();
    s.lights.push(Light::Sun { direction, cos_angle: 0.8, irradiance: ramp(1.0, 2.0) });
    let texels = EnvironmentTexels::Colors((0..32).map(|i| [0.0, 0.5, -0.3, 0.1 * (i % 7) as f32]).collect());
    let to_local = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.3);
    s.lights.push(Light::Image(Arc::new(EnvironmentMap { width: 8, height: 4, texels, illuminant: ramp(1.0, 0.5), to_local })));
    s
}

/// Under a picture of spectra, in bins of their own, that end before the film does.
pub(super) fn measured_sky() -> Scene {
    let mut s = sky();
    s.lights.truncate(1);
    let edges = vec![420.0, 470.0, 500.0, 560.0, 640.0, 690.0];
    let values = (0..32 * 5).map(|i| 0.1 * (i * 5 % 13) as f32).collect();
    let texels = EnvironmentTexels::Spectra(Arc::new(Spectra::new(edges, values)));
    let to_local = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.3);
    s.lights.push(Light::Image(Arc::new(EnvironmentMap { width: 8, height: 4, texels, illuminant: ramp(1.0, 0.5), to_local })));
    s
}

/// Lamps of every shape, some that shine on both sides.
pub(super) fn lamps() -> Scene {
    let mut s = hall(4);
    s.shapes.remove(2);
    s.lights.clear();
    lamp(&mut s, sphere(dvec3(-1.0, 1.3, 0.3), 0.45), ramp(1.0, 2.0));
    lamp(&mut s, Geometry::Cylinder { base: dvec3(0.4, 1.8, 0.2), axis: DVec3::X, length: 1.0, radius: 0.3 }, ramp(2.0, 1.0));
    lamp(&mut s, disc(dvec3(0.0, 1.6, 0.0), dvec3(0.3, -0.9, 0.2).normalize(), 0.5), ramp(0.5, 1.0));
    lamp(&mut s, cuboid(dvec3(0.6, 0.2, 0.0), dvec3(1.0, 0.6, 0.4)), ramp(1.0, 0.5));
    let both = Some(Emission { radiance: ramp(1.0, 1.5).into(), two_sided: true });
    let geometry = disc(dvec3(-0.2, 0.7, -0.3), dvec3(0.9, 0.1, 0.4).normalize(), 0.5);
    s.shapes.push(Shape { name: "both".into(), geometry, material: 0, interior: None, emission: both.clone() });
    // A tube is open: its inside is seen.
    let geometry = Geometry::Cylinder { base: dvec3(-0.9, 0.1, 0.6), axis: DVec3::Y, length: 0.5, radius: 0.25 };
    s.shapes.push(Shape { name: "tube".into(), geometry, material: 0, interior: None, emission: both });
    let m = material(&mut s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha: 0.0 });
    shape(&mut s, m, sphere(dvec3(0.2, 0.35, 0.7), 0.3));
    s
}

pub(super) fn seen_by(sensor: Sensor) -> Scene {
    let mut s = ball(4, |s| glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0));
    s.sensor = sensor;
    s
}

/// The room as a double Gauss sees it, out of focus at the sides, with an asphere before it, in glass that absorbs; caustics of a ball are in the picture.
pub(super) fn lens_of_surfaces() -> Scene {
    let mut s = seen_by(pinhole(dvec3(0.0, 1.0, 3.4), dvec3(0.0, 0.6, 0.0), 0.32));
    let mut lens = load_lens("gauss", None).expect("a lens that ships");
    lens.surfaces[0].aspheric = vec![0.0, 300.0];
    for surface in &mut lens.surfaces {
        if let Some(glass) = &mut surface.glass {
            glass.absorption = Some(ramp(20.0, 5.0));
        }
    }
    let setting = Setting {
        film: DVec2::splat(0.03),
        focus: Focus::At(2.5),
        f_number: None,
        range_nm: (s.film.bins.min_nm, s.film.bins.max_nm),
    };
    let camera = LensCamera::new(lens, &setting).expect("a camera");
    if let Sensor::Perspective { optics, .. } = &mut s.sensor {
        *optics = Some(Arc::new(camera));
    }
    s.film.filter = Filter::Tent { radius: 1.0 };
    s
}

pub(super) fn lens() -> Scene {
    let mut s = seen_by(pinhole(dvec3(0.0, 1.0, 3.4), dvec3(0.0, 0.6, 0.0), 0.32));
    if let Sensor::Perspective { lens_radius, focus_distance, .. } = &mut s.sensor {
        (*lens_radius, *focus_distance) = (0.15, 2.5);
    }
    s.film.filter = Filter::Tent { radius: 1.0 };
    s
}

pub(super) fn orthographic_view() -> Scene {
    let mut s = seen_by(orthographic(dvec3(0.5, 1.6, 3.0), dvec3(0.0, 0.5, 0.0), 1.6));
    s.film.filter = Filter::Gaussian { sigma: 0.5 };
    s
}

pub(super) fn irradiance_plane() -> Scene {
    seen_by(Sensor::IrradiancePlane { origin: dvec3(-0.8, 0.05, 0.9), edge_u: DVec3::X * 1.6, edge_v: dvec3(0.2, 0.0, -1.6) })
}

pub(super) fn irradiance_sphere() -> Scene {
    seen_by(Sensor::IrradianceSphere { center: dvec3(0.1, 1.0, 0.2), radius: 1.05 })
}

pub(super) fn under_water() -> Scene {
    let mut s = hall(4);
    let water = glass(&mut s, Interior { sigma_a: ramp(0.1, 0.4), ior: flint(), ..solid("water", 1.33, 1) }, 0.0);
    shape(&mut s, water, disc(dvec3(0.0, 1.2, 0.0), DVec3::Y, 2.0));
    s.lights.clear();
    s.sensor = pinhole(dvec3(0.0, 0.8, 1.2), dvec3(0.0, 0.0, 0.0), 0.4);
    s
}

/// A coarse ball with the normals of a round one, in this material.
pub(super) fn smooth_normals(make: impl Fn(&mut Scene) -> usize) -> Scene {
    let mut s = hall(4);
    let m = make(&mut s);
    shape(&mut s, m, smooth_ball(dvec3(0.0, 0.65, 0.2), 0.55));
    s
}

pub(super) fn bins(count: u32) -> Scene {
    ball(count, |s| glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0))
}

pub(super) fn sellmeier_glass() -> Ior {
    Ior::new(Formula::Cauchy { coef_um: vec![1.4, 0.005] })
}

/// Dispersive water in a dispersive room: matched indices on both sides of a face inside it.
pub(super) fn matched() -> Scene {
    let mut s = hall(4);
    for (x, priority) in [(-0.3, 1), (0.3, 2)] {
        let m = glass(&mut s, Interior { ior: sellmeier_glass(), ..solid("water", 1.0, priority) }, 0.0);
        shape(&mut s, m, sphere(dvec3(x, 0.65, 0.2), 0.45));
    }
    s
}
