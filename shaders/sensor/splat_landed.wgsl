// Splats of what lands apart: every wavelength into its own pixel.
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "common/counters.wgsl"
#include "sensor/landing.wgsl"
#include "sensor/quanta.wgsl"
#include "path/state.wgsl"
#if LIGHT_PATHS
#if GUIDED
#include "light/guide.wgsl"
#endif
#endif

// Adds `Ld` to the pixels where its wavelengths have landed, from the first to the last of `carried`.
fn splat_landed(carried: vec2u) {
    var total = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        total += Ld[k] * spectrum(ROW_BIN, k);
    }
    if (!is_addable(sum4(total))) {
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
        let in_tile = vec2u(place % params.tile_width, place / params.tile_width);
        add_to_guiding_sample(vec2u(params.tile_x, params.tile_y) + in_tile, sum4(total));
    }
#endif
#endif
    let u = unit_float(hash2(hash2(sampler_pixel, sampler_dimension), sampler_index));
    // One addition in each turn: software drivers execute whatever is within a loop, needed or not. Neighbouring wavelengths mostly land in one pixel: their X, Y, Z are added
    // together, in three turns after them.
    var held = NONE;
    var xyz = vec3f(0.0);
    var added = 3u; // of X, Y, Z
    var i = carried.x;
    loop {
        let is_bin = i <= carried.y;
        var pixel = NONE;
        var light = 0.0;
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            // Sums with one term each: an index into an array that differs between lanes is slow.
            let of_wavelength = one_hot(i, k);
            light += dot(Ld[k], of_wavelength);
            let pixels = select(vec4u(NONE), landed_pixel[k], of_wavelength > vec4f(0.0));
            pixel = min(pixel, min(min(pixels.x, pixels.y), min(pixels.z, pixels.w)));
        }
        pixel = select(pixel, held, is_bin && pixel == NONE);
#if MANY_BINS
        let bin = wavelength_bins[pass_of_path * WAVELENGTHS + min(i, WAVELENGTHS - 1u)];
#else
        let bin = i;
#endif
        let is_xyz = pixel != held && added < 3u;
        var index = held * (BINS + 3u) + BINS + added;
        var value = 0.0;
        if (is_xyz) {
            value = component(vec4f(xyz, 0.0), added) / f32(XYZ_RATIO);
            added += 1u;
        } else {
            if (!is_bin) {
                break;
            }
            xyz = select(xyz, vec3f(0.0), pixel != held);
            held = pixel;
            added = select(0u, 3u, held == NONE);
            index = held * (BINS + 3u) + bin;
            let at = min(i, WAVELENGTHS - 1u);
            value = light * spectrum_at(ROW_BIN, at);
            xyz += light * vec3f(spectrum_at(ROW_X, at), spectrum_at(ROW_Y, at), spectrum_at(ROW_Z, at));
            i += 1u;
        }
        if (held != NONE) {
            add_quanta(index, value * params.inverse_quantum, u);
        }
    }
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
