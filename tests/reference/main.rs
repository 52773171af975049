//! The double-precision reference against known answers, and its two estimators against each other.

mod agree;
mod bsdf;
mod estimates;
#[path = "../support/random.rs"]
mod random;
#[path = "../support/scenes.rs"]
mod scenes;
mod starts;

use abbe::film::Film;
use abbe::reference::ReferenceIntegrator;
use abbe::render::Integrator;
use abbe::scene::initial_interiors;
use abbe::scene::*;
use abbe::spectrum::Ior;
use estimates::*;
use glam::{DMat3, DVec3, dvec3};
use scenes::*;
use std::f64::consts::PI;
use std::sync::Arc;

fn furnace(fill: impl Fn(&mut Scene)) -> Scene {
    let mut s = scene(4, 4, 3, orthographic(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 2.0));
    s.max_depth = 2000;
    s.lights.push(Light::Constant { radiance: flat(1.0) });
    fill(&mut s);
    s
}

#[test]
fn lossless_smooth_glass_in_uniform_light_cannot_be_seen() {
    let ball = furnace(|s| {
        let m = glass(s, solid("glass", 1.5, 1), 0.0);
        shape(s, m, sphere(DVec3::ZERO, 1.0));
    });
    equals("ball", &ball, Estimator::Backward, 64, 1.0, 1e-9);
    let dispersive = furnace(|s| {
        let m = glass(s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
        shape(s, m, cuboid(dvec3(-0.8, -0.7, -0.6), dvec3(0.7, 0.8, 0.9)));
    });
    equals("dispersive cube", &dispersive, Estimator::Backward, 256, 1.0, 1e-9);
    let nested = furnace(|s| {
        let water = glass(s, solid("water", 1.33, 1), 0.0);
        let glass_ = glass(s, solid("glass", 1.5, 2), 0.0);
        let bubble = glass(s, solid("bubble", 1.0, 3), 0.0);
        shape(s, water, sphere(DVec3::ZERO, 1.0));
        shape(s, glass_, sphere(dvec3(0.3, 0.3, 0.0), 0.6));
        shape(s, bubble, sphere(dvec3(0.1, 0.0, 0.2), 0.3));
    });
    equals("nested", &nested, Estimator::Backward, 64, 1.0, 1e-9);
    let far_away = furnace(|s| {
        let (at, size) = (dvec3(1e5, -1e5, 1e5), 1e-3);
        s.sensor = orthographic(at + dvec3(0.0, 0.0, 100.0), at, 2.0 * size);
        let m = glass(s, solid("glass", 1.5, 1), 0.0);
        shape(s, m, sphere(at, size));
    });
    equals("a millimetre far away", &far_away, Estimator::Backward, 64, 1.0, 1e-9);
}

#[test]
fn lossless_rough_surfaces_in_uniform_light_cannot_be_seen() {
    for alpha in [0.05, 0.3, 1.0] {
        let ball = furnace(|s| {
            let m = glass(s, solid("glass", 1.5, 1), alpha);
            shape(s, m, sphere(DVec3::ZERO, 1.0));
        });
        equals(&format!("rough ball {alpha}"), &ball, Estimator::Backward, 600, 1.0, 1e-3);
        let mirror = furnace(|s| {
            let m = material(s, Material::Conductor { eta: flat(1e-6), k: flat(10.0), alpha });
            shape(s, m, sphere(DVec3::ZERO, 1.0));
        });
        equals(&format!("rough mirror {alpha}"), &mirror, Estimator::Backward, 400, 1.0, 1e-3);
    }
}

#[test]
fn closed_diffuse_box_has_radiance_one() {
    let mut s = scene(2, 2, 2, pinhole(DVec3::splat(0.1), dvec3(1.0, 0.3, -0.2), 1.0));
    lamp(&mut s, cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)), flat(0.5));
    s.shapes[0].emission = Some(Emission { radiance: flat(0.5).into(), two_sided: true });
    equals("box", &s, Estimator::Backward, 700, 1.0, 0.0);
    s.sensor = Sensor::IrradiancePlane { origin: dvec3(-0.95, 0.1, 0.95), edge_u: DVec3::X * 1.9, edge_v: DVec3::Z * -1.9 };
    equals("irradiance in the box", &s, Estimator::Forward, 8000, PI, 0.0);
    s.sensor = Sensor::IrradianceSphere { center: dvec3(-0.02, 0.03, 0.04), radius: 0.9 };
    equals("irradiance on a ball", &s, Estimator::Forward, 4500, PI, 0.0);
    equals("irradiance on a ball", &s, Estimator::Backward, 1000, PI, 0.0);
}

#[test]
fn mixed_walls_reflect_each_wavelength_by_its_own_share() {
    // A closed box whose reflectance is w 0.8 + (1 - w) 0.2 in each bin, w from 0.1 to 0.9: radiance Le / (1 - reflectance).
    let mut s = scene(2, 2, 2, pinhole(DVec3::splat(0.1), dvec3(1.0, 0.3, -0.2), 1.0));
    s.film.sampling = WavelengthSampling::Centres;
    let (bright, dark) =
        (Material::Diffuse { reflectance: flat(0.8).into() }, Material::Diffuse { reflectance: flat(0.2).into() });
    let (a, b) = (material(&mut s, bright), material(&mut s, dark));
    let m = material(&mut s, Material::Mix { a, b, weight: ramp(0.1, 0.9).into() });
    lamp(&mut s, cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)), flat(1.0));
    s.shapes[0].material = m;
    s.shapes[0].emission = Some(Emission { radiance: flat(1.0).into(), two_sided: true });
    let films = batches(&s, Estimator::Backward, 16, 6000);
    for (bin, w) in [0.3, 0.7].into_iter().enumerate() {
        let exact = 1.0 / (1.0 - (w * 0.8 + (1.0 - w) * 0.2));
        let (mean, error) = estimate(&films, image_mean(&s, bin));
        assert!((mean - exact).abs() < 4.5 * error && error < 5e-3 * exact, "bin {bin}: {mean} +- {error}, exact {exact}");
    }
}

#[test]
fn fog_that_only_scatters_cannot_be_seen_in_uniform_light() {
    let fog = furnace(|s| {
        s.interiors.push(Interior { sigma_s: ramp(0.3, 1.5), g: 0.4, ..solid("fog", 1.0, 0) });
        let m = material(s, Material::Boundary { interior: Some(1) });
        shape(s, m, sphere(DVec3::ZERO, 1.0));
    });
    equals("fog", &fog, Estimator::Backward, 3000, 1.0, 0.0);
}

#[test]
fn where_interiors_overlap_the_higher_priority_rules() {
    for (front, back, exact) in [(2, 1, 0.3 + 0.5f64), (1, 2, 0.15 + 1.0), (1, 1, 0.15 + 1.0)] {
        let a = Interior { sigma_a: flat(0.3), ..solid("front", 1.0, front) };
        let b = Interior { sigma_a: flat(1.0), ..solid("back", 1.0, back) };
        let s = slab(&[(0.0, 1.0, 50.0, a), (-0.5, 0.5, 50.0, b)], 0.0);
        equals("overlap", &s, Estimator::Backward, 4, (-exact).exp(), 1e-9);
    }
}

/// Light from a lamp through a stack of slabs at normal incidence.
fn slab(layers: &[(f64, f64, f64, Interior)], alpha: f64) -> Scene {
    let mut s = scene(2, 2, 2, orthographic(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 0.5));
    for (lo, hi, width, interior) in layers {
        let m = glass(&mut s, interior.clone(), alpha);
        shape(&mut s, m, cuboid(dvec3(-width, -width, *lo), dvec3(*width, *width, *hi)));
    }
    lamp(&mut s, disc(dvec3(0.0, 0.0, -2.0), DVec3::Z, 1.0), flat(1.0));
    s.materials[0] = Material::Diffuse { reflectance: flat(0.0).into() };
    s
}

#[test]
fn slabs_transmit_what_they_should() {
    let n: f64 = 1.5168;
    let clear = 2.0 * n / (n * n + 1.0);
    equals("slab", &slab(&[(0.0, 1.0, 50.0, solid("glass", n, 1))], 0.0), Estimator::Backward, 1500, clear, 0.0);
    let absorbing = Interior { sigma_a: flat(0.1), ..solid("glass", n, 1) };
    equals("absorbing slab", &slab(&[(0.0, 1.0, 50.0, absorbing)], 0.0), Estimator::Backward, 1500, 0.831352, 1e-6);
    // Two slabs of one index whose faces coincide, in either order of priority, are one slab.
    for (p, q) in [(1, 2), (2, 1), (1, 1)] {
        let halves = [(0.0, 0.4, 50.0, solid("back", n, p)), (0.4, 1.0, 50.0, solid("front", n, q))];
        equals("slabs in contact", &slab(&halves, 0.0), Estimator::Backward, 1500, clear, 0.0);
    }
    // An index of 1 is not there at all, and a rough surface without an index step is none.
    for alpha in [0.0, 0.5] {
        equals("matched", &slab(&[(0.0, 1.0, 50.0, solid("air", 1.0, 1))], alpha), Estimator::Backward, 4, 1.0, 1e-12);
    }
}

#[test]
fn what_has_the_index_around_it_neither_shades_nor_is_seen() {
    // A spot 3 m above a floor of which the camera sees a square metre, a ball between. The square takes the spot's full intensity from its solid angle.
    let exact = 0.5 / PI * 4.0 * (0.25f64 / 9.25).asin();
    for alpha in [0.0, 0.3] {
        let mut s = scene(2, 2, 2, orthographic(dvec3(0.0, 5.0, 0.0), DVec3::ZERO, 1.0));
        shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 0.8));
        let m = glass(&mut s, solid("ball", 1.0, 1), alpha);
        shape(&mut s, m, sphere(DVec3::Y, 0.5));
        let position = dvec3(0.0, 3.0, 0.0);
        let spot = Light::Spot {
            position,
            direction: -DVec3::Y,
            intensity: flat(1.0),
            cos_inner: 0.97,
            cos_outer: 0.96,
            falloff: Falloff::Smooth,
        };
        s.lights.push(spot);
        equals(&format!("matched ball {alpha}"), &s, Estimator::Forward, 6000, exact, 0.0);
    }
}

#[test]
fn thin_pane_reflects_with_all_inner_bounces() {
    let mut s = slab(&[], 0.0);
    let pane = material(&mut s, Material::thin_pane(Ior::constant(1.5168)));
    shape(&mut s, pane, disc(DVec3::ZERO, DVec3::Z, 10.0));
    let n: f64 = 1.5168;
    equals("pane", &s, Estimator::Backward, 1500, 2.0 * n / (n * n + 1.0), 0.0);
}

/// Flux on a measuring sphere of radius 1 at the origin.
fn flux_of(light: Light) -> f64 {
    let mut s = scene(4, 3, 1, Sensor::IrradianceSphere { center: DVec3::ZERO, radius: 1.0 });
    s.lights.push(light);
    let films = batches(&s, Estimator::Forward, 16, 4000);
    let (mean, error) = estimate(&films, image_mean(&s, 0));
    assert!(error < 5e-3 * mean, "an error of {error} of {mean} is too large to tell anything");
    4.0 * PI * mean
}

#[test]
fn every_light_gives_the_flux_it_should() {
    let close = |name: &str, a: f64, b: f64| assert!((a / b - 1.0).abs() < 0.01, "{name}: {a} is not {b}");
    let (position, toward) = (dvec3(0.0, 0.0, 2.0), -DVec3::Z);
    let cap = 2.0 * PI * (1.0 - 0.75f64.sqrt());
    close("point", flux_of(Light::Point { position, intensity: flat(3.0) }), 3.0 * cap);
    for (falloff, edge) in [(Falloff::Smooth, 0.05 / 2.0), (Falloff::Squared, 0.05 / 3.0)] {
        let (cos_inner, cos_outer) = (0.95, 0.9);
        let spot = Light::Spot { position, direction: toward, intensity: flat(3.0), cos_inner, cos_outer, falloff };
        close("spot", flux_of(spot), 3.0 * 2.0 * PI * (0.05 + edge));
    }
    // The mean of the lamp's intensity over the cap that the ball fills, in even steps.
    let lamp = measured_lamp(position, toward, flat(3.0));
    let Light::Profile { profile, axes, .. } = &lamp else { panic!("no profile") };
    let (mut seen, n) = (0.0, 400);
    for i in 0..n {
        for j in 0..n {
            let (z, phi) =
                (1.0 - (1.0 - 0.75f64.sqrt()) * (f64::from(i) + 0.5) / f64::from(n), 2.0 * PI * f64::from(j) / f64::from(n));
            let (r, frame) = ((1.0 - z * z).sqrt(), toward.any_orthonormal_pair());
            let d = toward * z + frame.0 * (r * phi.cos()) + frame.1 * (r * phi.sin());
            seen += profile.eval(axes.transpose() * d) / f64::from(n * n);
        }
    }
    close("measured lamp", flux_of(lamp), 3.0 * cap * seen);
    let beam = Light::Beam { origin: position, direction: toward, radius: 0.5, irradiance: flat(3.0) };
    close("beam", flux_of(beam), 3.0 * PI * 0.25);
    close("parallel sun", flux_of(Light::Sun { direction: toward, cos_angle: 1.0, irradiance: flat(3.0) }), 3.0 * PI);
    // Irradiance on a plane facing it is L pi sin^2; a ball sees every direction's full cross-section, L times the solid angle.
    let sun = Light::Sun { direction: toward, cos_angle: 0.8, irradiance: flat(3.0) };
    close("sun", flux_of(sun), 3.0 / (PI * 0.36) * 2.0 * PI * 0.2 * PI);
    close("constant", flux_of(Light::Constant { radiance: flat(3.0) }), 3.0 * 4.0 * PI * PI);
    // Upper half of the sky at 2 (sigmoid of 0 is 1/2), lower half dark.
    let texels = EnvironmentTexels::Colors([vec![[0.0, 0.0, 0.0, 4.0]; 16], vec![[0.0; 4]; 16]].concat());
    let map = EnvironmentMap { width: 8, height: 4, texels, illuminant: flat(1.0), to_local: DMat3::IDENTITY };
    close("image", flux_of(Light::Image(Arc::new(map))), 2.0 * 2.0 * PI * PI);
}

#[test]
fn prism_deviates_as_the_book_says() {
    // Minimum deviation of a 60 degree prism with its edge along y, from where a narrow beam lands on a far screen.
    for (n, exact) in [(1.522376, 39.138), (1.516800, 38.647), (1.514322, 38.429)] {
        let (width, far) = (20_000, 1e4);
        let (origin, edge_u) = (dvec3(far, -1.0, -far), DVec3::Z * far);
        let mut s = scene(width, 1, 1, Sensor::IrradiancePlane { origin, edge_u, edge_v: DVec3::Y * 2.0 });
        s.film.sampling = WavelengthSampling::Centres;
        let m = glass(&mut s, solid("glass", n, 1), 0.0);
        // Cross-section: apex at +z, base below; the beam comes from -x and goes down to the base side.
        let (h, y) = (0.75f64.sqrt(), 0.5);
        let section = [(0.0, h - 0.3), (-0.5, -0.3), (0.5, -0.3)];
        let positions: Vec<DVec3> = section.iter().flat_map(|&(x, z)| [dvec3(x, -y, z), dvec3(x, y, z)]).collect();
        let triangles = vec![[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4], [4, 5, 1], [4, 1, 0], [0, 2, 4], [1, 5, 3]];
        shape(&mut s, m, Geometry::Mesh(Arc::new(Mesh { positions, triangles, ..Mesh::default() })));
        // Symmetric passage: inside the light runs along +x, outside it is tilted by half the deviation.
        let tilt = (n * 0.5f64).asin() - PI / 6.0;
        let dir = dvec3(tilt.cos(), 0.0, tilt.sin());
        let face = dvec3(-0.25, 0.0, 0.5 * h - 0.3);
        s.lights.push(Light::Beam { origin: face - dir, direction: dir, radius: 1e-3, irradiance: flat(1.0) });
        let film = &batches(&s, Estimator::Forward, 1, 1)[0];
        let brightest = film.chunks(4).enumerate().max_by(|a, b| a.1[0].total_cmp(&b.1[0])).expect("pixels").0;
        let z = far * ((brightest as f64 + 0.5) / f64::from(width) - 1.0);
        let deviation = (-z / far).atan().to_degrees() + tilt.to_degrees();
        assert!((deviation - exact).abs() < 0.004, "n = {n}: deviation {deviation}, exact {exact}");
    }
}

#[test]
fn ball_lens_focuses_where_it_should() {
    let n = 1.5168;
    let focus = n / (2.0 * (n - 1.0));
    let height = 0.02;
    let landing = |z: f64| {
        let mut s = scene(
            400,
            1,
            1,
            Sensor::IrradiancePlane { origin: dvec3(-0.04, -0.5, -z), edge_u: DVec3::X * 0.08, edge_v: DVec3::Y },
        );
        let m = glass(&mut s, solid("glass", n, 1), 0.0);
        shape(&mut s, m, sphere(DVec3::ZERO, 1.0));
        s.max_depth = 2;
        s.lights.push(Light::Beam { origin: dvec3(height, 0.0, 3.0), direction: -DVec3::Z, radius: 1e-4, irradiance: flat(1.0) });
        let film = &batches(&s, Estimator::Forward, 1, 20)[0];
        let (sum, moment) = film.chunks(4).enumerate().fold((0.0, 0.0), |(s, m), (i, p)| (s + p[0], m + p[0] * (i as f64 + 0.5)));
        -0.04 + 0.08 * moment / sum / 400.0
    };
    // Paraxial, up to spherical aberration of third order in the height.
    assert!(landing(focus).abs() < 2e-4, "{}", landing(focus));
    assert!((landing(0.5 * (1.0 + focus)) - height * (1.0 - 0.5 * (1.0 + focus) / focus)).abs() < 2e-4);
}

#[test]
fn ball_merges_collimated_light_as_computed() {
    // Share of the flux that falls on the ball and lands within rho on the plane 1.5 R behind its centre after two refractions.
    let mut s = scene(
        60,
        60,
        1,
        Sensor::IrradiancePlane { origin: dvec3(-1.2, -1.2, -1.5), edge_u: DVec3::X * 2.4, edge_v: DVec3::Y * 2.4 },
    );
    let m = glass(&mut s, solid("glass", 1.5, 1), 0.0);
    shape(&mut s, m, sphere(DVec3::ZERO, 1.0));
    s.max_depth = 2;
    s.lights.push(Light::Beam { origin: dvec3(0.0, 0.0, 3.0), direction: -DVec3::Z, radius: 1.0, irradiance: flat(1.0) });
    let films = batches(&s, Estimator::Forward, 16, 12);
    let (flux, error) = estimate(&films, |film| {
        let inside = film.chunks(4).enumerate().filter(|(i, _)| {
            let (x, y) = ((i % 60) as f64 - 29.5, (i / 60) as f64 - 29.5);
            x.hypot(y) * 0.04 < 1.0
        });
        inside.map(|(_, p)| p[0] * 0.04 * 0.04).sum::<f64>() / PI
    });
    assert!((flux - 0.79512).abs() < 4.0 * error + 1e-3 && error < 3e-3, "{flux} +- {error}");
}

/// The cases of `abbe validate` whose answers do not depend on the device.
#[test]
fn volumes_are_what_is_inside_them() {
    for case in abbe::validate::all().into_iter().filter(|case| case.id.starts_with("volumes-")) {
        let mut stats = abbe::stats::BatchStats::default();
        let open = |scene: &Scene, seed, _, _| {
            let reference = ReferenceIntegrator::new(scene, Estimator::Backward, seed)?;
            Ok(Box::new(reference) as Box<dyn abbe::render::Renderer>)
        };
        let outcomes = case.run(&open, 1, &mut stats).unwrap();
        let bad: Vec<_> = outcomes.iter().filter(|o| o.verdict != abbe::validate::Verdict::Passed).collect();
        assert!(bad.is_empty() && outcomes.len() >= 8, "{bad:#?}");
    }
}

#[test]
fn interiors_are_counted_from_the_geometry() {
    let mut s = scene(1, 1, 1, pinhole(DVec3::ZERO, DVec3::X, 1.0));
    let outer = glass(&mut s, solid("outer", 1.3, 1), 0.0);
    let inner = glass(&mut s, solid("inner", 1.5, 2), 0.1);
    shape(&mut s, outer, sphere(DVec3::ZERO, 2.0));
    shape(&mut s, inner, cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)));
    shape(&mut s, 0, disc(dvec3(0.0, 1.5, 0.0), DVec3::Y, 5.0));
    let points = [DVec3::ZERO, dvec3(0.0, 1.2, 0.0), dvec3(0.0, -5.0, 0.0), dvec3(0.0, 5.0, 0.0)];
    assert_eq!(initial_interiors(&s, &points), [vec![1, 2], vec![1], vec![], vec![]]);
    // Glass is glass whatever its normals and its roughness.
    let stored = Arc::new(texture::Packed::new(4, vec![128, 128, 255, 0]));
    let texels = texture::Texels::Vectors { stored, scale: 1.0 };
    let image = Arc::new(texture::Image { width: 1, height: 1, texels });
    let to_image = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let (wrap, factor) = ([texture::Wrap::Repeat; 2], flat(1.0));
    let picture =
        Arc::new(texture::ImageTexture { image, wrap, nearest: false, to_image, factor, cutoff: None, set: 0, tinted: false });
    s.shapes[0].material = material(&mut s, Material::NormalMapped { base: outer, normals: picture.clone() });
    s.shapes[1].material =
        material(&mut s, Material::Graded { materials: vec![outer + 1], levels: 5..6, roughness: Texture::Image(picture) });
    assert_eq!(initial_interiors(&s, &points), [vec![1, 2], vec![1], vec![], vec![]]);
}

#[test]
fn same_seed_gives_same_bits_on_any_number_of_threads() {
    let mut s = room(2, 6);
    let m = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.2);
    shape(&mut s, m, sphere(dvec3(0.0, 0.5, 0.0), 0.4));
    for estimator in [Estimator::Backward, Estimator::Forward] {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| batches(&s, estimator, 2, 100))
        };
        let (one, four) = (on(1), on(4));
        assert_eq!(one, four);
        assert_ne!(one[0], one[1], "batches must be independent");
    }
}

#[test]
fn backward_refuses_lights_it_cannot_see() {
    let mut s = room(1, 2);
    s.lights.push(Light::Sun { direction: -DVec3::Y, cos_angle: 1.0, irradiance: flat(1.0) });
    let Err(error) = ReferenceIntegrator::new(&s, Estimator::Backward, 0) else { panic!("accepted") };
    assert!(error.to_string().contains("forward"), "{error}");
    assert!(ReferenceIntegrator::new(&s, Estimator::Forward, 0).is_ok());
}

#[test]
fn what_the_greatest_depth_cuts_is_counted() {
    let mut s = room(1, 2);
    s.max_depth = 1;
    let mut film = Film::new(&s.film);
    let mut integrator = ReferenceIntegrator::new(&s, Estimator::Backward, 0).expect("a scene");
    let stats = integrator.render_batch(abbe::render::Batch::even(0, 50), &mut film).expect("a batch");
    assert_eq!(stats.paths, 200);
    assert!(stats.truncated > 50 && stats.truncated < 200, "{stats:?}");
}

#[test]
fn empty_and_dark_scenes_are_black() {
    let s = scene(2, 2, 2, pinhole(DVec3::ZERO, DVec3::X, 1.0));
    for estimator in [Estimator::Backward, Estimator::Forward] {
        assert!(batches(&s, estimator, 1, 10)[0].iter().all(|&v| v == 0.0));
    }
}

#[test]
fn lamps_beyond_single_precision_are_dropped_and_counted() {
    for (estimator, radiance) in
        [Estimator::Backward, Estimator::Forward].into_iter().flat_map(|e| [1e33, 1e60, 1e300].map(|v| (e, v)))
    {
        let mut s = room(2, 3);
        s.shapes.iter_mut().filter_map(|shape| shape.emission.as_mut()).for_each(|e| e.radiance = flat(radiance).into());
        let mut film = Film::new(&s.film);
        let stats = ReferenceIntegrator::new(&s, estimator, 0)
            .expect("a scene")
            .render_batch(abbe::render::Batch::even(0, 20), &mut film)
            .expect("a batch");
        let values: Vec<f64> = (0..film.pixels()).flat_map(|p| film.pixel(p).to_vec()).collect();
        assert!(values.iter().all(|v| (*v as f32).is_finite()), "{estimator:?} {radiance}: {values:?}");
        assert!(stats.dropped_saturated + stats.dropped_not_finite > 0, "{estimator:?} {radiance}: {stats:?}");
    }
}
