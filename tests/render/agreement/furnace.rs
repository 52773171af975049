//! Answers known without a reference: in uniform light nothing that only bends it can be seen (smooth, nested and moderately rough glass:
//! [`crate::validate`]), and glass whose index hardly varies is as good as glass of one index.

use super::compare::{against, agree, gpu, pairs};
use super::textures::{ball, coats_that_point_elsewhere, numbers, on, quad, texture};
use crate::scenes::*;
use crate::sweep;
use abbe::bsdf::coat::Coat;
use abbe::bsdf::energy::EnergyTable;
use abbe::bsdf::fresnel;
use abbe::bsdf::sheen::Sheen;
use abbe::compare::difference::threshold;
use abbe::scene::texture::{ImageTexture, Wrap};
use abbe::scene::*;
use abbe::spectrum::{Formula, Ior, Spectrum};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// A view of what `fill` adds, in uniform light of radiance 1.
fn furnace(fill: impl Fn(&mut Scene)) -> Scene {
    let mut s = scene(16, 16, 4, orthographic(dvec3(0.0, 0.0, 5.0), DVec3::ZERO, 2.2));
    s.max_depth = 2000;
    s.lights.push(Light::Constant { radiance: flat(1.0) });
    fill(&mut s);
    s
}

/// Radiance 1 in every bin, over the image and in every block, to 1e-3 and the errors.
fn cannot_be_seen(name: &str, scene: &Scene, spp: u32) {
    let batches = gpu(scene, 3, spp);
    let figures = batches.figures();
    let everywhere = (0..16).flat_map(|block| (0..4).map(move |bin| (block, bin)));
    let blocks = everywhere.map(|(block, bin)| (format!("block {block} bin {bin}"), batches.over(&[block], bin), 0.01));
    let bins = figures.bins.iter().enumerate().map(|(i, &f)| (format!("bin {i}"), f, 0.002));
    let mut greatest = 0.0f64;
    for (what, f, small) in bins.chain(blocks) {
        let limit = threshold(68, f.dof) * f.error + 1e-3;
        assert!((f.mean - 1.0).abs() < limit, "{name}: {what}: {} +- {}", f.mean, f.error);
        assert!(f.error < small, "{name}: {what}: an error of {} is too large to tell anything", f.error);
        greatest = greatest.max(f.error / small);
    }
    println!(
        "{name}: errors up to {greatest:.2} of what counts, bins off by {:?}",
        figures.bins.iter().map(|f| f.mean - 1.0).collect::<Vec<_>>()
    );
}

#[test]
fn uniform_light_is_the_same_in_any_number_of_bins_over_any_range() {
    for (count, min_nm, max_nm, spp) in [
        (1, 380.0, 780.0, 64),
        (33, 1000.0, 1001.0, 128),
        (400, 300.0, 2500.0, 512),
        (400, 380.0, 780.0, 512),
        (3, 300.0, 2500.0, 64),
    ]
    .into_iter()
    .take(sweep::count(2))
    {
        let mut ball = furnace(|s| {
            let m = glass(s, solid("glass", 1.5, 1), 0.0);
            shape(s, m, sphere(DVec3::ZERO, 1.0));
        });
        ball.film.bins = Bins { min_nm, max_nm, count };
        for (bin, f) in gpu(&ball, 3, spp).figures().bins.iter().enumerate() {
            println!("{count} bins: {f:?}");
            let limit = threshold(count as usize, f.dof) * f.error + 1e-3;
            assert!(
                (f.mean - 1.0).abs() < limit && f.error < 0.005,
                "{count} bins over {min_nm} to {max_nm} nm: bin {bin}: {f:?}"
            );
        }
    }
}

/// Adds a material.
type Make<'a> = &'a dyn Fn(&mut Scene) -> usize;

/// Whichever of these materials a ball is of, it cannot be seen. Nor can one of each of the others far behind it, by which all these scenes share kernels.
fn balls_cannot_be_seen(balls: &[(&str, u32, Make)]) {
    for (i, (name, spp, _)) in balls.iter().enumerate() {
        let scene = furnace(|s| {
            for (k, (_, _, make)) in balls[i..].iter().chain(&balls[..i]).enumerate() {
                let m = make(s);
                shape(s, m, sphere(dvec3(0.0, 0.0, -100.0 * k as f64), 1.0));
            }
        });
        cannot_be_seen(name, &scene, *spp);
    }
}

#[test]
fn rough_surfaces_in_uniform_light_cannot_be_seen() {
    for (alpha, spp) in [(0.1, 32), (1.0, 32)] {
        let ball = furnace(|s| {
            let m = glass(s, solid("glass", 1.5, 1), alpha);
            shape(s, m, sphere(DVec3::ZERO, 1.0));
        });
        cannot_be_seen(&format!("rough ball {alpha}"), &ball, spp);
    }
    let mirror = |s: &mut Scene, alpha| material(s, Material::Conductor { eta: flat(1e-6), k: flat(10.0), alpha });
    let brushed = |s: &mut Scene, alpha, strength| {
        let m = mirror(s, alpha);
        s.grains.insert(m, Grain { strength, rotation: 0.4 });
        m
    };
    let pane = |s: &mut Scene, alpha, brushed: Option<f64>| {
        let clear = Material::ThinDielectric { ior: Ior::constant(1.5), alpha, tint: None, depth: flat(0.0) };
        let m = material(s, clear);
        if let Some(strength) = brushed {
            s.grains.insert(m, Grain { strength, rotation: 0.4 });
            s.thin_films.insert(m, ThinFilm { ior: Ior::constant(2.4), thickness_nm: 120.0 });
        }
        m
    };
    balls_cannot_be_seen(&[
        ("rough mirror", 8, &|s| mirror(s, 0.5)),
        ("rough pane", 8, &|s| pane(s, 0.4, None)),
        ("brushed pane with a film", 24, &|s| pane(s, 0.3, Some(0.5))),
        ("translucent", 2, &|s| material(s, Material::DiffuseTransmission { transmittance: flat(1.0).into() })),
        ("brushed mirror 0.05 0.7", 4, &|s| brushed(s, 0.05, 0.7)),
        ("brushed mirror 0.3 1", 8, &|s| brushed(s, 0.3, 1.0)),
    ]);
    let coated = |s: &mut Scene, alpha| {
        let white = material(s, Material::Diffuse { reflectance: flat(1.0).into() });
        material(s, Material::Coated { base: white, ior: flint(), alpha, seen: false, normals: CoatNormals::OfBase })
    };
    balls_cannot_be_seen(&[("white under a coat 0", 8, &|s| coated(s, 0.0)), ("white under a coat 0.3", 8, &|s| coated(s, 0.3))]);
}

/// A coat that points elsewhere than white paint or a mirror under it loses nothing and makes nothing.
#[test]
fn coats_of_other_normals_in_uniform_light_cannot_be_seen() {
    let scene = furnace(|s| {
        let white = material(s, Material::Diffuse { reflectance: flat(1.0).into() });
        let mirror = material(s, Material::Conductor { eta: flat(1e-6), k: flat(10.0), alpha: 0.0 });
        let coats = coats_that_point_elsewhere(s, [(white, 0.0), (white, 0.4), (mirror, 0.0)]);
        for (m, x) in coats.into_iter().zip([-0.7, 0.0, 0.7]) {
            shape(s, m, ball(dvec3(x, 0.0, 0.0), 0.35));
        }
    });
    cannot_be_seen("coats of other normals", &scene, 32);
}

/// Paint of which it is known how it looks, under a coat and tinted by the colours of vertices, in uniform light: the coat's own reflection, and of what
/// gets through it that colour.
#[test]
fn the_colour_that_is_seen_is_what_gets_through_a_coat_times_that() {
    for (degrees, alpha) in [(0.0f64, 0.0), (70.0, 0.0), (50.0, 0.5)] {
        let (sin, mu) = degrees.to_radians().sin_cos();
        let mut s = scene(16, 16, 4, orthographic(dvec3(0.0, mu, sin + 1e-3), DVec3::ZERO, 0.1));
        let picture = texture(numbers(&[0.8], 1, 1, 1.0), [Wrap::Clamp; 2], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        s.materials[0] = Material::Diffuse { reflectance: on(ImageTexture { tinted: true, ..picture }) };
        let m = material(
            &mut s,
            Material::Coated { base: 0, ior: Ior::constant(1.5), alpha, seen: true, normals: CoatNormals::OfBase },
        );
        // A sigmoid of 0 is a half.
        let Geometry::Mesh(floor) = quad(dvec3(-1.0, 0.0, 1.0), DVec3::X * 2.0, DVec3::Z * -2.0) else { unreachable!("a mesh") };
        let mesh = Mesh { colors: vec![[0.0, 0.0, 0.0, 0.5]; 4], ..Mesh::clone(&floor) };
        shape(&mut s, m, Geometry::Mesh(Arc::new(mesh)));
        s.lights.push(Light::Constant { radiance: flat(1.0) });
        let energy = EnergyTable::coat(alpha);
        let coat = Coat { eta: 1.5, rough: (alpha > 0.0).then_some((alpha, &energy)), seen: true };
        let entered = coat.transmittance(mu);
        let exact = 1.0 - entered + entered * 0.8 * 0.25;
        for (bin, f) in gpu(&s, 3, 64).figures().bins.iter().enumerate() {
            println!("{degrees} degrees, alpha {alpha}: bin {bin}: {} +- {}, exact {exact}", f.mean, f.error);
            assert!((f.mean - exact).abs() < threshold(4, f.dof) * f.error + 2e-3, "{degrees} degrees: {f:?}, not {exact}");
            assert!(f.error < 5e-3, "{f:?} tells nothing");
        }
    }
}

/// Sheen over black and over white in uniform light, seen at three angles: its own albedo, and together never more than all light.
#[test]
fn sheen_in_uniform_light_is_as_bright_as_its_albedo() {
    for (mu, alpha) in [(0.03f64, 0.02), (0.25, 0.3), (0.9, 1.0)] {
        let sheen = Sheen::new(alpha, 0.9);
        let wi = dvec3((1.0 - mu * mu).sqrt(), 0.0, mu);
        // The midpoint rule over the root of the cosine and the azimuth.
        let (mut own, mut below) = (0.0, 0.0);
        for i in 0..400 {
            let x = (f64::from(i) + 0.5) / 400.0;
            let (z, r) = (x * x, (1.0 - x.powi(4)).sqrt());
            below += 4.0 * x * z * sheen.over(mu, z) / 400.0;
            for k in 0..200 {
                let phi = PI * (f64::from(k) + 0.5) / 200.0;
                own += 4.0 * PI * x * sheen.eval(wi, dvec3(r * phi.cos(), r * phi.sin(), z)) / 80_000.0;
            }
        }
        for (rho, exact) in [(0.0, 0.9 * own), (1.0, 0.9 * own + below)] {
            let mut s = scene(16, 16, 4, orthographic(10.0 * dvec3(0.0, mu, (1.0 - mu * mu).sqrt()), DVec3::ZERO, 0.1));
            s.materials[0] = Material::Diffuse { reflectance: flat(rho).into() };
            let m = material(&mut s, Material::Sheen { base: 0, color: flat(0.9), alpha });
            shape(&mut s, m, disc(DVec3::ZERO, DVec3::Y, 3.0));
            s.lights.push(Light::Constant { radiance: flat(1.0) });
            for (bin, f) in gpu(&s, 3, 64).figures().bins.iter().enumerate() {
                println!("mu {mu} alpha {alpha} over {rho}: bin {bin}: {} +- {}, exact {exact}", f.mean, f.error);
                assert!((f.mean - exact).abs() < threshold(4, f.dof) * f.error + 1e-3, "mu {mu} over {rho}: {f:?}, not {exact}");
                assert!(f.error < 5e-3 && f.mean < 1.001, "mu {mu} over {rho}: {f:?}");
            }
        }
    }
}

/// Uniform light mirrored at 40 degrees by titanium with an oxide on it: in each of 20 bins what Airy's formula says.
#[test]
fn a_film_on_metal_has_its_colours() {
    let mut s = scene(16, 16, 20, orthographic(dvec3(0.0, 40f64.to_radians().cos(), 40f64.to_radians().sin()), DVec3::ZERO, 0.1));
    let metal = material(&mut s, Material::Conductor { eta: flat(1.9), k: flat(2.6), alpha: 0.0 });
    let film = ThinFilm { ior: Ior::constant(2.5), thickness_nm: 160.0 };
    s.thin_films.insert(metal, film.clone());
    shape(&mut s, metal, disc(DVec3::ZERO, DVec3::Y, 1.0));
    s.lights.push(Light::Constant { radiance: flat(1.0) });
    let figures = gpu(&s, 3, 64).figures();
    for (bin, f) in figures.bins.iter().enumerate() {
        let at = |i: u32| s.film.bins.edge_nm(bin as u32) + s.film.bins.width_nm() * (f64::from(i) + 0.5) / 100.0;
        let exact =
            (0..100).map(|i| film.between(1.0, (1.9, 2.6), at(i)).reflectance(40f64.to_radians().cos())).sum::<f64>() / 100.0;
        assert!((f.mean - exact).abs() < threshold(20, f.dof) * f.error + 1e-4, "bin {bin}: {f:?} instead of {exact}");
        assert!(f.error < 2e-3, "bin {bin}: {f:?} tells nothing");
    }
}

/// Parallel light on a floor seen from straight above through a pane that hardly reflects: only merging finds it, as much of it as coats let in and out.
#[test]
fn paint_under_a_coat_seen_through_glass_is_as_bright_as_its_coat_lets_it_be() {
    let (rho, mu) = (0.5, 30f64.to_radians().cos());
    for alpha in [0.0, 0.4] {
        let mut s = scene(16, 16, 4, orthographic(dvec3(0.0, 1.0, 0.0), DVec3::ZERO, 0.5));
        s.materials[0] = Material::Diffuse { reflectance: flat(rho).into() };
        let coated = material(
            &mut s,
            Material::Coated { base: 0, ior: Ior::constant(2.0), alpha, seen: false, normals: CoatNormals::OfBase },
        );
        let floor = material(&mut s, Material::Mix { a: coated, b: 0, weight: flat(0.75).into() });
        shape(&mut s, floor, disc(DVec3::ZERO, DVec3::Y, 2.0));
        let pane = glass(&mut s, solid("pane", 1.005, 1), 0.0);
        shape(&mut s, pane, cuboid(dvec3(-5.0, 0.4, -5.0), dvec3(5.0, 0.5, 5.0)));
        let direction = dvec3(0.5, -mu, 0.0);
        s.lights.push(Light::Beam { origin: direction * -1.5, direction, radius: 1.0, irradiance: flat(1.0) });
        let energy = EnergyTable::coat(alpha);
        let coat = Coat { eta: 2.0, rough: (alpha > 0.0).then_some((alpha, &energy)), seen: false };
        let exact = mu / PI * (0.75 * coat.over_diffuse(rho, mu, 1.0) + 0.25 * rho);
        for (bin, f) in gpu(&s, 3, 8).figures().bins.iter().enumerate() {
            let limit = threshold(4, f.dof) * f.error + 5e-3 * exact;
            println!("coat {alpha}: bin {bin}: {} +- {}, exact {exact}", f.mean, f.error);
            assert!((f.mean - exact).abs() < limit, "coat {alpha}: bin {bin}: {f:?} instead of {exact}");
            assert!(f.error < 5e-3 * exact, "coat {alpha}: bin {bin}: {f:?} tells nothing");
        }
    }
}

/// Likewise under sheen, whose own reflection is not found so.
#[test]
fn paint_under_sheen_seen_through_glass_is_as_bright_as_its_sheen_lets_it_be() {
    let (rho, mu) = (0.5, 15f64.to_radians().sin());
    let mut s = scene(16, 16, 4, orthographic(dvec3(0.0, 1.0, 0.0), DVec3::ZERO, 0.5));
    s.materials[0] = Material::Diffuse { reflectance: flat(rho).into() };
    let floor = material(&mut s, Material::Sheen { base: 0, color: flat(0.8), alpha: 0.5 });
    shape(&mut s, floor, disc(DVec3::ZERO, DVec3::Y, 2.0));
    let pane = glass(&mut s, solid("pane", 1.005, 1), 0.0);
    shape(&mut s, pane, cuboid(dvec3(-5.0, 0.4, -5.0), dvec3(5.0, 0.5, 5.0)));
    let direction = dvec3((1.0 - mu * mu).sqrt(), -mu, 0.0);
    s.lights.push(Light::Beam { origin: direction * -3.0, direction, radius: 1.0, irradiance: flat(1.0) });
    let sheen = Sheen::new(0.5, 0.8);
    // What little the pane reflects at this angle.
    let pane = 1.0 - fresnel::thin_pane(mu, 1.005);
    let exact = pane * mu / PI * rho * sheen.over(mu, 1.0);
    assert!(sheen.over(mu, 1.0) < 0.7, "little to tell");
    for (bin, f) in gpu(&s, 3, 8).figures().bins.iter().enumerate() {
        println!("bin {bin}: {} +- {}, exact {exact}", f.mean, f.error);
        assert!((f.mean - exact).abs() < threshold(4, f.dof) * f.error + 5e-3 * exact, "bin {bin}: {f:?} instead of {exact}");
        assert!(f.error < 5e-3 * exact, "bin {bin}: {f:?} tells nothing");
    }
}

#[test]
fn fog_that_only_scatters_in_uniform_light_cannot_be_seen() {
    let fog = furnace(|s| {
        s.interiors.push(Interior { sigma_s: ramp(0.3, 1.5), g: 0.4, ..solid("fog", 1.0, 0) });
        let m = material(s, Material::Boundary { interior: Some(1) });
        shape(s, m, sphere(DVec3::ZERO, 1.0));
    });
    cannot_be_seen("fog", &fog, 8);
}

/// Dispersion that tends to nothing leaves the picture that glass of one index gives, without a tint: every bin, its error small enough to count.
#[test]
#[ignore = "long: in tools/soak"]
fn glass_that_hardly_disperses_is_as_glass_that_does_not() {
    let room_with = |coef_um: Vec<f64>, seed, spp| {
        let mut s = room(4, 16);
        let m = glass(&mut s, Interior { ior: Ior::new(Formula::Cauchy { coef_um }), ..solid("glass", 1.0, 1) }, 0.0);
        shape(&mut s, m, sphere(dvec3(0.0, 0.65, 0.2), 0.55));
        gpu(&s, seed, spp).figures()
    };
    let one = room_with(vec![1.6], 4, 112);
    for (b, seed) in [(1e-6, 5), (1e-12, 6)].into_iter().take(sweep::count(1)) {
        agree(&format!("B = {b:e} um^2"), &pairs(&room_with(vec![1.6, b], seed, 256), &one, 1.0), 1.0);
    }
}

/// A laser line of 0.1 nm across the edge of two bins gives each of them its share of what a lamp of radiance 1 gives.
#[test]
fn a_narrow_line_at_the_edge_of_a_bin_goes_to_both_bins() {
    let room_under = |radiance: Spectrum, seed| {
        let mut s = room(6, 16);
        s.materials[0] = Material::Diffuse { reflectance: flat(0.6).into() };
        let lamp_material = material(&mut s, Material::Diffuse { reflectance: flat(0.0).into() });
        s.shapes[2].material = lamp_material;
        s.shapes[2].emission = Some(Emission { radiance: radiance.into(), two_sided: false });
        let m = glass(&mut s, solid("glass", 1.5, 1), 0.0);
        shape(&mut s, m, sphere(dvec3(0.0, 1.1, 0.2), 0.3));
        gpu(&s, seed, 64)
    };
    let flat = room_under(flat(1.0), 5);
    // From 549.97 to 550.07 nm; bins of 50 nm, two of which meet at 550.
    let line = room_under(Spectrum::Band { center_nm: 550.02, width_nm: 0.1, height: 1000.0 }, 6);
    for (bin, share) in [0.0, 0.0, 0.6, 1.4, 0.0, 0.0].into_iter().enumerate() {
        let (line, mut expected) = (line.figures().bins[bin], flat.figures().bins[bin]);
        expected.mean *= share;
        expected.error *= share;
        let (z, error, dof) = against(line, expected);
        assert!(z.abs() < threshold(6, dof), "bin {bin}: {line:?} is not {expected:?}, z = {z}");
        assert!(error <= 0.01 * expected.mean, "bin {bin}: {line:?} tells nothing");
    }
}
