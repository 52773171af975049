// Splats of what a lens brings to the film: every wavelength into its own pixel.
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "common/counters.wgsl"
#include "sensor/lens.wgsl"
#include "sensor/quanta.wgsl"
#include "path/state.wgsl"
#if LIGHT_PATHS
#if GUIDED
#include "light/guide.wgsl"
#endif
#endif

// Adds `Ld` to the pixels where its wavelengths have landed.
fn splat_landed() {
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
    // Neighbouring wavelengths mostly land in one pixel: their X, Y, Z are added together.
    var held = NONE;
    var xyz = vec3f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let value = Ld[k] * params.inverse_quantum;
        let in_bin = value * spectrum(ROW_BIN, k);
        let x = value * spectrum(ROW_X, k);
        let y = value * spectrum(ROW_Y, k);
        let z = value * spectrum(ROW_Z, k);
        let pixels = landed_pixel[k];
        for (var c = 0u; c < 4u; c++) {
            let pixel = select(select(pixels.x, pixels.y, c == 1u), select(pixels.z, pixels.w, c == 3u), c >= 2u);
#if MANY_BINS
            let bin = wavelength_bins[pass_of_path * WAVELENGTHS + min(4u * k + c, WAVELENGTHS - 1u)];
#else
            let bin = 4u * k + c;
#endif
            if (pixel != NONE) {
                if (pixel != held) {
                    add_xyz(held, xyz, u);
                    held = pixel;
                    xyz = vec3f(0.0);
                }
                xyz += vec3f(component(x, c), component(y, c), component(z, c));
                add_quanta(pixel * (BINS + 3u) + bin, component(in_bin, c), u);
            }
        }
    }
    add_xyz(held, xyz, u);
}

fn add_xyz(pixel: u32, xyz: vec3f, u: f32) {
    if (pixel == NONE) {
        return;
    }
    for (var i = 0u; i < 3u; i++) {
        add_quanta(pixel * (BINS + 3u) + BINS + i, component(vec4f(xyz, 0.0), i) / f32(XYZ_RATIO), u);
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
    splat_landed();
}
#endif
