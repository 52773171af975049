//! The double-precision reference against known answers, and its two estimators against each other.

use abbe::bsdf::conductor::RoughConductor;
use abbe::bsdf::dielectric::RoughDielectric;
use abbe::bsdf::energy::EnergyTable;
use abbe::bsdf::{fresnel, ggx, phase, sample_cosine};
use abbe::film::Film;
use abbe::reference::{ReferenceIntegrator, initial_interiors};
use abbe::render::Integrator;
use abbe::scene::*;
use abbe::spectrum::{Ior, Spectrum};
use glam::{DMat3, DVec3, dvec3};
use std::f64::consts::PI;
use std::sync::Arc;

// ---- building scenes ----

fn flat(v: f64) -> Spectrum {
    Spectrum::Constant(v)
}

/// Linear from `a` at 400 nm to `b` at 700 nm.
fn ramp(a: f64, b: f64) -> Spectrum {
    Spectrum::Table { nm: vec![400.0, 700.0], values: vec![a, b], extend: true }
}

/// A strongly dispersive index.
fn flint() -> Ior {
    Ior::new(abbe::spectrum::Formula::Cauchy { coef_um: vec![1.6, 0.03] })
}

fn air() -> Interior {
    solid("surroundings", 1.0, 0)
}

fn solid(name: &str, n: f64, priority: u8) -> Interior {
    Interior { name: name.into(), ior: Ior::constant(n), sigma_a: flat(0.0), sigma_s: flat(0.0), g: 0.0, priority }
}

fn scene(width: u32, height: u32, count: u32, sensor: Sensor) -> Scene {
    Scene {
        name: "test".into(),
        film: FilmSettings {
            width,
            height,
            bins: Bins { min_nm: 400.0, max_nm: 700.0, count },
            filter: Filter::Box,
            sampling: WavelengthSampling::Continuous,
            exposure: None,
        },
        sensor,
        materials: vec![Material::Diffuse { reflectance: flat(0.5) }],
        interiors: vec![air()],
        shapes: vec![],
        lights: vec![],
        max_depth: 64,
        reference: Estimator::Backward,
        notes: vec![],
    }
}

fn look_at(eye: DVec3, target: DVec3) -> DMat3 {
    let z = (eye - target).normalize();
    let up = if z.y.abs() > 0.99 { DVec3::Z } else { DVec3::Y };
    let x = up.cross(z).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

fn pinhole(eye: DVec3, target: DVec3, tan_half_vfov: f64) -> Sensor {
    Sensor::Perspective { eye, frame: look_at(eye, target), tan_half_vfov, lens_radius: 0.0, focus_distance: 1.0 }
}

fn orthographic(eye: DVec3, target: DVec3, height: f64) -> Sensor {
    Sensor::Orthographic { eye, frame: look_at(eye, target), height }
}


fn material(scene: &mut Scene, m: Material) -> usize {
    scene.materials.push(m);
    scene.materials.len() - 1
}

fn shape(scene: &mut Scene, material: usize, geometry: Geometry) {
    scene.shapes.push(Shape { name: String::new(), geometry, material, emission: None });
}

fn lamp(scene: &mut Scene, geometry: Geometry, radiance: Spectrum) {
    let emission = Some(Emission { radiance, two_sided: false });
    scene.shapes.push(Shape { name: "lamp".into(), geometry, material: 0, emission });
}

fn glass(scene: &mut Scene, interior: Interior, alpha: f64) -> usize {
    scene.interiors.push(interior);
    let interior = scene.interiors.len() - 1;
    material(scene, Material::Dielectric { interior, alpha })
}

fn sphere(center: DVec3, radius: f64) -> Geometry {
    Geometry::Sphere { center, radius }
}

fn disc(center: DVec3, normal: DVec3, radius: f64) -> Geometry {
    Geometry::Disc { center, normal, radius }
}

/// An axis-aligned box with outward normals.
fn cuboid(lo: DVec3, hi: DVec3) -> Geometry {
    let corner = |i: u32| dvec3(pick(i & 1, lo.x, hi.x), pick(i & 2, lo.y, hi.y), pick(i & 4, lo.z, hi.z));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Geometry::Mesh(Arc::new(Mesh { positions: (0..8).map(corner).collect(), normals: vec![], triangles }))
}

fn pick(bit: u32, zero: f64, one: f64) -> f64 {
    if bit == 0 { zero } else { one }
}

/// A coarse triangulated ball with the normals of the true one.
fn smooth_ball(center: DVec3, radius: f64) -> Geometry {
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

// ---- rendering and comparing ----

/// Values of independent batches, one after another.
fn batches(scene: &Scene, estimator: Estimator, count: u32, spp: u32) -> Vec<Vec<f64>> {
    let mut integrator = ReferenceIntegrator::new(scene, estimator, 7).expect("a scene this estimator can see");
    let render = |i| {
        let mut film = Film::new(&scene.film);
        let stats = integrator.render_batch(i, spp, &mut film).expect("a batch");
        assert_eq!((stats.dropped_not_finite, stats.dropped_negative), (0, 0), "dropped samples");
        (0..film.pixels()).flat_map(|p| film.pixel(p).to_vec()).collect()
    };
    (0..count).map(render).collect()
}

/// Mean and standard error over batches of `value`.
fn estimate(batches: &[Vec<f64>], value: impl Fn(&[f64]) -> f64) -> (f64, f64) {
    let values: Vec<f64> = batches.iter().map(|b| value(b)).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Mean over the pixels of one channel.
fn image_mean(scene: &Scene, channel: usize) -> impl Fn(&[f64]) -> f64 {
    let channels = scene.film.bins.count as usize + 3;
    move |b| b.chunks(channels).map(|p| p[channel]).sum::<f64>() / (b.len() / channels) as f64
}

/// Upper quantile of the standard normal distribution (Abramowitz & Stegun 26.2.23, error below 4.5e-4).
fn normal_quantile(p: f64) -> f64 {
    let t = (-2.0 * p.ln()).sqrt();
    t - (2.515517 + 0.802853 * t + 0.010328 * t * t) / (1.0 + 1.432788 * t + 0.189269 * t * t + 0.001308 * t.powi(3))
}

/// Two-sided threshold of Student's t with `dof` degrees of freedom for one of `family` tests, all together at 1e-3
/// (Sidak; Cornish-Fisher expansion, Abramowitz & Stegun 26.7.5).
fn threshold(family: usize, dof: f64) -> f64 {
    let z = normal_quantile(0.5 * -f64::exp_m1((-1e-3f64).ln_1p() / family as f64));
    z + (z.powi(3) + z) / (4.0 * dof) + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * dof * dof)
}

/// Both estimators agree in every channel of every block of pixels, and their errors are small enough for that to mean something.
fn agree(name: &str, scene: &Scene, backward_spp: u32, forward_spp: u32, block: usize) {
    const BATCHES: u32 = 24;
    let a = batches(scene, Estimator::Backward, BATCHES, backward_spp);
    let b = batches(scene, Estimator::Forward, BATCHES, forward_spp);
    let (width, channels) = (scene.film.width as usize, scene.film.bins.count as usize + 3);
    let (cols, rows) = (width / block, scene.film.height as usize / block);
    let limit = threshold(cols * rows * channels, f64::from(BATCHES - 1));
    let mut worst: f64 = 0.0;
    for at in 0..cols * rows * channels {
        let (channel, col, row) = (at % channels, at / channels % cols, at / channels / cols);
        let value = |film: &[f64]| {
            let pixels = (0..block * block).map(|i| (row * block + i / block) * width + col * block + i % block);
            pixels.map(|p| film[p * channels + channel]).sum::<f64>() / (block * block) as f64
        };
        let ((ma, sa), (mb, sb)) = (estimate(&a, value), estimate(&b, value));
        let error = sa.hypot(sb);
        let z = (ma - mb).abs() / error.max(1e-12 * ma.abs()).max(f64::MIN_POSITIVE);
        assert!(z < limit, "{name}: block {col},{row} channel {channel}: backward {ma} +- {sa}, forward {mb} +- {sb}, z = {z:.1}");
        worst = worst.max(error / ma.abs().max(f64::MIN_POSITIVE));
    }
    println!("{name}: worst error of a block {:.2} %", 100.0 * worst);
    assert!(worst < 0.03, "{name}: a block's error of {worst} is too large to tell anything");
}

/// The mean of every bin equals `exact`.
fn equals(name: &str, scene: &Scene, estimator: Estimator, spp: u32, exact: f64, floor: f64) {
    let films = batches(scene, estimator, 16, spp);
    let bins = scene.film.bins.count as usize;
    for bin in 0..bins {
        let (mean, error) = estimate(&films, image_mean(scene, bin));
        let off = (mean - exact).abs();
        println!("{name}: bin {bin}: {mean} +- {error}, exact {exact}");
        assert!(off <= floor * exact + threshold(bins, 15.0) * error, "{name}: bin {bin}: {mean} +- {error}, exact {exact}");
        assert!(error < 3e-3 * exact, "{name}: an error of {error} is too large to tell anything");
    }
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn array<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.next())
    }
}

// ---- known answers ----

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
        equals(&format!("rough ball {alpha}"), &ball, Estimator::Backward, 2500, 1.0, 1e-3);
        let mirror = furnace(|s| {
            let m = material(s, Material::Conductor { eta: flat(1e-6), k: flat(10.0), alpha });
            shape(s, m, sphere(DVec3::ZERO, 1.0));
        });
        equals(&format!("rough mirror {alpha}"), &mirror, Estimator::Backward, 2000, 1.0, 1e-3);
    }
}

#[test]
fn closed_diffuse_box_has_radiance_one() {
    let mut s = scene(2, 2, 2, pinhole(DVec3::splat(0.1), dvec3(1.0, 0.3, -0.2), 1.0));
    lamp(&mut s, cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)), flat(0.5));
    s.shapes[0].emission = Some(Emission { radiance: flat(0.5), two_sided: true });
    equals("box", &s, Estimator::Backward, 1000, 1.0, 0.0);
    s.sensor = Sensor::IrradiancePlane { origin: dvec3(-0.5, 0.1, 0.4), edge_u: DVec3::X, edge_v: -DVec3::Z };
    equals("irradiance in the box", &s, Estimator::Forward, 20000, PI, 0.0);
    s.sensor = Sensor::IrradianceSphere { center: dvec3(-0.2, 0.1, 0.2), radius: 0.5 };
    equals("irradiance on a ball", &s, Estimator::Forward, 10000, PI, 0.0);
    equals("irradiance on a ball", &s, Estimator::Backward, 1000, PI, 0.0);
}

/// Light from a lamp through a stack of slabs at normal incidence.
fn slab(layers: &[(f64, f64, f64, Interior)], alpha: f64) -> Scene {
    let mut s = scene(2, 2, 2, orthographic(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 0.5));
    for (lo, hi, width, interior) in layers {
        let m = glass(&mut s, interior.clone(), alpha);
        shape(&mut s, m, cuboid(dvec3(-width, -width, *lo), dvec3(*width, *width, *hi)));
    }
    lamp(&mut s, disc(dvec3(0.0, 0.0, -2.0), DVec3::Z, 1.0), flat(1.0));
    s.materials[0] = Material::Diffuse { reflectance: flat(0.0) };
    s
}

#[test]
fn slabs_transmit_what_they_should() {
    let n: f64 = 1.5168;
    let clear = 2.0 * n / (n * n + 1.0);
    equals("slab", &slab(&[(0.0, 1.0, 50.0, solid("glass", n, 1))], 0.0), Estimator::Backward, 8000, clear, 0.0);
    let absorbing = Interior { sigma_a: flat(0.1), ..solid("glass", n, 1) };
    equals("absorbing slab", &slab(&[(0.0, 1.0, 50.0, absorbing)], 0.0), Estimator::Backward, 8000, 0.831352, 1e-6);
    // Two slabs of one index whose faces coincide, in either order of priority, are one slab.
    for (p, q) in [(1, 2), (2, 1), (1, 1)] {
        let halves = [(0.0, 0.4, 50.0, solid("back", n, p)), (0.4, 1.0, 50.0, solid("front", n, q))];
        equals("slabs in contact", &slab(&halves, 0.0), Estimator::Backward, 8000, clear, 0.0);
    }
    // An index of 1 is not there at all, and a rough surface without an index step is none.
    for alpha in [0.0, 0.5] {
        equals("matched", &slab(&[(0.0, 1.0, 50.0, solid("air", 1.0, 1))], alpha), Estimator::Backward, 4, 1.0, 1e-12);
    }
}

#[test]
fn thin_pane_reflects_with_all_inner_bounces() {
    let mut s = slab(&[], 0.0);
    let pane = material(&mut s, Material::ThinDielectric { ior: Ior::constant(1.5168) });
    shape(&mut s, pane, disc(DVec3::ZERO, DVec3::Z, 10.0));
    let n: f64 = 1.5168;
    equals("pane", &s, Estimator::Backward, 4000, 2.0 * n / (n * n + 1.0), 0.0);
}

#[test]
fn fresnel_has_its_known_values() {
    let close = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{a} is not {b}");
    close(fresnel::average_dielectric(1.5), 0.091778, 1e-6);
    close(fresnel::average_dielectric(1.0 / 1.5), 0.596346, 1e-6);
    close(fresnel::dielectric(1.0, 1.5168), 0.04216, 5e-6);
    close(fresnel::dielectric(56.604f64.to_radians().cos(), 1.5168), 0.5 * {
        // At Brewster's angle only the perpendicular half is left.
        let (i, t) = (56.604f64.to_radians(), (56.604f64.to_radians().sin() / 1.5168).asin());
        ((i - t).sin() / (i + t).sin()).powi(2)
    }, 1e-9);
    let critical = 41.245f64.to_radians();
    assert!(fresnel::dielectric((critical - 1e-3).cos(), 1.0 / 1.5168) < 0.9);
    assert_eq!(fresnel::dielectric((critical + 1e-3).cos(), 1.0 / 1.5168), 1.0);
    assert_eq!(fresnel::dielectric(0.0, 1.5), 1.0);
    // A metal without absorption is a dielectric.
    for cos in [0.1, 0.5, 0.9, 1.0] {
        close(fresnel::conductor(cos, 1.5, 0.0), fresnel::dielectric(cos, 1.5), 1e-12);
    }
    // Aluminium-like at normal incidence: ((n-1)^2 + k^2) / ((n+1)^2 + k^2).
    close(fresnel::conductor(1.0, 0.9, 6.5), (0.01 + 42.25) / (3.61 + 42.25), 1e-12);
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
    let spot = Light::Spot { position, direction: toward, intensity: flat(3.0), cos_inner: 0.95, cos_outer: 0.9 };
    close("spot", flux_of(spot), 3.0 * 2.0 * PI * (0.05 + 0.025));
    let beam = Light::Beam { origin: position, direction: toward, radius: 0.5, irradiance: flat(3.0) };
    close("beam", flux_of(beam), 3.0 * PI * 0.25);
    close("parallel sun", flux_of(Light::Sun { direction: toward, cos_angle: 1.0, irradiance: flat(3.0) }), 3.0 * PI);
    // Irradiance on a plane facing it is L pi sin^2; a ball sees every direction's full cross-section, L times the solid angle.
    let sun = Light::Sun { direction: toward, cos_angle: 0.8, irradiance: flat(3.0) };
    close("sun", flux_of(sun), 3.0 / (PI * 0.36) * 2.0 * PI * 0.2 * PI);
    close("constant", flux_of(Light::Constant { radiance: flat(3.0) }), 3.0 * 4.0 * PI * PI);
    // Upper half of the sky at 2 (sigmoid of 0 is 1/2), lower half dark.
    let texels = [vec![[0.0, 0.0, 0.0, 4.0]; 16], vec![[0.0; 4]; 16]].concat();
    let map = EnvironmentMap { width: 8, height: 4, texels, illuminant: flat(1.0), to_local: DMat3::IDENTITY };
    close("image", flux_of(Light::Image(Arc::new(map))), 2.0 * 2.0 * PI * PI);
}

#[test]
fn prism_deviates_as_the_book_says() {
    // Minimum deviation of a 60 degree prism with its edge along y, from where a narrow beam lands on a far, large ring.
    for (n, exact) in [(1.522376, 39.138), (1.516800, 38.647), (1.514322, 38.429)] {
        let (width, radius) = (36_000, 1e4);
        let mut s = scene(width, 1, 1, Sensor::IrradianceSphere { center: DVec3::ZERO, radius });
        s.film.sampling = WavelengthSampling::Centres;
        let m = glass(&mut s, solid("glass", n, 1), 0.0);
        // Cross-section: apex at +z, base below; the beam comes from -x and goes down to the base side.
        let (h, y) = (0.75f64.sqrt(), 0.5);
        let section = [(0.0, h - 0.3), (-0.5, -0.3), (0.5, -0.3)];
        let positions = section.iter().flat_map(|&(x, z)| [dvec3(x, -y, z), dvec3(x, y, z)]).collect();
        let triangles = vec![[0, 3, 1], [0, 2, 3], [2, 5, 3], [2, 4, 5], [4, 1, 5], [4, 0, 1], [0, 4, 2], [1, 3, 5]];
        shape(&mut s, m, Geometry::Mesh(Arc::new(Mesh { positions, normals: vec![], triangles })));
        // Symmetric passage: inside the light runs along +x, outside it is tilted by half the deviation.
        let tilt = (n * 0.5f64).asin() - PI / 6.0;
        let dir = dvec3(tilt.cos(), 0.0, tilt.sin());
        let face = dvec3(-0.25, 0.0, 0.5 * h - 0.3);
        s.lights.push(Light::Beam { origin: face - dir, direction: dir, radius: 1e-3, irradiance: flat(1.0) });
        let film = &batches(&s, Estimator::Forward, 1, 1)[0];
        let brightest = film.chunks(4).enumerate().max_by(|a, b| a.1[0].total_cmp(&b.1[0])).expect("pixels").0;
        // Columns count azimuth from +x towards -z, the sense in which the prism turns the light.
        let azimuth = 360.0 * (brightest as f64 + 0.5) / f64::from(width);
        let deviation = azimuth + tilt.to_degrees();
        assert!((deviation - exact).abs() < 0.012, "n = {n}: deviation {deviation}, exact {exact}");
    }
}

#[test]
fn ball_lens_focuses_where_it_should() {
    let n = 1.5168;
    let focus = n / (2.0 * (n - 1.0));
    let height = 0.02;
    let landing = |z: f64| {
        let mut s = scene(400, 1, 1, Sensor::IrradiancePlane { origin: dvec3(-0.04, -0.5, -z), edge_u: DVec3::X * 0.08, edge_v: DVec3::Y });
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
fn ball_gathers_collimated_light_as_computed() {
    // Share of the flux that falls on the ball and lands within rho on the plane 1.5 R behind its centre after two refractions.
    let mut s = scene(60, 60, 1, Sensor::IrradiancePlane { origin: dvec3(-1.2, -1.2, -1.5), edge_u: DVec3::X * 2.4, edge_v: DVec3::Y * 2.4 });
    let m = glass(&mut s, solid("glass", 1.5, 1), 0.0);
    shape(&mut s, m, sphere(DVec3::ZERO, 1.0));
    s.max_depth = 2;
    s.lights.push(Light::Beam { origin: dvec3(0.0, 0.0, 3.0), direction: -DVec3::Z, radius: 1.0, irradiance: flat(1.0) });
    let films = batches(&s, Estimator::Forward, 16, 40);
    let (flux, error) = estimate(&films, |film| {
        let inside = film.chunks(4).enumerate().filter(|(i, _)| {
            let (x, y) = ((i % 60) as f64 - 29.5, (i / 60) as f64 - 29.5);
            x.hypot(y) * 0.04 < 1.0
        });
        inside.map(|(_, p)| p[0] * 0.04 * 0.04).sum::<f64>() / PI
    });
    assert!((flux - 0.79512).abs() < 4.0 * error + 1e-3 && error < 2e-3, "{flux} +- {error}");
}

// ---- backward against forward ----

/// A small open room, lit from above, seen from its front.
fn room(bins: u32, size: u32) -> Scene {
    let mut s = scene(size, size, bins, pinhole(dvec3(0.0, 1.0, 3.4), dvec3(0.0, 0.6, 0.0), 0.32));
    s.materials[0] = Material::Diffuse { reflectance: ramp(0.8, 0.4) };
    shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 3.0));
    shape(&mut s, 0, disc(dvec3(0.0, 0.0, -1.0), DVec3::Z, 3.0));
    lamp(&mut s, disc(dvec3(0.0, 2.0, 0.2), -DVec3::Y, 0.8), ramp(1.0, 2.0));
    s
}

#[test]
fn backward_and_forward_agree_on_a_caustic_of_dispersive_glass() {
    let mut s = room(3, 4);
    // The ball is over the camera's view: its light is seen on the floor, not the ball itself, which no forward path could join.
    let m = glass(&mut s, Interior { ior: flint(), ..solid("flint", 1.0, 1) }, 0.0);
    shape(&mut s, m, sphere(dvec3(0.0, 1.1, 0.3), 0.4));
    s.sensor = pinhole(dvec3(0.0, 0.5, 2.0), dvec3(0.0, 0.0, 0.3), 0.25);
    s.film.filter = Filter::Tent { radius: 1.0 };
    agree("caustic", &s, 1000, 6000, 2);
}

#[test]
fn backward_and_forward_agree_on_rough_surfaces_through_a_pane_and_a_lens() {
    let mut s = room(2, 4);
    let frosted = glass(&mut s, Interior { ior: flint(), sigma_a: ramp(0.0, 1.0), ..solid("flint", 1.0, 1) }, 0.4);
    shape(&mut s, frosted, sphere(dvec3(-0.45, 0.5, 0.0), 0.45));
    let metal = material(&mut s, Material::Conductor { eta: ramp(0.3, 1.2), k: ramp(2.0, 4.0), alpha: 0.3 });
    let mixed = material(&mut s, Material::Mix { a: metal, b: 0, weight: ramp(0.2, 0.8) });
    shape(&mut s, mixed, sphere(dvec3(0.5, 0.5, 0.2), 0.4));
    let veil = material(&mut s, Material::Boundary { interior: None });
    let veil = material(&mut s, Material::Mix { a: veil, b: 0, weight: ramp(0.9, 0.5) });
    shape(&mut s, veil, disc(dvec3(0.2, 0.6, 1.0), dvec3(0.0, 0.6, 0.8), 0.5));
    let pane = material(&mut s, Material::ThinDielectric { ior: flint() });
    shape(&mut s, pane, disc(dvec3(0.0, 1.0, 2.6), dvec3(0.6, 0.0, 0.8), 0.8));
    if let Sensor::Perspective { lens_radius, focus_distance, .. } = &mut s.sensor {
        (*lens_radius, *focus_distance) = (0.1, 3.0);
    }
    s.film.filter = Filter::Gaussian { sigma: 0.5 };
    agree("rough", &s, 3000, 12000, 2);
}

#[test]
fn backward_and_forward_agree_in_fog() {
    let mut s = room(3, 4);
    s.interiors[0] = Interior { sigma_a: flat(0.05), sigma_s: ramp(0.1, 0.5), g: 0.6, ..air() };
    let cloud = Interior { sigma_s: ramp(1.5, 0.5), sigma_a: ramp(0.0, 0.3), g: -0.3, ..solid("cloud", 1.0, 0) };
    s.interiors.push(cloud);
    let m = material(&mut s, Material::Boundary { interior: Some(1) });
    shape(&mut s, m, sphere(dvec3(0.3, 0.8, 0.3), 0.6));
    agree("fog", &s, 2500, 4000, 2);
}

#[test]
fn backward_and_forward_agree_under_water() {
    // The camera is in the water; light comes in through a wavy-less, open sheet, so radiance is scaled and flux is not.
    let mut s = room(2, 4);
    let water = glass(&mut s, Interior { sigma_a: ramp(0.1, 0.4), ..solid("water", 1.33, 1) }, 0.0);
    shape(&mut s, water, disc(dvec3(0.0, 1.2, 0.0), DVec3::Y, 100.0));
    s.sensor = pinhole(dvec3(0.0, 0.8, 1.2), dvec3(0.0, 0.0, 0.0), 0.25);
    assert_eq!(initial_interiors(&s, dvec3(0.0, 0.8, 1.2)), [1]);
    agree("under water", &s, 2000, 6000, 2);
    s.sensor = Sensor::IrradiancePlane { origin: dvec3(-0.4, 0.3, 0.4), edge_u: DVec3::X * 0.8, edge_v: DVec3::Z * -0.8 };
    agree("irradiance under water", &s, 1000, 10000, 2);
}

#[test]
fn backward_and_forward_agree_with_shading_normals() {
    let mut s = room(2, 4);
    shape(&mut s, 0, smooth_ball(dvec3(-0.4, 0.6, 0.0), 0.5));
    let metal = material(&mut s, Material::Conductor { eta: flat(0.5), k: flat(3.0), alpha: 0.5 });
    shape(&mut s, metal, smooth_ball(dvec3(0.5, 0.6, 0.2), 0.4));
    s.sensor = orthographic(dvec3(0.0, 1.2, 3.0), dvec3(0.0, 0.6, 0.0), 1.6);
    agree("shading normals", &s, 1500, 8000, 2);
}

#[test]
fn backward_and_forward_agree_under_the_sky() {
    let mut s = scene(4, 4, 2, pinhole(dvec3(0.0, 1.0, 3.0), dvec3(0.0, 0.5, 0.0), 0.5));
    shape(&mut s, 0, disc(DVec3::ZERO, DVec3::Y, 2.0));
    shape(&mut s, 0, sphere(dvec3(0.2, 0.5, 0.0), 0.5));
    s.lights.push(Light::Constant { radiance: ramp(0.5, 0.2) });
    let direction = dvec3(-0.3, -1.0, -0.4).normalize();
    s.lights.push(Light::Sun { direction, cos_angle: 0.9, irradiance: ramp(1.0, 2.0) });
    let texels = (0..32).map(|i| [0.0, 0.0, 0.0, 0.1 * (i % 7) as f32]).collect();
    let to_local = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.3);
    s.lights.push(Light::Image(Arc::new(EnvironmentMap { width: 8, height: 4, texels, illuminant: ramp(1.0, 0.5), to_local })));
    agree("sky", &s, 1500, 8000, 2);
}

// ---- sampling against densities ----

/// A chi-square test of directions against a density over cells of equal solid angle; what `pdf` leaves to 1 is absorbed.
fn chi_square(name: &str, pdf: impl Fn(DVec3) -> f64, mut sample: impl FnMut(&mut Random) -> Option<DVec3>) {
    const ROWS: usize = 16;
    const COLS: usize = 16;
    const FINE: usize = 24;
    const SAMPLES: usize = 200_000;
    let direction = |y: f64, phi: f64| dvec3(phi.cos() * (1.0 - y * y).sqrt(), phi.sin() * (1.0 - y * y).sqrt(), y);
    let mut expected = vec![0.0; ROWS * COLS + 1];
    for r in 0..ROWS * FINE {
        for c in 0..COLS * FINE {
            let y = -1.0 + 2.0 * (r as f64 + 0.5) / (ROWS * FINE) as f64;
            let phi = 2.0 * PI * (c as f64 + 0.5) / (COLS * FINE) as f64;
            let solid_angle = 4.0 * PI / (ROWS * COLS * FINE * FINE) as f64;
            expected[r / FINE * COLS + c / FINE] += pdf(direction(y, phi)) * solid_angle * SAMPLES as f64;
        }
    }
    expected[ROWS * COLS] = SAMPLES as f64 - expected.iter().sum::<f64>();
    assert!(expected[ROWS * COLS] > -3e-3 * SAMPLES as f64, "{name}: the density integrates to more than 1");
    let mut seen = vec![0.0; ROWS * COLS + 1];
    let mut random = Random(name.len() as u64);
    for _ in 0..SAMPLES {
        let cell = sample(&mut random).map_or(ROWS * COLS, |w| {
            let row = (((w.z + 1.0) * 0.5 * ROWS as f64) as usize).min(ROWS - 1);
            let col = ((w.y.atan2(w.x).rem_euclid(2.0 * PI) / (2.0 * PI) * COLS as f64) as usize).min(COLS - 1);
            row * COLS + col
        });
        seen[cell] += 1.0;
    }
    // Cells with little in them are pooled; the error of the quadrature is allowed for in the variance.
    let (mut statistic, mut cells, mut rest) = (0.0, 0.0, (0.0, 0.0));
    for (s, e) in seen.iter().zip(&expected) {
        if *e > 10.0 {
            statistic += (s - e) * (s - e) / (e + (2e-3 * e).powi(2));
            cells += 1.0;
        } else {
            rest = (rest.0 + s, rest.1 + e);
        }
    }
    assert!((rest.0 - rest.1).abs() < 5.0 * f64::max(rest.1, 0.0).sqrt() + 10.0, "{name}: {} where {} belong", rest.0, rest.1);
    let dof: f64 = cells - 1.0;
    // Wilson-Hilferty; 4.5 standard deviations.
    let limit = dof * (1.0 - 2.0 / (9.0 * dof) + 4.5 * (2.0 / (9.0 * dof)).sqrt()).powi(3);
    assert!(statistic < limit, "{name}: chi-square {statistic:.0} of {dof} cells, limit {limit:.0}");
}

fn tilted(mu: f64) -> DVec3 {
    dvec3(0.6 * (1.0 - mu * mu).sqrt(), 0.8 * (1.0 - mu * mu).sqrt(), mu)
}

#[test]
fn directions_are_sampled_with_the_density_that_is_claimed() {
    chi_square("cosine", |w| w.z.max(0.0) / PI, |r| Some(sample_cosine(r.array())));
    for g in [-0.5, 0.0, 5e-5, 0.8] {
        let dir = dvec3(0.36, -0.48, 0.8);
        chi_square(&format!("hg {g}"), |w| phase::pdf_hg(w.dot(dir), g), |r| Some(phase::sample_hg(dir, g, r.array())));
    }
    for alpha in [0.3, 0.8] {
        let (table, mirror) = (EnergyTable::dielectric(alpha), EnergyTable::conductor(alpha));
        for mu in [0.15, 0.7] {
            let wi = tilted(mu);
            chi_square("vndf", |m| ggx::pdf_vndf(alpha, wi, m), |r| Some(ggx::sample_vndf(alpha, wi, r.array())));
            for eta in [1.5, 1.0 / 1.5] {
                let b = RoughDielectric { alpha, eta, energy: &table };
                chi_square(&format!("dielectric {alpha} {mu} {eta}"), |w| b.pdf(wi, w), |r| b.sample(wi, r.array()).map(|s| s.0));
            }
            let b = RoughConductor { alpha, energy: &mirror };
            chi_square(&format!("conductor {alpha} {mu}"), |w| b.pdf(wi, w), |r| b.sample(wi, r.array()).map(|s| s.wo));
        }
    }
}

#[test]
fn weights_of_rough_samples_are_value_over_density() {
    // Over many samples, the weight averaged in a half space must be the integral of the value there.
    let (alpha, mut random) = (0.5, Random(3));
    let table = EnergyTable::dielectric(alpha);
    for eta in [1.5, 1.0 / 1.5] {
        let (b, wi) = (RoughDielectric { alpha, eta, energy: &table }, tilted(0.6));
        for side in [1.0, -1.0] {
            let (mut by_weight, mut by_value) = (0.0, 0.0);
            const N: usize = 400_000;
            for _ in 0..N {
                by_weight += b.sample(wi, random.array()).filter(|s| s.0.z * side > 0.0).map_or(0.0, |s| s.1 * s.0.x.abs());
                let mut wo = sample_cosine(random.array());
                by_value += b.eval(wi, dvec3(wo.x, wo.y, wo.z * side)) * PI / wo.z * wo.x.abs();
                wo.z = 0.0;
            }
            assert!((by_weight / by_value - 1.0).abs() < 0.01, "eta {eta}, side {side}: {by_weight} {by_value}");
        }
    }
}

#[test]
fn rough_glass_is_reciprocal_and_rough_metal_too() {
    let mut random = Random(11);
    for (alpha, n) in [(0.1, 1.3), (0.4, 1.5), (1.0, 2.4)] {
        let (table, mirror) = (EnergyTable::dielectric(alpha), EnergyTable::conductor(alpha));
        let near = RoughDielectric { alpha, eta: n, energy: &table };
        let far = RoughDielectric { alpha, eta: 1.0 / n, energy: &table };
        let metal = RoughConductor { alpha, energy: &mirror };
        for _ in 0..200 {
            let (a, b) = (sample_cosine(random.array()), sample_cosine(random.array()));
            let same = |x: f64, y: f64| assert!((x - y).abs() <= 1e-9 * (x + y), "{alpha} {n}: {x} against {y}");
            same(near.eval(a, b) / b.z, near.eval(b, a) / a.z);
            same(metal.eval(a, b, 0.5, 3.0) / b.z, metal.eval(b, a, 0.5, 3.0) / a.z);
            // n_a^2 g_ab = n_b^2 g_ba, the far side's frame being turned upside down.
            let turned = |w: DVec3| dvec3(w.x, w.y, -w.z);
            same(near.eval(a, turned(b)) / b.z, n * n * far.eval(b, turned(a)) / a.z);
        }
    }
}

#[test]
fn energy_lost_to_single_scattering_is_given_back() {
    for alpha in [0.02, 0.1, 0.3, 0.7, 1.0] {
        let table = EnergyTable::dielectric(alpha);
        for eta in [1.1, 1.33, 1.5168, 2.417, 1.0 / 1.1, 1.0 / 1.33, 1.0 / 1.5168, 1.0 / 2.417] {
            let b = RoughDielectric { alpha, eta, energy: &table };
            let mut random = Random((alpha * 100.0 + eta * 1e4) as u64);
            const N: usize = 150_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..N {
                let wi = sample_cosine(random.array());
                let w = b.sample(wi, random.array()).map_or(0.0, |s| s.1);
                sum += w;
                squares += w * w;
            }
            let mean = sum / N as f64;
            let error = ((squares / N as f64 - mean * mean) / N as f64).sqrt();
            println!("alpha {alpha} eta {eta:.4}: {mean:.5} +- {error:.5}");
            assert!((mean - 1.0).abs() < 1e-3 + 4.0 * error, "alpha {alpha} eta {eta}: {mean} +- {error}");
        }
    }
}

// ---- the machinery ----

#[test]
fn interiors_are_counted_from_the_geometry() {
    let mut s = scene(1, 1, 1, pinhole(DVec3::ZERO, DVec3::X, 1.0));
    let outer = glass(&mut s, solid("outer", 1.3, 1), 0.0);
    let inner = glass(&mut s, solid("inner", 1.5, 2), 0.1);
    shape(&mut s, outer, sphere(DVec3::ZERO, 2.0));
    shape(&mut s, inner, cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)));
    shape(&mut s, 0, disc(dvec3(0.0, 1.5, 0.0), DVec3::Y, 5.0));
    assert_eq!(initial_interiors(&s, DVec3::ZERO), [1, 2]);
    assert_eq!(initial_interiors(&s, dvec3(0.0, 1.2, 0.0)), [1]);
    assert_eq!(initial_interiors(&s, dvec3(0.0, -5.0, 0.0)), [0usize; 0]);
    assert_eq!(initial_interiors(&s, dvec3(0.0, 5.0, 0.0)), [0usize; 0]);
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
    let stats = integrator.render_batch(0, 50, &mut film).expect("a batch");
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
