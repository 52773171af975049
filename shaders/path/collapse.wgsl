// The first dispersive refraction of a path: of all its wavelengths it keeps one.
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "path/state.wgsl"
#include "path/mis.wgsl"
#if GUIDED
#if LIGHT_PATHS
#include "light/guide.wgsl"
#endif
#endif

#if !CAMERA_PATHS
// Bins want wavelengths by what they carry, the picture by their luminance: half of each. `total` is the sum of what they carry.
fn share_by_throughput(total: f32) {
    var y = 0.0;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        y += dot(beta[k], spectrum(ROW_Y, k));
    }
    let by_power = select(1.0, 0.5, y > 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        wavelength_shares[k] = beta[k] * (safe_ratio(by_power, total) + safe_ratio(1.0 - by_power, y) * spectrum(ROW_Y, k));
    }
}

#if MERGING
// Share of light paths that keep the wavelength of the camera paths: the more, the less light is lost to visible points, and the more do bins differ between passes.
const WITH_CAMERA = 0.8;

// Probability of keeping this wavelength, in the mean over what the camera paths of a pass may keep.
fn collapse_density(wavelength: u32) -> f32 {
    var own = vec4f(0.0);
    var carried = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let share = spectrum(ROW_COLLAPSE, k);
        own += share * one_hot(wavelength, k);
        carried += select(vec4f(0.0), share, beta[k] > vec4f(0.0));
    }
    return WITH_CAMERA * sum4(own) + (1.0 - WITH_CAMERA * sum4(carried)) * at_wavelength(&wavelength_shares, wavelength);
}
#endif
#endif

// Keeps one wavelength of a path that still carries all of them; returns its wavelength. Camera paths of a pass choose among the same few wavelengths, as even over a
// pixel's samples as can be, or all keep the same one where they are merged. Light paths choose by what they carry and by its luminance; where they are
// merged, most of them keep what the camera paths keep. The throughput is right for merging, within the pass; connections to the sensor have no need of the
// camera paths' wavelength, and count in the mean over all passes (path.connection_scale), without the great weights of what a pass hardly ever keeps.
fn collapse_wavelengths() -> u32 {
    let total = sum_beta();
#if CAMERA_PATHS || MERGING
    let wavelengths = pass_head().collapse;
#endif
#if CAMERA_PATHS
    // 1 / (4 times the probability of the wavelength): the sum over a wavelength is 1 in the mean of all passes.
    let weights = pass_head().collapse_weights;
    let choice = ((sampler_index & 1u) << 1u | ((sampler_index >> 1u) & 1u)) ^ (sampler_pixel & 3u);
    path.wavelength = u32(component(vec4f(wavelengths), choice));
    let weight = 4.0 * component(weights, choice);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] *= weight * one_hot(path.wavelength, k);
    }
#else
    share_by_throughput(total);
#if GUIDED
    let u = numbers.choices.y;
#else
    let u = event_light.x;
#endif
#if MERGING
    let with_camera = select(0.0, WITH_CAMERA, beta_at(wavelengths.x) > 0.0);
    path.wavelength = wavelengths.x;
    if (u >= with_camera) {
        path.wavelength = choose_wavelength((u - with_camera) / (1.0 - with_camera));
    }
    let probability = select(0.0, with_camera, path.wavelength == wavelengths.x) + (1.0 - with_camera) * at_wavelength(&wavelength_shares, path.wavelength);
    path.connection_scale *= safe_ratio(probability, collapse_density(path.wavelength));
#else
    path.wavelength = choose_wavelength(u);
    let probability = at_wavelength(&wavelength_shares, path.wavelength);
#endif
    // Zero for a path that carries nothing.
    let kept = safe_ratio(beta_at(path.wavelength), probability);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] = kept * one_hot(path.wavelength, k);
    }
#endif
    // What is rarely kept must not outlive what is often kept.
    path.start *= safe_ratio(sum_beta(), total);
    return path.wavelength;
}
