//! First hits: the GPU against the double-precision reference, and both against what is known.

use super::compare::{BATCHES, BLOCKS, Figure, Pair, agree};
use crate::adapter;
use crate::scenes::*;
use crate::sweep;
use abbe::color::upsample::reflectance_from_linear_srgb;
use abbe::film::aov::{AovBuffers, albedos};
use abbe::reference::ReferenceIntegrator;
use abbe::render::Renderer;
use abbe::scene::*;
use abbe::spectrum::{Ior, LINE_D_NM};
use glam::{DVec3, dvec3};
use std::sync::Arc;

/// What the eight sums are, of the first surfaces and of those behind, and the error of each in the units of one sample that still tells something; single precision is good to a thousandth of
/// that.
const SUMS: [(&str, f64); 8] = [
    ("normal x", 0.004),
    ("normal y", 0.004),
    ("normal z", 0.004),
    ("depth", 0.01),
    ("red", 0.004),
    ("green", 0.004),
    ("blue", 0.004),
    ("hits", 0.004),
];

/// Means of every sum over blocks (and, last, the image), a figure for each from batches of `samples` samples; of the first surfaces, then of those behind.
fn figures(integrator: &mut dyn Renderer, scene: &Scene, samples: u32) -> Vec<[Figure; 16]> {
    let (width, size) = (scene.film.width as usize, (scene.film.width / BLOCKS) as usize);
    let blocks = (BLOCKS * BLOCKS) as usize;
    let mut batch = |index| {
        let mut means = vec![[0.0; 16]; blocks + 1];
        let aovs = integrator.aovs(&albedos(scene), index, samples).expect("AOVs");
        let behind = aovs.behind().expect("glass");
        for (pixel, sums) in aovs.sums().iter().zip(behind.sums()).enumerate() {
            let sums = [*sums.0, *sums.1].concat();
            let block = pixel / width / size * BLOCKS as usize + pixel % width / size;
            for (place, pixels) in [(block, size * size), (blocks, width * width)] {
                let share = 1.0 / (pixels as f64 * f64::from(samples));
                means[place].iter_mut().zip(&sums).for_each(|(mean, sum)| *mean += share * f64::from(*sum));
            }
        }
        means
    };
    let batches: Vec<Vec<[f64; 16]>> = (0..BATCHES).map(&mut batch).collect();
    let figure = |place: usize, i: usize| Figure::of(&batches.iter().map(|b| b[place][i]).collect::<Vec<_>>());
    (0..=blocks).map(|place| std::array::from_fn(|i| figure(place, i))).collect()
}

/// Holds the GPU's AOVs to the reference's, which has twice as many samples.
fn aovs_agree(name: &str, scene: &Scene, samples: u32) {
    let ours = figures(&mut adapter::integrator(scene, 1).expect("an adapter"), scene, samples);
    let theirs = figures(&mut ReferenceIntegrator::new(scene, scene.reference, 7).expect("a scene"), scene, 2 * samples);
    let mut pairs = Vec::new();
    for (place, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
        for (i, (what, small)) in SUMS.into_iter().cycle().take(16).enumerate() {
            // No mean is then near 0, of which an error would be a large share.
            let shifted = |f: Figure, error| Figure { mean: f.mean + 2.0, error, ..f };
            let (ours, theirs) = (shifted(ours[i], ours[i].error.hypot(1e-3 * small)), shifted(theirs[i], theirs[i].error));
            let which = ["first", "behind"][i / 8];
            pairs.push(Pair { what: format!("{which} {what} in block {place}"), ours, theirs, small: small / theirs.mean });
        }
    }
    agree(name, &pairs, 0.9);
}

/// Whatever can stop a ray or let it pass, each of another colour.
fn everything() -> Scene {
    let mut s = scene(16, 16, 4, pinhole(dvec3(0.0, 0.9, 3.4), dvec3(0.0, 0.6, 0.0), 0.4));
    let paint = |s: &mut Scene, rgb| {
        material(s, Material::Diffuse { reflectance: reflectance_from_linear_srgb(rgb).expect("a colour").into() })
    };
    let (red, green) = (paint(&mut s, [0.8, 0.1, 0.05]), paint(&mut s, [0.1, 0.6, 0.2]));
    shape(&mut s, red, disc(DVec3::ZERO, DVec3::Y, 1.3));
    shape(&mut s, green, smooth_ball(dvec3(-0.8, 0.9, -0.3), 0.4));
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    let mixed = material(&mut s, Material::Mix { a: metal, b: green, weight: ramp(0.2, 0.8).into() });
    shape(&mut s, mixed, Geometry::Cylinder { base: dvec3(0.9, 0.0, -0.2), axis: DVec3::Y, length: 1.0, radius: 0.2 });
    // A veil before all of it, water in which a glass stands, and haze that nobody sees.
    let nothing = material(&mut s, Material::Boundary { interior: None });
    let veil = material(&mut s, Material::Mix { a: nothing, b: red, weight: ramp(0.9, 0.5).into() });
    shape(&mut s, veil, disc(dvec3(0.5, 0.9, 1.0), dvec3(0.0, 0.6, 0.8), 0.5));
    let water = glass(&mut s, solid("water", 1.33, 1), 0.0);
    let crown = glass(&mut s, Interior { ior: flint(), ..solid("crown", 1.5, 2) }, 0.2);
    shape(&mut s, crown, cuboid(dvec3(-0.3, 0.0, -0.3), dvec3(0.2, 1.0, 0.3)));
    shape(&mut s, water, cuboid(dvec3(-0.5, 0.0, -0.5), dvec3(0.5, 0.5, 0.5)));
    s.interiors.push(Interior { sigma_s: ramp(3.0, 1.0), ..solid("haze", 1.0, 0) });
    let haze = material(&mut s, Material::Boundary { interior: Some(3) });
    shape(&mut s, haze, sphere(dvec3(0.0, 0.5, 0.0), 1.5));
    let pane = material(&mut s, Material::thin_pane(flint()));
    shape(&mut s, pane, disc(dvec3(-0.7, 0.4, 1.2), DVec3::Z, 0.3));
    // A mirror that leans, and a ball of flint whose facets are smoothed.
    let mirror = material(&mut s, Material::Conductor { eta: flat(1.0), k: flat(5.0), alpha: 0.0 });
    shape(&mut s, mirror, disc(dvec3(0.3, 1.5, -0.6), dvec3(0.0, -0.6, 0.8), 0.4));
    let ball = glass(&mut s, Interior { ior: flint(), ..solid("ball", 1.5, 3) }, 0.0);
    shape(&mut s, ball, smooth_ball(dvec3(0.8, 0.3, 0.7), 0.25));
    s.lights.push(Light::Constant { radiance: flat(1.0) });
    s
}

#[test]
fn aovs_agree_with_the_reference() {
    aovs_agree("pinhole", &everything(), 16);
    let mut lens = everything();
    lens.film.filter = Filter::Gaussian { sigma: 0.6 };
    if let Sensor::Perspective { lens_radius, focus_distance, .. } = &mut lens.sensor {
        (*lens_radius, *focus_distance) = (0.1, 3.0);
    }
    aovs_agree("lens", &lens, 22);
    let mut above = everything();
    above.film.filter = Filter::Tent { radius: 1.0 };
    above.sensor = orthographic(dvec3(0.2, 3.0, 0.3), DVec3::ZERO, 2.0);
    aovs_agree("orthographic", &above, 12);
    if sweep::count(1) == 1 {
        return;
    }
    let mut plane = everything();
    // Before the water, all within the haze.
    plane.sensor = Sensor::IrradiancePlane { origin: dvec3(0.4, 0.1, 0.7), edge_u: DVec3::X * -0.8, edge_v: DVec3::Y * 0.3 };
    aovs_agree("irradiance on a plane", &plane, 32);
    let mut under_water = everything();
    under_water.sensor = pinhole(dvec3(0.4, 0.3, 0.4), dvec3(-0.2, 0.2, 0.0), 0.5);
    aovs_agree("under water", &under_water, 4);
}

/// Both integrators' AOVs of `scene`.
fn both(scene: &Scene) -> [AovBuffers; 2] {
    let albedos = albedos(scene);
    let mut gpu = adapter::integrator(scene, 3).expect("an adapter");
    let mut reference = ReferenceIntegrator::new(scene, scene.reference, 3).expect("a scene");
    [gpu.aovs(&albedos, 0, 16), reference.aovs(&albedos, 0, 16)].map(|f| f.expect("AOVs"))
}

#[test]
fn aovs_are_what_geometry_says() {
    // Seen from z = 7: on the left a slope of 45 degrees that comes nearer to the right, its outward normal away from the sensor; nothing on the right.
    let mut s = scene(2, 1, 4, orthographic(dvec3(0.0, 0.0, 7.0), DVec3::ZERO, 1.0));
    let positions = vec![dvec3(-2.0, -2.0, 1.0), dvec3(0.0, -2.0, 3.0), dvec3(0.0, 2.0, 3.0), dvec3(-2.0, 2.0, 1.0)];
    shape(&mut s, 0, Geometry::Mesh(Arc::new(Mesh { positions, triangles: vec![[2, 1, 0], [3, 2, 0]], ..Mesh::default() })));
    for aovs in both(&s) {
        // Between x = -1 and 0 the slope is at z = 2.5 in the mean; 16 samples are spread evenly on the GPU, at random in the reference.
        assert!((aovs.depth(0) - 4.5).abs() < 0.3, "{}", aovs.depth(0));
        let n = aovs.normal(0).map(f64::from);
        assert!(dvec3(-0.5f64.sqrt(), 0.0, 0.5f64.sqrt()).distance(DVec3::from(n)) < 1e-6, "{n:?}");
        assert_eq!((aovs.depth(1), aovs.normal(1), aovs.albedo(1)), (0.0, [0.0; 3], [0.0; 3]));
    }
    // Half of a pixel is covered: its depth is that of what is there, the others are half.
    let mut half = scene(1, 1, 4, orthographic(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 1.0));
    shape(&mut half, 0, cuboid(dvec3(0.0, -1.0, -1.0), dvec3(1.0, 1.0, 0.0)));
    let [gpu, reference] = both(&half);
    assert!(gpu.behind().is_none() && reference.behind().is_none());
    assert!((gpu.depth(0) - 5.0).abs() < 1e-5, "{}", gpu.depth(0));
    assert_eq!((gpu.normal(0), gpu.albedo(0)), ([0.0, 0.0, 0.5], [0.25; 3]));
}

/// Flat and level, between corners.
fn sheet(lo: DVec3, hi: DVec3) -> Geometry {
    let positions = vec![lo, dvec3(lo.x, lo.y, hi.z), hi, dvec3(hi.x, lo.y, lo.z)];
    Geometry::Mesh(Arc::new(Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }))
}

#[test]
fn what_is_seen_behind_glass_and_in_mirrors_is_where_geometry_says() {
    let bins = |min_nm, max_nm| Bins { min_nm, max_nm, count: 4 };
    glass_and_mirrors_show_what_geometry_says(flint(), bins(400.0, 700.0), LINE_D_NM);
    // Of a film in the infrared, glass that has no index at the d line.
    glass_and_mirrors_show_what_geometry_says(Ior::sellmeier(&[1.5], &[0.49]), bins(900.0, 1000.0), 900.0);
}

/// Of glass of this index, seen by its value at `nm`.
fn glass_and_mirrors_show_what_geometry_says(ior: Ior, bins: Bins, nm: f64) {
    // Narrow lanes side by side in z. Rays come down at 45 degrees, from (-2, 2) to (0, 0), onto a floor of three colours.
    const LANES: u32 = 8;
    let width = 1e-3;
    let mut s = scene(LANES, 1, 4, orthographic(dvec3(-2.0, 2.0, 0.0), DVec3::ZERO, width));
    s.film.bins = bins;
    let paint = |s: &mut Scene, rgb: [f64; 3]| {
        material(s, Material::Diffuse { reflectance: reflectance_from_linear_srgb(rgb).expect("a colour").into() })
    };
    let [blue, red, green, yellow] = [[0.1, 0.2, 0.7], [0.7, 0.1, 0.1], [0.1, 0.6, 0.2], [0.7, 0.6, 0.1]];
    // Box number `lane` from `lo` to `hi` in x and y.
    let lane = |lane: u32, lo: [f64; 2], hi: [f64; 2]| {
        let z = |lane: u32| (f64::from(lane) - f64::from(LANES) / 2.0) * width;
        (dvec3(lo[0], lo[1], z(lane)), dvec3(hi[0], hi[1], z(lane + 1)))
    };
    for (color, from, to) in [(blue, -3.0, -0.6), (red, -0.6, -0.13), (green, -0.13, 3.0)] {
        let color = paint(&mut s, color);
        shape(&mut s, color, sheet(dvec3(from, 0.0, -1.0), dvec3(to, 0.0, 1.0)));
    }
    let smooth = Material::Conductor { eta: flat(1.0), k: flat(5.0), alpha: 0.0 };
    let [mirror, under, pane] =
        [smooth, Material::Diffuse { reflectance: flat(0.2).into() }, Material::thin_pane(flint())].map(|m| material(&mut s, m));
    let coat = |s: &mut Scene, base| {
        let normals = CoatNormals::OfBase;
        material(s, Material::Coated { base, ior: Ior::constant(1.5), alpha: 0.0, seen: false, normals })
    };
    let (coated_mirror, varnish) = (coat(&mut s, mirror), coat(&mut s, under));
    let slab = glass(&mut s, Interior { ior: ior.clone(), ..solid("slab", 1.5, 1) }, 0.0);
    let ceiling = paint(&mut s, yellow);
    // 1: a slab. 2: a pane. 3: a slab whose side is in the way. 4 to 6: mirrors, the last one under nothing. 7: varnish.
    let (lo, hi) = lane(1, [-2.0, 0.5], [2.0, 1.0]);
    shape(&mut s, slab, cuboid(lo, hi));
    let (lo, hi) = lane(2, [-2.0, 1.2], [2.0, 1.2]);
    shape(&mut s, pane, sheet(lo, hi));
    let (lo, hi) = lane(3, [-2.0, 0.5], [-0.9, 1.0]);
    shape(&mut s, slab, cuboid(lo, hi));
    for (number, material) in [(4, mirror), (5, coated_mirror), (6, mirror), (7, varnish)] {
        let (lo, hi) = lane(number, [-2.0, 0.5], [2.0, 0.5]);
        shape(&mut s, material, sheet(lo, hi));
        if number < 6 {
            let (lo, hi) = lane(number, [0.4, 1.5], [0.6, 1.5]);
            shape(&mut s, ceiling, sheet(lo, hi));
        }
    }
    let root = 2f64.sqrt();
    let sine = 0.5f64.sqrt() / ior.eval(nm);
    let in_slab = 0.5 / (1.0 - sine * sine).sqrt();
    // Through the slab a ray arrives at least 0.25 m before where it would, on red; reflected totally at its side, on blue.
    let depths = [2.0 * root, root, 0.8 * root, root, 1.5 * root, 1.5 * root, 1.5 * root, 1.5 * root];
    let (up, down) = ([0.0, 1.0, 0.0], [0.0, -1.0, 0.0]);
    let behind = [
        (2.0 * root, up, green),
        (1.5 * root + in_slab, up, red),
        (2.0 * root, up, green),
        (1.5 * root + in_slab, up, blue),
        (2.5 * root, down, yellow),
        (2.5 * root, down, yellow),
        (0.0, [0.0; 3], [0.0; 3]),
        (1.5 * root, up, [0.2; 3]),
    ];
    let near = |a: [f32; 3], b: [f64; 3]| a.into_iter().zip(b).all(|(a, b)| (f64::from(a) - b).abs() < 1e-3);
    for aovs in both(&s) {
        let beyond = aovs.behind().expect("glass");
        for (lane, (first, (depth, normal, albedo))) in depths.into_iter().zip(behind).enumerate() {
            assert!((f64::from(aovs.depth(lane)) - first).abs() < 1e-3, "{lane}: {} first", aovs.depth(lane));
            assert!(near(aovs.normal(lane), up), "{lane}: {:?} first", aovs.normal(lane));
            assert!((f64::from(beyond.depth(lane)) - depth).abs() < 1e-3, "{lane}: {} in place of {depth}", beyond.depth(lane));
            assert!(near(beyond.normal(lane), normal), "{lane}: {:?}", beyond.normal(lane));
            assert!(near(beyond.albedo(lane), albedo), "{lane}: {:?} in place of {albedo:?}", beyond.albedo(lane));
        }
    }
}

#[test]
fn surfaces_that_touch_or_are_not_there_show_what_is_seen() {
    // From above: glass on a green floor that its lower face touches, and a haze around both.
    let mut s = scene(1, 1, 4, orthographic(dvec3(0.0, 5.0, 0.0), DVec3::ZERO, 1.0));
    let green = [0.1, 0.6, 0.2];
    let floor =
        material(&mut s, Material::Diffuse { reflectance: reflectance_from_linear_srgb(green).expect("a colour").into() });
    shape(&mut s, floor, disc(DVec3::ZERO, DVec3::Y, 4.0));
    let lower = glass(&mut s, solid("glass", 1.5, 1), 0.0);
    shape(&mut s, lower, cuboid(dvec3(-1.0, -1.0, -1.0), dvec3(1.0, 0.0, 1.0)));
    s.interiors.push(Interior { sigma_s: flat(1.0), ..solid("haze", 1.0, 0) });
    let haze = material(&mut s, Material::Boundary { interior: Some(2) });
    shape(&mut s, haze, sphere(DVec3::ZERO, 2.0));
    for aovs in both(&s) {
        assert!((aovs.depth(0) - 5.0).abs() < 1e-5, "{}", aovs.depth(0));
        let albedo = aovs.albedo(0);
        assert!(albedo.iter().zip(green).all(|(a, g)| (f64::from(*a) - g).abs() < 1e-3), "{albedo:?}");
    }
    // Without the floor, the glass.
    s.shapes.remove(0);
    for aovs in both(&s) {
        assert!((aovs.depth(0) - 5.0).abs() < 1e-5 && aovs.albedo(0).iter().all(|a| (a - 1.0).abs() < 1e-6));
    }
}

#[test]
fn what_has_the_index_around_it_is_not_an_aov() {
    // From above, a ball over a floor.
    for (alpha, n, depth) in [(0.0, 1.0, 5.0), (0.3, 1.0, 5.0), (0.3, 1.1, 4.5)] {
        let mut s = scene(1, 1, 4, orthographic(dvec3(0.0, 5.0, 0.0), DVec3::ZERO, 1e-3));
        shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 4.0));
        let ball = glass(&mut s, solid("ball", n, 1), alpha);
        shape(&mut s, ball, sphere(DVec3::ZERO, 0.5));
        for aovs in both(&s) {
            assert!((aovs.depth(0) - depth).abs() < 1e-5, "{n} {alpha}: {}", aovs.depth(0));
        }
    }
}

#[test]
fn albedos_are_the_colours_of_reflectances() {
    let mut s = scene(1, 1, 4, orthographic(DVec3::Z, DVec3::ZERO, 1.0));
    let rgb = [0.7, 0.3, 0.1];
    let paint = material(&mut s, Material::Diffuse { reflectance: reflectance_from_linear_srgb(rgb).expect("a colour").into() });
    let metal = material(&mut s, Material::Conductor { eta: flat(0.5), k: flat(3.0), alpha: 0.2 });
    let crown = glass(&mut s, solid("crown", 1.5, 1), 0.0);
    let pane = material(&mut s, Material::thin_pane(flint()));
    let nothing = material(&mut s, Material::Boundary { interior: None });
    let mixed = material(&mut s, Material::Mix { a: metal, b: paint, weight: flat(0.25).into() });
    let veil = material(&mut s, Material::Mix { a: nothing, b: mixed, weight: flat(0.9).into() });
    let all = albedos(&s);
    let near = |m: usize, rgb: [f64; 3], presence: f64, within: f64| {
        let a = all[m];
        assert!(a.rgb.iter().zip(rgb).all(|(a, b)| (a - b).abs() < within), "{m}: {a:?} is not {rgb:?}");
        assert!((a.presence - presence).abs() < 1e-9, "{m}: {a:?}");
    };
    // ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2).
    let r = (0.25 + 9.0) / (2.25 + 9.0);
    near(0, [0.5; 3], 1.0, 1e-9);
    near(paint, rgb, 1.0, 1e-3);
    near(metal, [r; 3], 1.0, 1e-9);
    near(crown, [1.0; 3], 1.0, 1e-9);
    near(pane, [1.0; 3], 1.0, 1e-9);
    near(nothing, [0.0; 3], 0.0, 1e-9);
    near(mixed, rgb.map(|v| 0.25 * r + 0.75 * v), 1.0, 1e-3);
    near(veil, rgb.map(|v| 0.25 * r + 0.75 * v), 0.1, 1e-3);
}
