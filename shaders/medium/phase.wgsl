// The Henyey-Greenstein phase function (Henyey & Greenstein 1941).
#include "common/math.wgsl"
#include "bsdf/bsdf.wgsl"

// Henyey-Greenstein phase function and also its pdf per solid angle; `cos_theta` between the directions of travel before and after.
fn phase_hg(cos_theta: f32, g: f32) -> f32 {
    // 1 + g^2 - 2 g cos, so that it keeps its digits (and its sign) where g is near 1 or -1.
    let h = abs(g);
    let d = (1.0 - h) * (1.0 - h) + 2.0 * h * max(1.0 - select(-cos_theta, cos_theta, g > 0.0), 0.0);
    return 0.25 * INV_PI * (1.0 - h) * (1.0 + h) / (d * sqrt(d));
}

// Likewise of a direction in the local frame along the path.
fn eval_phase(b: ptr<function, Bsdf>, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let phase = phase_hg(wi.z, (*b).m.alpha);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*f)[k] = vec4f(phase);
    }
    return BsdfPdf(phase, phase, phase);
}

// Samples the phase function, in the local frame along the path.
fn sample_hg(g: f32, u: vec2f) -> vec3f {
    var cos_theta = 1.0 - 2.0 * u.x;
    if (abs(g) > 1e-3) {
        let s = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x);
        cos_theta = clamp((1.0 + g * g - s * s) / (2.0 * g), -1.0, 1.0);
    }
    let sin_theta = sqrt(max(0.0, 1.0 - cos_theta * cos_theta));
    let phi = 2.0 * PI * u.y;
    return vec3f(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta);
}
