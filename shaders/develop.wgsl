// Components of every pixel of a picture from its CIE XYZ, as `Developer` of src/develop/picture.rs, which hands over all numbers; rounding to 8 or 16
// bits is the host's.
#include "common/math.wgsl"
#include "color/elementary.wgsl"
#include "color/tone.wgsl"
#if GAMUT_MAP
#include "color/gamut.wgsl"
#endif

@group(0) @binding(0) var<storage, read> pixels: array<f32>;
#if GAMUT_MAP
@group(0) @binding(1) var ring: Table<vec4f>;
@group(0) @binding(3) var rounded_ring: Table<vec4f>;
#endif
@group(0) @binding(2) var<storage, read_write> out: array<f32>;

fn linear_rgb(xyz: vec3f) -> vec3f {
    if (!(is_finite(xyz.x) && is_finite(xyz.y) && is_finite(xyz.z)) || xyz.y <= 0.0) {
        return vec3f(0.0);
    }
    let rgb = tone_curve(TO_RGB * xyz);
#if GAMUT_MAP
    let inside = without_negatives(rgb);
    let largest = max(inside.x, max(inside.y, inside.z));
    return inside * select(1.0, shoulder(largest) / largest, largest > KNEE);
#elif GAMUT_CLIP
    return clamp(rgb, vec3f(0.0), vec3f(1.0));
#else
    return rgb;
#endif
}

#if ENCODE
// As `Transfer::encode`, of a component within [0, 1].
fn encode(v: f32) -> f32 {
    let straight = TRANSFER_SLOPE * v;
    if (straight < TRANSFER_FROM) {
        return straight;
    }
    return TRANSFER_ALPHA * power(v, TRANSFER_EXPONENT) - (TRANSFER_ALPHA - 1.0);
}
#endif

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let at = 3u * id.x;
    if (at + 3u > arrayLength(&pixels)) {
        return;
    }
    let rgb = linear_rgb(vec3f(pixels[at], pixels[at + 1u], pixels[at + 2u]));
    for (var c = 0u; c < 3u; c++) {
#if ENCODE
        out[at + c] = encode(clamp(rgb[c], 0.0, 1.0));
#else
        out[at + c] = rgb[c];
#endif
    }
}
