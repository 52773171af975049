//! Samples that must not reach the film are dropped, each counted for what it is, and sums that cannot be held are not wrapped.

use super::support::*;
use crate::adapter;
use abbe::gpu::Kernel;
use abbe::gpu::layout::{
    COUNTER_NEGATIVE, COUNTER_NOT_FINITE, COUNTER_SATURATED, COUNTER_UNFINISHED, COUNTERS, Params, PassHead, WorkGroup, WorkItem,
    texels,
};
use abbe::gpu::scene::GpuScene;
use abbe::integrator::{Plan, Techniques};
use abbe::render::Integrator;
use abbe::scene::{Light, Texture};
use abbe::spectrum::Spectrum;
use glam::Vec4;
use serde_json::json;

/// The kernel that updates the film, given samples of which some are bad.
#[test]
fn what_is_no_radiance_is_dropped_and_counted_by_its_cause() {
    let gpu = adapter::gpu();
    let scene = scene_of(json!({"film": {"width": 8, "height": 8, "bins": 4}}));
    let (plan, uploaded) = (Plan::new(&scene, Techniques::default()), GpuScene::new(&gpu, &scene, true).unwrap());
    let constants = plan.constants() + &uploaded.constants;
    let kernel = Kernel::new(&gpu, "update_film.wgsl", &constants, &plan.camera.switches()).unwrap();
    let stride = texels::<PassHead>() + uploaded.rows.len() as u32;
    // Two samples of each of 64 pixels: a good one, and one by what the pixel's number says. -3e38 stands for a sample that did not finish.
    let bad = [f32::NAN, 1e30, -1.0, -3.0e38, 2.0];
    let second = (0..64).map(|pixel| Vec4::new(bad[pixel % 5], 1.0, 1.0, 1.0));
    let samples: Vec<Vec4> = std::iter::repeat_n(Vec4::ONE, 64).chain(second).collect();
    let params = Params {
        tile_width: 8,
        tile_height: 8,
        samples: 2,
        group_step: 1,
        first_work_group: texels::<WorkItem>(),
        spectra_stride: stride,
        ..Params::default()
    };
    // One unit, both samples of the one block, and a group of it.
    let item = WorkItem { count: 2, weight: 1.0, ..Default::default() };
    let group = WorkGroup { end: 1, samples: 2, ..Default::default() };
    let work = [bytemuck::cast_slice::<_, u32>(&[item]), bytemuck::cast_slice(&[group])].concat();
    let work = gpu.table("work items", &work).unwrap();
    let uniforms = gpu.uniform("params", std::mem::size_of::<Params>() as u64);
    gpu.write(&uniforms, &[params]);
    let counters = gpu.empty_storage("counters", 4 * COUNTERS as u64).unwrap();
    let film = gpu.empty_storage("film", 4 * 64 * 7).unwrap();
    let table = gpu.table("spectra", &vec![Vec4::ONE; 2 * stride as usize]).unwrap();
    let samples = gpu.table("samples", &samples).unwrap();
    let wavelength_bins = gpu.storage("wavelength bins", &[0u32, 1, 2, 3, 0, 1, 2, 3]).unwrap();
    let resources = [
        ("params", &uniforms),
        ("counters", &counters),
        ("film", &film),
        ("spectra", &table),
        ("samples", &samples),
        ("work", &work),
        ("wavelength_bins", &wavelength_bins),
    ];
    let bindings = kernel.bind(&gpu, &resources).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    kernel.dispatch(&mut encoder, &bindings, 1);
    gpu.queue.submit([encoder.finish()]);
    let counts: Vec<u32> = gpu.read(&counters, 4 * COUNTERS as u64).unwrap();
    // Of 64 pixels 13 have each of the first four kinds, 12 the last.
    assert_eq!(counts[COUNTER_NOT_FINITE as usize], 13);
    assert_eq!(counts[COUNTER_SATURATED as usize], 13);
    assert_eq!(counts[COUNTER_NEGATIVE as usize], 13);
    assert_eq!(counts[COUNTER_UNFINISHED as usize], 13);
    let sums: Vec<f32> = gpu.read(&film, 4 * 64 * 7).unwrap();
    for (pixel, sums) in sums.chunks_exact(7).enumerate() {
        let added = if pixel % 5 == 4 { 2.0 } else { 0.0 };
        assert_eq!(sums[0], 1.0 + added, "pixel {pixel}");
    }
}

#[test]
fn fixed_point_sums_stay_at_their_greatest_and_are_counted() {
    let gpu = adapter::gpu();
    let file = shader_file("sensor/splat.wgsl", &Plan::new(&scene_of(json!({})), Techniques::default()).camera.switches());
    let function = file.split("fn add_to_sums").nth(1).and_then(|rest| rest.split("\n}\n").next()).expect("the function");
    // Five times 2^62 in the first bin, five times less than a quantum in the second, 2^33 + 3 in the third.
    let source = format!(
        "{}@group(0) @binding(0) var<storage, read_write> out: array<u32>;
        @group(0) @binding(1) var<storage, read_write> splats: array<atomic<u32>>;
        @group(0) @binding(2) var<storage, read_write> counters: array<atomic<u32>>;
        const NONE = 0xffffffffu;
        const WAVELENGTHS4 = 1u;
        const BINS = 4u;
        struct Quantum {{ inverse_quantum: f32 }}
        const params = Quantum(1.0);
        const sampler_pixel = 0u;
        const sampler_dimension = 0u;
        const sampler_index = 0u;
        var<private> rounding: f32;
        var<private> Ld: array<vec4f, 1>;
        fn hash2(a: u32, b: u32) -> u32 {{ return 0u; }}
        fn unit_float(x: u32) -> f32 {{ return rounding; }}
        fn one_hot(i: u32, k: u32) -> vec4f {{ return vec4f(vec4u(0u, 1u, 2u, 3u) == vec4u(i)); }}
        fn component(v: vec4f, i: u32) -> f32 {{ return v[i]; }}
        fn film_weights(i: u32) -> vec4f {{ return vec4f(1.0, 0.0, 0.0, 0.0); }}
        fn add_to_sums{function}\n}}
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3u) {{
            if (id.x == 0u) {{
                rounding = 0.5;
                Ld[0] = vec4f(0x1p+62, 0.25, 0.0, 0.0);
                for (var i = 0u; i < 5u; i++) {{
                    add_to_sums(vec2u(0u, 1u), 0u, false);
                }}
                rounding = 0.0;
                Ld[0] = vec4f(0.0, 0.0, 0x1p+33, 0.0);
                add_to_sums(vec2u(2u, 2u), 0u, false);
                Ld[0] = vec4f(0.0, 0.0, 3.0, 0.0);
                add_to_sums(vec2u(2u, 2u), 0u, false);
                for (var i = 0u; i < 6u; i++) {{
                    out[i] = atomicLoad(&splats[i]);
                }}
                out[6] = atomicLoad(&counters[COUNTER_SATURATED]);
            }}
        }}\n",
        prelude()
    );
    let splats = gpu.empty_storage("splats", 56).unwrap();
    let counters = gpu.empty_storage("counters", 4 * COUNTERS as u64).unwrap();
    let words = run_kernel(&gpu, source, &[("splats", &splats), ("counters", &counters)], 7, 1);
    assert_eq!(words[1], u32::MAX);
    assert_eq!(words[2..6], [0, 0, 3, 2]);
    // The fourth reaches 2^64 and the fifth goes beyond what the first four were cut to.
    assert_eq!(words[6], 2);
}

#[test]
fn paths_into_more_volumes_than_they_can_keep_are_counted() {
    // Balls in balls; the innermost rules. What is not among them stands apart, so that both scenes share kernels.
    let nested = |balls: u32| {
        let glass = |i: u32| (format!("glass{i}"), json!({"dielectric": {"ior": 1.1 + 0.1 * f64::from(i), "priority": i}}));
        let x = |i: u32| if i < balls { 0 } else { 1000 };
        let ball = |i: u32| json!({"sphere": {"center": [x(i), 1, 0], "radius": 1.0 - 0.1 * f64::from(i)}, "material": format!("glass{i}")});
        let scene = scene_of(json!({
            "max_depth": 12,
            "materials": (0..9).map(glass).collect::<serde_json::Map<_, _>>(),
            "shapes": (0..9).map(ball).collect::<Vec<_>>(),
            "lights": [{"constant": {"radiance": 1}}],
        }));
        let mut film = abbe::film::Film::new(&scene.film);
        adapter::integrator(&scene, 1).unwrap().render_batch(abbe::render::Batch::even(0, 4), &mut film).unwrap()
    };
    assert_eq!(nested(8).dropped(), 0);
    let crowded = nested(9);
    assert!(crowded.dropped_crowded > 0 && crowded.dropped() == crowded.dropped_crowded && crowded.is_crowded(), "{crowded:?}");
}

#[test]
fn invocations_take_as_many_samples_as_their_rays_allow() {
    // A lamp in a room of grey walls, and a room of perfect mirrors within it, in which all paths are as long as may be.
    let scene = |mirrors: bool| {
        let lamp = json!({"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 1}, "emission": {"radiance": 1}});
        let room = json!({"box": {"min": [-2.5, 0.5, -2.5], "max": [2.5, 3.5, 4.5]}, "material": "mirror"});
        scene_of(json!({
            "max_depth": 64,
            "film": {"width": 96, "height": 96, "bins": 4},
            "materials": {"mirror": {"conductor": {"reflectance": 1.0}}},
            "shapes": if mirrors { json!([room]) } else { json!([lamp]) },
        }))
    };
    let rays = |mirrors: bool| -> Vec<u64> {
        let scene = scene(mirrors);
        let (mut integrator, mut film) = (adapter::integrator(&scene, 1).unwrap(), abbe::film::Film::new(&scene.film));
        let batch = |i: u32| {
            let stats = integrator.render_batch(abbe::render::Batch::even(i, 16), &mut film).unwrap();
            assert_eq!(stats.unfinished, 0, "{stats:?}");
            stats.most_rays
        };
        (0..2).map(batch).collect()
    };
    // Nor do short batches, of which an invocation has four samples, tell of more than they had.
    let deep = scene(true);
    let (mut integrator, mut film) = (adapter::integrator(&deep, 1).unwrap(), abbe::film::Film::new(&deep.film));
    for (i, spp) in [1, 1, 1, 16].into_iter().enumerate() {
        let stats = integrator.render_batch(abbe::render::Batch::even(i as u32, spp), &mut film).unwrap();
        assert!(stats.unfinished == 0 && stats.most_rays <= 16 * 66, "batch {i}: {stats:?}");
    }
    let few = rays(false);
    // About 512, given that not all rounds are alike; twice as many at up to 65 turns of loops each would end the shader.
    assert!(few[0] < 250 && few[1..].iter().all(|&n| 2 * n > 3 * few[0] && n < 1000), "{few:?}");
    // 16 samples of 65 rays, as before anything was known.
    let many = rays(true);
    assert!(many.iter().all(|&n| n == many[0] && n > 512), "{many:?}");
}

#[test]
fn too_bright_a_lamp_and_too_short_a_path_are_counted() {
    let count = |scene: &abbe::scene::Scene| {
        let mut film = abbe::film::Film::new(&scene.film);
        let stats = adapter::integrator(scene, 1).unwrap().render_batch(abbe::render::Batch::even(0, 4), &mut film).unwrap();
        assert!((0..film.pixels()).all(|p| film.pixel(p).iter().all(|v| v.is_finite() && *v >= 0.0)));
        stats
    };
    let lamp = |radiance: f64, depth: u32| {
        scene_of(json!({
            "max_depth": depth,
            "shapes": [{"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 1}, "emission": {"radiance": radiance}}],
        }))
    };
    let fine = count(&lamp(1.0, 64));
    assert_eq!((fine.dropped(), fine.truncated), (0, 0), "{fine:?}");
    // A scene file with such a lamp is refused.
    let mut bright = lamp(1.0, 64);
    let lit = bright.shapes.iter_mut().find_map(|shape| shape.emission.as_mut()).expect("the lamp");
    lit.radiance = Texture::Uniform(Spectrum::Constant(1e30));
    let bright = count(&bright);
    assert!(bright.dropped_saturated > 0, "{bright:?}");
    let short = count(&lamp(1.0, 1));
    assert!(short.truncated > 0 && short.truncated <= short.paths, "{short:?}");
}

#[test]
fn paths_of_both_passes_are_counted_where_they_are_cut() {
    // White walls and a mirror in a closed room: with a light of no size nothing but the greatest depth ends a path.
    let scene = scene_of(json!({
        "max_depth": 6,
        "film": {"width": 28, "height": 19, "bins": 20},
        "materials": {"wall": {"diffuse": {"reflectance": 1.0}}, "mirror": {"conductor": {"reflectance": 1.0}}},
        "shapes": [{"sphere": {"center": [0, 0.8, 0], "radius": 0.5}, "material": "mirror"}],
        "lights": [{"point": {"position": [1, 3, 1], "intensity": 1}}],
    }));
    let stats = |techniques: Techniques| {
        let mut integrator = adapter::with(&scene, 1, techniques).unwrap();
        integrator.set_light_paths(0.5);
        let mut film = abbe::film::Film::new(&scene.film);
        let mut stats = abbe::stats::BatchStats::default();
        (0..8).for_each(|batch| stats += integrator.render_batch(abbe::render::Batch::even(batch, 4), &mut film).unwrap());
        stats
    };
    let plain = stats(Techniques { guiding: false, adaptive_sampling: false, ..Techniques::default() });
    assert_eq!((plain.paths, plain.light_paths), (28 * 19 * 32, 28 * 19 * 16));
    // But for a reflectance that rounding makes less than 1, which roulette may end.
    let all_cut = |s: &abbe::stats::BatchStats| (0..=4).contains(&((s.paths + s.light_paths) as i64 - s.truncated as i64));
    assert!(all_cut(&plain), "{plain:?}");
    // Guided light paths may begin where no light is; where errors are large there are more camera paths, and in all as many as are said to be.
    let best = stats(Techniques { guiding: false, ..Techniques::default() });
    assert!(all_cut(&best), "{best:?}");
    assert_ne!(best.paths, plain.paths, "samples are as many everywhere");
}

#[test]
fn splats_too_large_for_the_film_are_dropped_and_counted() {
    // What light paths alone bring: no camera path is connected to the light, or meets it.
    let techniques = Techniques { next_event_estimation: false, bsdf_sampling: false, merging: false, ..Techniques::default() };
    let batch = |intensity: f64| {
        let mut scene = scene_of(json!({
            "materials": {"mirror": {"conductor": {"reflectance": 1.0}}},
            "shapes": [{"sphere": {"center": [0, 0.8, 0], "radius": 0.5}, "material": "mirror"}],
            "lights": [{"point": {"position": [1, 3, 1], "intensity": 1}}],
        }));
        // A scene file with such a lamp is refused.
        let Light::Point { intensity: light, .. } = &mut scene.lights[0] else { panic!("not a point") };
        *light = Spectrum::Constant(intensity);
        let mut film = abbe::film::Film::new(&scene.film);
        let mut integrator = adapter::with(&scene, 1, techniques).unwrap();
        let stats = integrator.render_batch(abbe::render::Batch::even(0, 4), &mut film).unwrap();
        let values: Vec<f64> = (0..film.pixels()).flat_map(|p| film.pixel(p).to_vec()).collect();
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "{intensity}: {stats:?}");
        (stats, values.iter().sum::<f64>())
    };
    let (fine, light) = batch(1.0);
    assert!(fine.dropped() == 0 && light > 0.0, "{fine:?}");
    // Beyond the largest sample, and beyond single precision altogether.
    let (bright, _) = batch(1e30);
    assert!(bright.dropped_saturated > 0 && bright.dropped() == bright.dropped_saturated, "{bright:?}");
    let (endless, light) = batch(1e60);
    assert!(endless.dropped_not_finite > 0 && light == 0.0, "{endless:?}, {light}");
}
