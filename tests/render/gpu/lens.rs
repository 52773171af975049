//! Rays through a camera's lens in single precision, against double precision.

use super::support::*;
use crate::adapter;
use abbe::gpu::layout::{Params, PassHead, texels};
use abbe::gpu::scene::GpuScene;
use abbe::integrator::{Plan, Techniques};
use abbe::lens::{LensRay, Tracer};
use abbe::scene::Scene;
use glam::{DVec3, Vec4, dvec3};
use serde_json::json;

/// Wavelengths of the four lanes, nm.
const NM: [f64; 4] = [420.0, 500.0, 587.6, 680.0];
const RAYS: usize = 4096;

/// Rays from before the lens by the kernel's routine, each by its own lane: point at the last surface, direction, transmission (0 if stopped).
fn traced(scene: &Scene, rays: &[(Vec4, Vec4)]) -> Vec<[f64; 8]> {
    let gpu = adapter::gpu();
    let uploaded = GpuScene::new(&gpu, scene, false).unwrap();
    let mut features = Plan::new(scene, Techniques::default()).camera.switches();
    features.insert("MANY_BINS", false);
    let inputs = with_tables("@group(0) @binding(40) var inputs: Table<vec4f>;");
    let source = format!(
        "{}{}const WAVELENGTHS = 4u;\nconst WAVELENGTHS4 = 1u;\n{}
        {inputs}        @group(0) @binding(41) var<storage, read_write> out: array<vec4f>;
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3u) {{
            let o = load_inputs(2u * id.x);
            let d = load_inputs(2u * id.x + 1u);
            let r = trace_lens(four_rays(o.xyz, d.xyz), 0u, true);
            let lane = u32(o.w);
            out[2u * id.x] = vec4f(component(r.ox, lane), component(r.oy, lane), component(r.oz, lane), component(r.weight, lane));
            out[2u * id.x + 1u] = vec4f(component(r.dx, lane), component(r.dy, lane), component(r.dz, lane), 0.0);
        }}\n",
        prelude(),
        uploaded.constants,
        shader_file("sensor/lens.wgsl", &features)
    );
    let mut table = vec![Vec4::ZERO; texels::<PassHead>() as usize];
    for row in &uploaded.rows {
        table.push(Vec4::from_array(NM.map(|nm| row.eval(nm, &[0.0; 4]) as f32)));
    }
    let spectra = gpu.table("spectra", &table).unwrap();
    let params = gpu.uniform("params", std::mem::size_of::<Params>() as u64);
    gpu.write(&params, &[Params::default()]);
    let flat: Vec<Vec4> = rays.iter().flat_map(|(o, d)| [*o, *d]).collect();
    let inputs = gpu.table("inputs", &flat).unwrap();
    let mut resources: Vec<(&str, &abbe::gpu::Resource)> = uploaded.resources.iter().map(|(n, r)| (*n, r)).collect();
    resources.extend([("spectra", &spectra), ("params", &params), ("inputs", &inputs)]);
    let words = run_kernel(&gpu, source, &resources, 8 * rays.len(), rays.len() as u32 / 64);
    words.chunks_exact(8).map(|w| std::array::from_fn(|i| f64::from(f32::from_bits(w[i])))).collect()
}

#[test]
fn rays_through_a_lens_arrive_within_1e_5_of_its_focal_length() {
    let asphere = json!([
        {"radius": 0.04, "conic": -0.6, "aspheric": [0, -1000, 2e6, -1e9], "thickness": 0.009, "glass": "N-SK16", "diameter": 0.03},
        {"radius": -0.09, "conic": 1.5, "aspheric": [0, 3000, -1e6], "diameter": 0.03}
    ]);
    // As in a telephone; the coefficient of r^16, which is 1 nm at the rim, is beyond single precision.
    let small = json!([
        {"radius": 0.002, "aspheric": [0, 0, 0, 0, 0, 0, 0, 1e41], "thickness": 0.00045, "glass": "N-SK16", "diameter": 0.0015},
        {"radius": -0.0045, "diameter": 0.0015}
    ]);
    let of = |surfaces: serde_json::Value| json!({"surfaces": surfaces});
    for (name, size, lens) in
        [("gauss", 1.0, json!({"prescription": "gauss"})), ("asphere", 1.0, of(asphere)), ("small", 0.05, of(small))]
    {
        let mut camera = json!({"eye": [0, 1, 4], "target": [0, 1, 0], "film": [0.036 * size, 0.024 * size]});
        merge(&mut camera, lens);
        let scene = scene_of(json!({"camera": {"lens": camera}, "film": {"range_nm": [400, 700]}}));
        let optics = scene.sensor.optics().unwrap();
        let (f, front) = (optics.paraxial.focal_length, optics.lens.surfaces[0].semi_diameter);
        let mut random = Random(7);
        let rays: Vec<(Vec4, Vec4)> = (0..RAYS)
            .map(|i| {
                let (r, phi) = (front * random.next().sqrt(), 6.3 * random.next());
                let (tilt, turn) = (0.3 * random.next(), 6.3 * random.next());
                let d = dvec3(tilt * turn.cos(), tilt * turn.sin(), 1.0).normalize().as_vec3();
                let o = dvec3(r * phi.cos(), r * phi.sin(), 0.0).as_vec3() - 0.05 * size as f32 * d;
                (o.extend((i % 4) as f32), d.extend(0.0))
            })
            .collect();
        let (mut worst, mut through, mut at_rims) = (0.0f64, 0, 0);
        for ((o, d), found) in rays.iter().zip(traced(&scene, &rays)) {
            let start = LensRay { o: o.truncate().as_dvec3(), d: d.truncate().as_dvec3().normalize() };
            let exact = Tracer::new(&optics.lens, NM[o.w as usize]).trace(start).filter(|out| out.is_clear());
            let [x, y, z, weight, dx, dy, dz, _] = found;
            let Some(exact) = exact.filter(|_| weight > 0.0) else {
                at_rims += usize::from(exact.is_some() != (weight > 0.0));
                continue;
            };
            through += 1;
            let ours = LensRay { o: dvec3(x, y, z), d: DVec3::new(dx, dy, dz) };
            let off = ours.at(optics.film_z).distance(exact.ray.at(optics.film_z)) / f;
            worst = worst.max(off).max((weight - exact.transmission).abs());
        }
        println!("{name}: {through} rays within {worst:.1e} of the focal length, {at_rims} at rims");
        assert!(through > RAYS / 10 && worst < 1e-5, "{name}: {through} rays, {worst}");
        // Of those that graze a rim rounding decides.
        assert!(at_rims <= RAYS / 500, "{name}: {at_rims}");
    }
}
