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
// Bins want lanes by what they carry, the picture by their luminance: half of each. `total` is the sum of what they carry.
fn share_by_throughput(total: f32) {
    var y = 0.0;
    for (var k = 0u; k < LANES4; k++) {
        y += dot(beta[k], spectrum(ROW_Y, k));
    }
    let by_power = select(1.0, 0.5, y > 0.0);
    for (var k = 0u; k < LANES4; k++) {
        lane_shares[k] = beta[k] * (safe_ratio(by_power, total) + safe_ratio(1.0 - by_power, y) * spectrum(ROW_Y, k));
    }
}

#if GATHERED
// Share of light paths that keep the lane of the camera paths: the more, the less light is lost to visible points, and the more do bins differ between passes.
const WITH_CAMERA = 0.8;

// Probability of keeping this lane, in the mean over what the camera paths of a pass may keep.
fn collapse_density(lane: u32) -> f32 {
    var own = vec4f(0.0);
    var carried = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        let share = spectrum(ROW_COLLAPSE, k);
        own += share * one_hot(lane, k);
        carried += select(vec4f(0.0), share, beta[k] > vec4f(0.0));
    }
    return WITH_CAMERA * sum4(own) + (1.0 - WITH_CAMERA * sum4(carried)) * at_lane(&lane_shares, lane);
}
#endif
#endif

// Keeps one wavelength of a path that still carries all of them; returns its lane. Camera paths of a pass choose among the same few lanes, as even over a
// pixel's samples as can be, or all keep the same one where they are gathered. Light paths choose by what they carry and by its luminance; where they are
// gathered, most of them keep what the camera paths keep. The throughput is right for gathering, within the pass; joints to the sensor have no need of the
// camera paths' lane, and count in the mean over all passes (path.at_joints), without the great weights of what a pass hardly ever keeps.
fn collapse_wavelengths() -> u32 {
    let total = sum_beta();
#if CAMERA_PATHS || GATHERED
    let lanes = pass_head().collapse;
#endif
#if CAMERA_PATHS
    // 1 / (4 times the probability of the lane): the sum over a lane is 1 in the mean of all passes.
    let weights = pass_head().collapse_weights;
    let choice = ((sampler_index & 1u) << 1u | ((sampler_index >> 1u) & 1u)) ^ (sampler_pixel & 3u);
    path.lane = u32(component(vec4f(lanes), choice));
    let weight = 4.0 * component(weights, choice);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= weight * one_hot(path.lane, k);
    }
#else
    share_by_throughput(total);
#if GUIDED
    let u = numbers.choices.y;
#else
    let u = event_light.x;
#endif
#if GATHERED
    let with_camera = select(0.0, WITH_CAMERA, beta_at(lanes.x) > 0.0);
    path.lane = lanes.x;
    if (u >= with_camera) {
        path.lane = choose_lane((u - with_camera) / (1.0 - with_camera));
    }
    let probability = select(0.0, with_camera, path.lane == lanes.x) + (1.0 - with_camera) * at_lane(&lane_shares, path.lane);
    path.at_joints *= safe_ratio(probability, collapse_density(path.lane));
#else
    path.lane = choose_lane(u);
    let probability = at_lane(&lane_shares, path.lane);
#endif
    // Zero for a path that carries nothing.
    let kept = safe_ratio(beta_at(path.lane), probability);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] = kept * one_hot(path.lane, k);
    }
#endif
    // What is rarely kept must not outlive what is often kept.
    path.start *= safe_ratio(sum_beta(), total);
    return path.lane;
}
