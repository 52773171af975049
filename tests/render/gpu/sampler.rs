//! The shaders' random numbers: (0,2)-nets, block by block.

use super::support::*;
use crate::adapter;
use std::collections::BTreeMap;

/// Samples per sequence, and sequences: each has a pixel, batch, seed and dimension of its own.
const SAMPLES: usize = 256;
const SEQUENCES: usize = 64;

fn sampler() -> String {
    shader_file("common/sampler.wgsl", &BTreeMap::new())
        + "@group(0) @binding(0) var<storage, read_write> out: array<u32>;\n@compute @workgroup_size(64)\n"
}

/// The points of all sequences, `[sequence][sample]`.
fn points() -> Vec<[f64; 2]> {
    let gpu = adapter::gpu();
    let source = sampler()
        + &format!(
            "fn main(@builtin(global_invocation_id) id: vec3u) {{
                let sequence = id.x / {SAMPLES}u;
                start_sampler(17u * sequence, sequence & 3u, sequence >> 2u, id.x % {SAMPLES}u);
                for (var skip = 0u; skip < sequence % 5u; skip++) {{
                    let unused = next_2d();
                }}
                let p = next_2d();
                out[2u * id.x] = bitcast<u32>(p.x);
                out[2u * id.x + 1u] = bitcast<u32>(p.y);
            }}\n"
        );
    let count = SAMPLES * SEQUENCES;
    let words = run_kernel(&gpu, source, &[], 2 * count, count as u32 / 64);
    words.chunks_exact(2).map(|w| [w[0], w[1]].map(|w| f64::from(f32::from_bits(w)))).collect()
}

#[test]
fn every_block_of_samples_is_a_net() {
    let all = points();
    assert!(all.iter().flatten().all(|v| (0.0..1.0).contains(v)));
    for bits in [2, 4, 6, 8] {
        for block in all.chunks_exact(1 << bits) {
            for across in 0..=bits {
                // 2^across columns by 2^(bits - across) rows: one point in each cell.
                let (columns, rows) = (1usize << across, 1usize << (bits - across));
                let mut cells = vec![0; columns * rows];
                for p in block {
                    cells[(p[0] * columns as f64) as usize * rows + (p[1] * rows as f64) as usize] += 1;
                }
                assert!(cells.iter().all(|&n| n == 1), "{columns} x {rows}: {block:?}");
            }
        }
    }
}

#[test]
fn sequences_differ_and_are_uniform() {
    let all = points();
    let first: Vec<_> = all.chunks_exact(SAMPLES).map(|s| s[0]).collect();
    for (i, p) in first.iter().enumerate() {
        assert!(!first[..i].contains(p), "two sequences start alike");
    }
    // First points of independent sequences: means of 64 uniform numbers, to four standard errors.
    for axis in 0..2 {
        let mean = first.iter().map(|p| p[axis]).sum::<f64>() / first.len() as f64;
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0 / first.len() as f64).sqrt(), "{mean}");
    }
}

#[test]
fn the_second_dimension_is_that_of_sobol() {
    let gpu = adapter::gpu();
    let count = 4096;
    // Small numbers, and numbers with high bits set.
    let index = |i: u32| if i < 2048 { i } else { i.wrapping_mul(0x9e37_79b9) };
    let source = sampler()
        + "fn main(@builtin(global_invocation_id) id: vec3u) {
            let i = select(id.x * 0x9e3779b9u, id.x, id.x < 2048u);
            out[id.x] = reverseBits(sobol_second_reversed(i));
        }\n";
    let words = run_kernel(&gpu, source, &[], count, count as u32 / 64);
    for (i, word) in words.into_iter().enumerate() {
        // Direction numbers of the primitive polynomial x + 1: v_1 = 1/2, v_k = v_(k-1) xor v_(k-1) / 2 (Bratley & Fox 1988).
        let (mut expected, mut direction) = (0u32, 1 << 31);
        for bit in 0..32 {
            if index(i as u32) >> bit & 1 == 1 {
                expected ^= direction;
            }
            direction ^= direction >> 1;
        }
        assert_eq!(word, expected, "index {}", index(i as u32));
    }
}
