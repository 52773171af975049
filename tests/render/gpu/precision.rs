//! The shaders' routines in single precision against double precision, over random and adversarial inputs, by their backward error: what a routine
//! returns must be what double precision returns for inputs that differ by at most k units of 2^-24. Near total reflection, at grazing
//! incidence or on needles no bound on the result itself could hold.
//!
//! Dispersion formulas are not here: the host evaluates them in double precision, once per pass.
//!
//! A sweep takes more inputs of each routine.

use super::support::*;
use crate::adapter;
use abbe::bsdf::thin_film::Stack;
use abbe::bsdf::{fresnel, phase};
use abbe::gpu::scene::GpuScene;
use abbe::gpu::{Gpu, Resource};
use abbe::integrator::{Plan, Techniques};
use glam::{DVec3, Vec3, Vec4, dvec3};
use serde_json::json;

/// Half a unit in the last place of numbers from 1 to 2.
const U: f64 = 1.0 / (1 << 24) as f64;

/// Inputs of each routine.
fn sweep() -> usize {
    usize::next_multiple_of(crate::sweep::count(1 << 14), 64)
}

/// Runs `body`, which reads `rows` texels from `2-dimensional` inputs as `a`, `b`, .. and assigns a vec4f to `result`, over all inputs.
fn run(gpu: &Gpu, head: &str, body: &str, rows: usize, inputs: &[Vec4], more: &[(&str, &Resource)]) -> Vec<[f64; 4]> {
    let names = ["a", "b", "c", "d", "e"];
    let reads: String = (0..rows).map(|i| format!("let {} = load_inputs({rows}u * id.x + {i}u);\n", names[i])).collect();
    let inputs_table = with_tables("@group(0) @binding(40) var inputs: Table<vec4f>;");
    let source = format!(
        "{head}
        {inputs_table}        @group(0) @binding(41) var<storage, read_write> out: array<vec4f>;
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3u) {{
            {reads}
            var result = vec4f(0.0);
            {body}
            out[id.x] = result;
        }}\n"
    );
    let count = inputs.len() / rows;
    let table = gpu.table("inputs", inputs).unwrap();
    let words = run_kernel(gpu, source, &[more, &[("inputs", &table)]].concat(), 4 * count, count as u32 / 64);
    words.chunks_exact(4).map(|w| [0, 1, 2, 3].map(|i| f64::from(f32::from_bits(w[i])))).collect()
}

/// The least k for which `value` lies among `f` over a box of half widths `k U` times `size` around `at`, widened by `k U` of itself; beyond 256
/// infinity.
fn backward_error<const N: usize>(value: f64, f: impl Fn([f64; N]) -> f64, at: [f64; N], size: [f64; N]) -> f64 {
    for k in 1..=256 {
        let step = f64::from(k) * U;
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..5usize.pow(N as u32) {
            // Five places along each axis.
            let place = |axis: usize| (i / 5usize.pow(axis as u32) % 5) as f64 / 2.0 - 1.0;
            let v = f(std::array::from_fn(|axis| at[axis] + place(axis) * step * size[axis]));
            range = (range.0.min(v), range.1.max(v));
        }
        if value >= range.0 - step * range.0.abs() && value <= range.1 + step * range.1.abs() {
            return f64::from(k);
        }
    }
    f64::INFINITY
}

/// Prints and asserts the greatest of `errors`.
fn held(what: &str, inputs: &[Vec4], errors: impl Iterator<Item = f64>, most: f64) {
    let errors: Vec<f64> = errors.map(|e| if e.is_nan() { f64::INFINITY } else { e }).collect();
    let (worst, greatest) = errors.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("inputs");
    println!("{what}: backward error at most {greatest:.1} units of 2^-24 over {} inputs, {most} allowed", errors.len());
    let rows = inputs.len() / errors.len();
    assert!(*greatest <= most, "{what}: backward error {greatest} for {:?}", &inputs[worst * rows..(worst + 1) * rows]);
}

/// Something in [0, 1], often so close to `near` that only few bits tell them apart.
fn close_to(random: &mut Random, near: f64) -> f64 {
    let x = match (random.next() * 4.0) as u32 {
        0 => random.next(),
        1 => near,
        2 => near + (random.next() - 0.5) * 0.1f64.powf(1.0 + 6.0 * random.next()),
        _ => f64::from(f32::from_bits((near as f32).to_bits().wrapping_add((random.next() * 9.0) as u32).wrapping_sub(4))),
    };
    if x.is_finite() { x.clamp(0.0, 1.0) } else { near }
}

fn head(scattering: bool) -> String {
    let scene = scene_of(json!({}));
    let mut features = Plan::new(&scene, Techniques::default()).camera.switches();
    features.insert("CONDUCTOR", true);
    features.insert("SCATTERING", scattering);
    prelude() + &shader_file("bsdf/fresnel.wgsl", &features)
}

#[test]
fn fresnel_reflectance_is_that_of_inputs_a_few_units_away() {
    let gpu = adapter::gpu();
    let mut random = Random(1);
    let inputs: Vec<Vec4> = (0..sweep())
        .map(|i| {
            // Indices on both sides of 1, and within few units of it; cosines around the critical angle, grazing and normal incidence.
            let eta = [0.3 + 3.0 * random.next(), 1.0 / 1.5, 1.0 + (random.next() - 0.5) * 1e-6, 1.0][i % 4] as f32;
            let critical = (1.0 - f64::from(eta).powi(2)).max(0.0).sqrt();
            let near = [critical, 0.0, 1.0][(random.next() * 3.0) as usize];
            Vec4::new(close_to(&mut random, near) as f32, eta, 0.0, 0.0)
        })
        .collect();
    let found = run(&gpu, &head(false), "result = fresnel_dielectric(a.x, vec4f(a.y));", 1, &inputs, &[]);
    let errors = inputs.iter().zip(&found).map(|(v, r)| {
        let [c, eta] = [f64::from(v.x), f64::from(v.y)];
        // Born & Wolf 1.5.21, with the transmitted cosine so that it keeps its digits at grazing incidence on almost the same index.
        let exact = |[c, eta]: [f64; 2]| {
            let (c, squared) = (c.max(0.0), (eta - 1.0) * (eta + 1.0) + c * c);
            if squared <= 0.0 {
                return 1.0;
            }
            // eta times the cosine.
            let t = squared.sqrt();
            let (s, p) = ((c - t) / (c + t), (eta * eta * c - t) / (eta * eta * c + t));
            0.5 * (s * s + p * p)
        };
        backward_error(r[0], exact, [c, eta], [1.0, eta])
    });
    held("fresnel", &inputs, errors, 4.0);
}

#[test]
fn reflectance_of_metals_is_that_of_inputs_a_few_units_away() {
    let gpu = adapter::gpu();
    let mut random = Random(2);
    let inputs: Vec<Vec4> = (0..sweep())
        .map(|i| {
            let (eta, k) = ([0.05 + 4.0 * random.next(), 0.2][i % 2], [8.0 * random.next(), 3.0][i / 2 % 2]);
            let near = (random.next() * 2.0).floor();
            Vec4::new(close_to(&mut random, near) as f32, eta as f32, k as f32, 0.0)
        })
        .collect();
    let found = run(&gpu, &head(false), "result = fresnel_conductor(a.x, vec4f(a.y), vec4f(a.z));", 1, &inputs, &[]);
    let errors = inputs.iter().zip(&found).map(|(v, r)| {
        let [c, eta, k] = [v.x, v.y, v.z].map(f64::from);
        backward_error(r[0], |[c, eta, k]| fresnel::conductor(c.clamp(0.0, 1.0), eta, k), [c, eta, k], [1.0, eta, k])
    });
    held("metal", &inputs, errors, 8.0);
}

/// The phase of a film is rounded before its sine is taken, so that a bound on the result itself is what can be held here.
#[test]
fn films_reflect_what_they_do_in_double_precision() {
    let gpu = adapter::gpu();
    let mut random = Random(6);
    let inputs: Vec<Vec4> = (0..sweep())
        .flat_map(|i| {
            let near = (random.next() * 3.0).floor();
            let cos = close_to(&mut random, [0.0, 0.5, 1.0][near as usize]) as f32;
            let [near, film, far] = [1.0 + 0.5 * random.next(), 1.0 + 1.5 * random.next(), 1.0 + 2.0 * random.next()];
            let [waves, k] = [3.0 * random.next(), [0.0, 5.0 * random.next()][i % 2]];
            [Vec4::new(cos, near as f32, film as f32, waves as f32), Vec4::new(far as f32, k as f32, 0.0, 0.0)]
        })
        .collect();
    let body = "result = fresnel_film(a.x, vec4f(a.y), vec4f(a.z), vec4f(a.w), vec4f(b.x), vec4f(b.y));";
    let plan = Plan::new(&scene_of(json!({})), Techniques::default());
    let head = prelude() + &plan.constants() + &shader_file("bsdf/thin_film.wgsl", &plan.camera.switches());
    let mut worst = 0.0f64;
    for (v, r) in inputs.chunks_exact(2).zip(run(&gpu, &head, body, 2, &inputs, &[])) {
        let [near, film, waves] = [v[0].y, v[0].z, v[0].w].map(f64::from);
        let stack = Stack { near, film, waves, far: (f64::from(v[1].x), f64::from(v[1].y)) };
        let off = (r[0] - stack.reflectance(f64::from(v[0].x))).abs();
        assert!(off < 1e-3, "{stack:?} at {}: {} is off by {off}", v[0].x, r[0]);
        worst = worst.max(off);
    }
    println!("films: off by {worst:.1e} at most");
}

#[test]
fn refracted_directions_are_those_of_inputs_a_few_units_away() {
    let gpu = adapter::gpu();
    let mut random = Random(3);
    let unit = |random: &mut Random| dvec3(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5).normalize_or(DVec3::X);
    let inputs: Vec<Vec4> = (0..sweep())
        .flat_map(|i| {
            let n = [unit(&mut random), DVec3::Y, dvec3(1e-4, 1.0, 0.0).normalize()][i % 3].as_vec3().normalize();
            let eta = [0.4 + 2.0 * random.next(), 1.0 / 1.5168, 1.0, 1.5][i % 4] as f32;
            let critical = (1.0 - f64::from(eta).powi(2)).max(0.0).sqrt();
            let near = [critical, 0.0, 1.0][(random.next() * 3.0) as usize];
            let cos = close_to(&mut random, near);
            let across = unit(&mut random).cross(n.as_dvec3()).normalize_or(n.as_dvec3().any_orthonormal_vector());
            let d = (across * (1.0 - cos * cos).sqrt() - n.as_dvec3() * cos).as_vec3().normalize();
            [n.extend(eta), d.extend(0.0)]
        })
        .collect();
    let body = "let cos_i = min(-dot(b.xyz, a.xyz), 1.0);
        let cos_t2 = cos_transmitted_squared(cos_i, vec4f(a.w)).x;
        result = vec4f(refracted_direction(b.xyz, a.xyz, cos_i, a.w, cos_t2), cos_t2);";
    let found = run(&gpu, &head(false), body, 2, &inputs, &[]);
    let mut through = 0;
    let errors: Vec<f64> = inputs
        .chunks_exact(2)
        .zip(&found)
        .map(|(v, r)| {
            let (n, d, eta) = (v[0].truncate().as_dvec3(), v[1].truncate().as_dvec3(), f64::from(v[0].w));
            let t = dvec3(r[0], r[1], r[2]);
            let cos = -d.dot(n);
            let squared = |[c, eta]: [f64; 2]| (eta * eta - 1.0 + c * c) / (eta * eta);
            // A unit of the direction's components is one of its cosine.
            let decided = backward_error(r[3], squared, [cos, eta], [1.0 + cos, 1.0 + eta]);
            if r[3] <= 0.0 || cos <= 0.0 {
                return if cos <= 0.0 { 0.0 } else { decided };
            }
            through += 1;
            // Components are rounded to units, be they ever so small.
            let along =
                backward_error((-t.dot(n)).max(0.0), |at| squared(at).max(0.0).sqrt(), [cos, eta], [1.0 + cos, 1.0 + eta]);
            let aside = ((t - n * t.dot(n)) - (d + n * cos) / eta).length() / (U * (1.0 + 1.0 / eta));
            decided.max(along).max(aside).max(t.dot(n) / U)
        })
        .collect();
    assert!(through * 3 > errors.len(), "{through} of {} pass", errors.len());
    held("refraction", &inputs, errors.into_iter(), 8.0);
}

#[test]
fn the_phase_function_is_that_of_inputs_a_few_units_away() {
    let gpu = adapter::gpu();
    let mut random = Random(4);
    let inputs: Vec<Vec4> = (0..sweep())
        .map(|i| {
            let g = [2.0 * random.next() - 1.0, 0.999, -0.999, 0.0][i % 4] as f32;
            let near = (random.next() * 2.0).floor();
            Vec4::new((2.0 * close_to(&mut random, near) - 1.0) as f32, g.clamp(-0.999, 0.999), 0.0, 0.0)
        })
        .collect();
    let scene = scene_of(json!({}));
    let mut features = Plan::new(&scene, Techniques::default()).camera.switches();
    features.insert("SCATTERING", true);
    // Of the file only the phase function: the rest needs a scene.
    let file = shader_file("medium/phase.wgsl", &features);
    let function = file.split("fn phase_hg").nth(1).and_then(|rest| rest.split("\n}\n").next()).expect("the function");
    let found =
        run(&gpu, &format!("{}fn phase_hg{function}\n}}\n", head(true)), "result.x = phase_hg(a.x, a.y);", 1, &inputs, &[]);
    let errors = inputs.iter().zip(&found).map(|(v, r)| {
        let [c, g] = [f64::from(v.x), f64::from(v.y)];
        backward_error(r[0], |[c, g]| phase::eval_hg(c.clamp(-1.0, 1.0), g), [c, g], [1.0, 1.0])
    });
    held("phase function", &inputs, errors, 8.0);
}

/// A kernel that intersects one primitive of its own with one ray of its own.
fn intersections(gpu: &Gpu, call: &str, rows: usize, inputs: &[Vec4]) -> Vec<[f64; 4]> {
    let scene = scene_of(json!({"shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.1}, "material": "wall"}]}));
    let uploaded = GpuScene::new(gpu, &scene, true).unwrap();
    let mut features = Plan::new(&scene, Techniques::default()).camera.switches();
    features.insert("CONTACT", false);
    let head = prelude()
        + &Plan::new(&scene, Techniques::default()).constants()
        + &uploaded.constants
        + &shader_file("geometry/trace.wgsl", &features);
    let body = format!(
        "var ray = Ray(a.xyz, INFINITE, b.xyz, NONE, NONE, false);
        var hit = no_hit(ray.t_max);
        {call}
        result = vec4f(select(-1.0, hit.t, hit.primitive != NONE), hit.bary, 0.0);"
    );
    run(gpu, &head, &body, rows, inputs, &[])
}

/// Distance of `p` from the segment from `a` to `b`.
fn from_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let e = b - a;
    let t = if e.length_squared() > 0.0 { ((p - a).dot(e) / e.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + e * t)
}

#[test]
fn triangles_are_met_where_they_are_or_a_few_units_away() {
    let gpu = adapter::gpu();
    let mut random = Random(5);
    let point = |random: &mut Random, size: f64| dvec3(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5) * size;
    let inputs: Vec<Vec4> = (0..sweep())
        .flat_map(|i| {
            let at = point(&mut random, 2.0);
            let size = [1.0, 1e-3, 0.3, 3.0][i % 4];
            let mut p = [0; 3].map(|_| at + point(&mut random, size));
            if i % 5 == 0 {
                // A needle.
                p[2] = p[0].lerp(p[1], random.next()) + point(&mut random, 1e-6);
            }
            let p = p.map(|p| p.as_vec3());
            let o = point(&mut random, 4.0).as_vec3();
            let [w, v] = [random.next(), random.next()].map(|x| x as f32);
            let target = match i % 3 {
                0 => p[0].lerp(p[1], w),
                1 => p[0].lerp(p[1], w).lerp(p[2], v),
                _ => point(&mut random, 3.0).as_vec3(),
            };
            let d = (target - o).normalize_or(Vec3::X);
            [o.extend(0.0), d.extend(0.0), p[0].extend(0.0), p[1].extend(0.0), p[2].extend(0.0)]
        })
        .collect();
    let found = intersections(&gpu, "intersect_triangle(ray, 7u, c.xyz, d.xyz, e.xyz, &hit);", 5, &inputs);
    let mut hits = 0;
    let errors: Vec<f64> = inputs
        .chunks_exact(5)
        .zip(&found)
        .map(|(v, r)| {
            let [o, d, p0, p1, p2] = [0, 1, 2, 3, 4].map(|i| v[i].truncate().as_dvec3());
            let n = (p1 - p0).cross(p2 - p0);
            let size = [o, p0, p1, p2].map(|p| p.abs().max_element()).into_iter().fold(0.0, f64::max);
            let facing = n.dot(d).abs() / n.length();
            let edges = [p1 - p0, p2 - p1, p0 - p2].map(DVec3::length).into_iter().fold(0.0, f64::max);
            // A needle's plane turns about its length when its vertices move: as many times more as it is longer than high.
            let unit = U * size * (edges * edges / n.length());
            let t = (p0 - o).dot(n) / d.dot(n);
            let edges = [(p0, p1), (p1, p2), (p2, p0)];
            let rim = |p: DVec3| edges.map(|(a, b)| from_segment(p, a, b)).into_iter().fold(f64::INFINITY, f64::min);
            let inside = |p: DVec3| edges.iter().all(|(a, b)| (*b - *a).cross(p - *a).dot(n) >= 0.0);
            // Distance across the ray: the rim as the ray sees it is nearer by the cosine.
            if facing.is_nan() || facing <= 1e-3 {
                return 0.0;
            }
            let exact = o + d * t;
            if r[0] < 0.0 {
                let hit = t > 0.0 && inside(exact);
                return if hit { rim(exact).min(t) * facing / unit } else { 0.0 };
            }
            hits += 1;
            let p = o + d * r[0];
            let off_plane = (p - p0).dot(n).abs() / n.length();
            let off_rim = if inside(exact) { 0.0 } else { rim(exact) * facing };
            off_plane.max(off_rim) / unit
        })
        .collect();
    assert!(hits * 4 > errors.len(), "{hits} of {}", errors.len());
    held("triangle", &inputs, errors.into_iter(), 8.0);
}

#[test]
fn spheres_are_met_where_they_are_or_a_few_units_away() {
    let gpu = adapter::gpu();
    let mut random = Random(6);
    let point = |random: &mut Random, size: f64| dvec3(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5) * size;
    let inputs: Vec<Vec4> = (0..sweep())
        .flat_map(|i| {
            let center = point(&mut random, 2.0);
            let radius = [1.0, 1e-3, 0.3, 100.0][i % 4] * (0.5 + random.next());
            // From far off, near by, inside and on it.
            let way = point(&mut random, 1.0).normalize_or(DVec3::X);
            let o = center + way * (radius * [1000.0, 2.0, 0.5, 1.0][i / 4 % 4]);
            let across = way.any_orthonormal_vector();
            // Through the middle, anywhere, and as a tangent.
            let target = center + across * radius * [0.0, random.next(), 1.0, 1.0 - 1e-6 * random.next()][i / 16 % 4];
            let d = (target - o).as_vec3().normalize_or(Vec3::X);
            [o.as_vec3().extend(0.0), d.extend(0.0), center.as_vec3().extend(radius as f32)]
        })
        .collect();
    let call = "intersect_quadric(ray, 7u, PRIMITIVE_SPHERE, c.xyz, vec3f(0.0), vec3f(c.w, 0.0, 0.0), &hit);";
    let found = intersections(&gpu, call, 3, &inputs);
    let mut hits = 0;
    let errors: Vec<f64> = inputs
        .chunks_exact(3)
        .zip(&found)
        .map(|(v, r)| {
            let [o, d, center] = [0, 1, 2].map(|i| v[i].truncate().as_dvec3());
            let radius = f64::from(v[2].w);
            let unit = U * o.abs().max_element().max(center.abs().max_element() + radius);
            let d = d.normalize();
            let nearest = (o - center) - d * (o - center).dot(d);
            // How far the sphere's rim is from the ray, where one is found and the other not.
            let grazes = (nearest.length() - radius).abs();
            let behind = (o - center).dot(d) > 0.0;
            let outside = o.distance(center) - radius;
            if r[0] < 0.0 {
                let hit = nearest.length() < radius && (outside < 0.0 || !behind);
                return if hit { grazes.min(outside.abs()) / unit } else { 0.0 };
            }
            hits += 1;
            ((o + d * r[0]).distance(center) - radius).abs().min(grazes.max(unit)) / unit
        })
        .collect();
    assert!(hits * 3 > errors.len(), "{hits} of {}", errors.len());
    held("sphere", &inputs, errors.into_iter(), 16.0);
}

#[test]
fn a_ray_that_only_touches_a_sphere_or_a_cylinder_crosses_nothing() {
    let gpu = adapter::gpu();
    // Past the rim by nothing at all, and inside it by as little as single precision has.
    let rims = [1.0, 1.0f32.next_down()];
    let inputs: Vec<Vec4> =
        (0..64).flat_map(|i| [Vec4::new(-2.0, rims[i % 2], 0.0, 0.0), Vec4::new(1.0, 0.0, 0.0, 0.0)]).collect();
    for (kind, size) in [("SPHERE", "1.0, 0.0, 0.0"), ("CYLINDER", "1.0, 1.0, 0.0")] {
        let call =
            format!("intersect_quadric(ray, 7u, PRIMITIVE_{kind}, vec3f(0.0), vec3f(0.0, 0.0, 1.0), vec3f({size}), &hit);");
        let found = intersections(&gpu, &call, 2, &inputs);
        assert!(found.iter().enumerate().all(|(i, r)| (r[0] > 0.0) == (i % 2 == 1)), "{kind}: {found:?}");
    }
}
