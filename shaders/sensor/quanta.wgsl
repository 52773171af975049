// Sums that any path may add to: fixed point, so that the order does not matter.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/counters.wgsl"
@group(0) @binding(13) var<storage, read_write> splats: array<atomic<u32>>;
#if MANY_BINS
@group(0) @binding(12) var<storage, read> wavelength_bins: array<u32>;
#endif

// Whether a sample whose bins sum up to `total` can be added; counts it otherwise. 2^62 quanta in one splat cannot be held, nor sums of larger samples.
fn is_addable(total: f32) -> bool {
    let quanta = total * params.inverse_quantum;
    if (!is_finite(quanta)) {
        atomicAdd(&counters[COUNTER_NOT_FINITE], 1u);
        return false;
    }
    if (quanta > 0x1p+62 || total > LARGEST_SAMPLE) {
        atomicAdd(&counters[COUNTER_SATURATED], 1u);
        return false;
    }
    return true;
}

// Adds `quanta` to a 64-bit sum, stochastically rounded: integers, so that the order of additions does not matter. A sum that would wrap stays at
// the greatest there is, and is counted.
fn add_quanta(index: u32, quanta: f32, u: f32) {
    let whole = floor(quanta + u);
    if (whole <= 0.0) {
        return;
    }
    let high = floor(whole * 0x1p-32);
    let low = u32(whole - high * 0x1p+32);
    let before = atomicAdd(&splats[2u * index], low);
    let carry = select(0u, 1u, before + low < low);
    let high_sum = u32(high) + carry;
    if (high_sum != 0u) {
        let before_high = atomicAdd(&splats[2u * index + 1u], high_sum);
        if (before_high + high_sum < before_high) {
            atomicMax(&splats[2u * index + 1u], 0xffffffffu);
            atomicAdd(&counters[COUNTER_SATURATED], 1u);
        }
    }
}
