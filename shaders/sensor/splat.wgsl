// Splats: what paths add to pixels of any place.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "common/counters.wgsl"
#if SENSOR_LENS || DISPERSION
#include "sensor/landing.wgsl"
#endif
#include "path/state.wgsl"
#if LIGHT_PATHS
#if GUIDED
#include "light/guide.wgsl"
#endif
#endif

// Sums of 64 bits, low word first, in fixed point, so that the order of additions does not matter: of each pixel of the tile the bins, and X, Y, Z behind them.
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

// A pixel's place within the tile, or NONE.
fn place_in_tile(pixel: vec2u) -> u32 {
    let at = pixel - vec2u(params.tile_x, params.tile_y);
    return select(NONE, at.y * params.tile_width + at.x, at.x < params.tile_width && at.y < params.tile_height);
}

// Adds `Ld`, of the first to the last wavelength of `carried`, to the pixel at `place`; or, if they land apart, each to the pixel where it has landed. Sums are rounded stochastically. One
// that would wrap stays at the greatest there is, and is counted.
fn add_to_sums(carried: vec2u, place: u32, lands_apart: bool) {
    let u = unit_float(hash2(hash2(sampler_pixel, sampler_dimension), sampler_index));
    // One addition to one word in each turn: software drivers execute whatever is within a loop, needed or not. The high word's follows, if there is one. X, Y, Z of neighbours in
    // one pixel are added together, in three turns after them.
    var held = NONE;
    var xyz = vec3f(0.0);
    var added = 3u; // of X, Y, Z
    var i = carried.x;
    var sum = 0u;
    var high = 0u; // of that sum, to be added yet
    var full = NONE; // a sum that has wrapped
    loop {
        loop {
            let is_high = high != 0u;
            var amount = high;
            if (!is_high) {
                let is_bin = i <= carried.y;
                var pixel = place;
                var light = 0.0;
                // Sums with one term each: an index into an array that differs between lanes is slow.
                for (var k = 0u; k < WAVELENGTHS4; k++) {
                    light += dot(Ld[k], one_hot(i, k));
                }
#if SENSOR_LENS || DISPERSION
                if (lands_apart) {
                    for (var k = 0u; k < WAVELENGTHS4; k++) {
                        let pixels = select(vec4u(NONE), landed_pixel[k], one_hot(i, k) > vec4f(0.0));
                        pixel = min(pixel, min(min(pixels.x, pixels.y), min(pixels.z, pixels.w)));
                    }
                    pixel = select(pixel, held, pixel == NONE);
                }
#endif
                pixel = select(NONE, pixel, is_bin);
                var value = 0.0;
                if (pixel != held && added < 3u) {
                    sum = held * (BINS + 3u) + BINS + added;
                    value = component(vec4f(xyz, 0.0), added) / f32(XYZ_RATIO);
                    added += 1u;
                } else {
                    if (!is_bin) {
                        break;
                    }
#if MANY_BINS
                    let bin = wavelength_bins[pass_of_path * WAVELENGTHS + i];
#else
                    let bin = i;
#endif
                    xyz = select(xyz, vec3f(0.0), pixel != held);
                    held = pixel;
                    added = select(0u, 3u, held == NONE);
                    sum = held * (BINS + 3u) + bin;
                    let weights = film_weights(i);
                    value = light * weights.x;
                    xyz += light * weights.yzw;
                    i += 1u;
                }
                let whole = select(0.0, floor(value * params.inverse_quantum + u), held != NONE);
                let above = floor(max(whole, 0.0) * 0x1p-32);
                high = u32(above);
                amount = u32(max(whole, 0.0) - above * 0x1p+32);
            }
            if (amount != 0u) {
                let before = atomicAdd(&splats[2u * sum + select(0u, 1u, is_high)], amount);
                let wraps = before + amount < amount;
                high = select(high, 0u, is_high) + select(0u, 1u, wraps);
                if (is_high && wraps) {
                    full = sum;
                    break;
                }
            }
        }
        if (full == NONE) {
            break;
        }
        atomicMax(&splats[2u * full + 1u], 0xffffffffu);
        atomicAdd(&counters[COUNTER_SATURATED], 1u);
        full = NONE;
        high = 0u;
    }
}

// The sum over the bins of `Ld`.
fn sum_over_bins() -> f32 {
    var total = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        total += Ld[k] * spectrum(ROW_BIN, k);
    }
    return sum4(total);
}

#if LIGHT_PATHS
#if GUIDED
fn guide_to(place: u32, total: f32) {
    add_to_guiding_sample(vec2u(params.tile_x + place % params.tile_width, params.tile_y + place / params.tile_width), total);
}
#endif

// Adds `Ld` to the pixel at `place`, of the first to the last wavelength of `carried`.
fn splat(carried: vec2u, place: u32) {
    let total = sum_over_bins();
    if (place == NONE || !is_addable(total)) {
        return;
    }
#if GUIDED
    guide_to(place, total);
#endif
    add_to_sums(carried, place, false);
}
#endif

#if SENSOR_LENS || DISPERSION
// Adds `Ld` to the pixels where its wavelengths have landed, from the first to the last of `carried`.
fn splat_landed(carried: vec2u) {
    let total = sum_over_bins();
    if (!is_addable(total)) {
        return;
    }
#if LIGHT_PATHS
#if GUIDED
    // All count as where the last of them has landed.
    var place = NONE;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let pixel = select(vec4u(NONE), landed_pixel[k], Ld[k] > vec4f(0.0));
        place = select(place, pixel.x, pixel.x != NONE);
        place = select(place, pixel.y, pixel.y != NONE);
        place = select(place, pixel.z, pixel.z != NONE);
        place = select(place, pixel.w, pixel.w != NONE);
    }
    if (place != NONE) {
        guide_to(place, total);
    }
#endif
#endif
    add_to_sums(carried, NONE, true);
}

#if CAMERA_PATHS
// Adds a finished sample, of which `li` is the radiance along its ray.
fn splat_sample() {
    var all = vec4f(0.0);
    var least = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        all += abs(li[k]);
        least = min(least, li[k]);
        // A quantum's worth is that of a sum over all light paths.
        Ld[k] = f32(params.light_paths) * max(li[k], vec4f(0.0));
    }
    if (is_finite(sum4(all)) && min(min(least.x, least.y), min(least.z, least.w)) < 0.0) {
        atomicAdd(&counters[COUNTER_NEGATIVE], 1u);
        return;
    }
    splat_landed(vec2u(0u, WAVELENGTHS - 1u));
}
#endif
#endif
