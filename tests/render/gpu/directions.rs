//! The shaders' frames and cones: what is not exactly so makes light paths of a density that they do not know of.

use super::support::*;
use crate::adapter;
use glam::{Vec3, Vec4, vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Runs `body`, which makes `result` (vec4f) from `input`, over all inputs.
fn run(body: &str, inputs: &[Vec4]) -> Vec<[f64; 4]> {
    let gpu = adapter::gpu();
    let source = shader_file("common/math.wgsl", &BTreeMap::new())
        + &format!(
            "@group(0) @binding(0) var<storage, read> inputs: array<vec4f>;
            @group(0) @binding(1) var<storage, read_write> out: array<vec4f>;
            @compute @workgroup_size(64)
            fn main(@builtin(global_invocation_id) id: vec3u) {{
                let input = inputs[id.x];
                var result = vec4f(0.0);
                {body}
                out[id.x] = result;
            }}\n"
        );
    let buffer = gpu.storage("inputs", inputs).unwrap();
    let words = run_kernel(&gpu, source, &[("inputs", &buffer)], 4 * inputs.len(), inputs.len() as u32 / 64);
    words.chunks_exact(4).map(|w| [0, 1, 2, 3].map(|i| f64::from(f32::from_bits(w[i])))).collect()
}

#[test]
fn frames_are_orthonormal_near_their_poles_too() {
    let mut random = Random(7);
    let mut between = |lo: f64, hi: f64| (lo + (hi - lo) * random.next()) as f32;
    let axes: Vec<Vec4> = (0..4096)
        .map(|i| {
            let mut v = vec3(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0));
            if i % 2 == 1 {
                // From 1e-6 to 0.1 off a pole of one of the frames.
                let off = 10f32.powf(between(-6.0, -1.0));
                v = [Vec3::Y, Vec3::Z][i / 2 % 2] * [1.0, -1.0][i / 4 % 2] + off * v;
            }
            v.normalize().extend(0.0)
        })
        .collect();
    for frame in ["frame_around", "level_frame"] {
        let body = format!(
            "let f = {frame}(input.xyz);
            let dots = abs(vec3f(dot(f[0], f[1]), dot(f[1], f[2]), dot(f[2], f[0])));
            let sizes = abs(vec3f(dot(f[0], f[0]), dot(f[1], f[1]), dot(f[2], f[2])) - 1.0);
            result = vec4f(max(dots.x, max(dots.y, dots.z)), max(sizes.x, max(sizes.y, sizes.z)), determinant(f), distance(f[2], input.xyz));"
        );
        for (axis, [dots, sizes, determinant, off]) in axes.iter().zip(run(&body, &axes)) {
            assert!(dots < 1e-6 && sizes < 1e-6, "{frame} {axis}: {dots:e} {sizes:e}");
            assert!((determinant - 1.0).abs() < 1e-6 && off == 0.0, "{frame} {axis}: {determinant} {off}");
        }
    }
}

#[test]
fn cones_are_filled_evenly() {
    // 256 x 256 numbers, one in each cell of a grid, must leave as many directions in each of 8 bands of equal solid angle and 8 sectors: only cells on
    // their borders are left to chance, which is half a percent.
    const SIDE: usize = 256;
    for width in [1e-4f32, 0.3, 2.0] {
        let mut random = Random(3);
        let mut at = |i: usize| ((i as f64 + random.next()) / SIDE as f64).min(0.999_999) as f32;
        let inputs: Vec<Vec4> = (0..SIDE * SIDE).map(|i| Vec4::new(at(i % SIDE), at(i / SIDE), width, 0.0)).collect();
        let mut cells = [[0u32; 8]; 8];
        for [x, y, z, size] in run("let d = sample_cone(input.xy, input.z); result = vec4f(d, dot(d, d));", &inputs) {
            assert!((size - 1.0).abs() < 1e-6, "{size}");
            // 1 - z of narrow cones, from x and y, which have the digits.
            let r2 = x * x + y * y;
            let h = if z > 0.0 { r2 / (1.0 + z) } else { 1.0 - z } / f64::from(width);
            assert!(h < 1.0 + 1e-5, "{h}");
            let phi = y.atan2(x).rem_euclid(2.0 * PI) / (2.0 * PI);
            cells[((8.0 * h) as usize).min(7)][((8.0 * phi) as usize).min(7)] += 1;
        }
        for n in cells.as_flattened() {
            let share = f64::from(*n) * 64.0 / (SIDE * SIDE) as f64;
            assert!((share - 1.0).abs() < 0.03, "{width}: {share} {cells:?}");
        }
    }
}
