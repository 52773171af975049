// GGX in the local frame of the shading normal, +z outward on the side of wo.
#include "common/math.wgsl"

// Its width: where some metal has a grain, that along x and along y.
#if GRAIN
alias Width = vec2f;
#else
alias Width = f32;
#endif

fn ggx_d(h: vec3f, alpha: Width) -> f32 {
    // 1 - z^2 + a^2 z^2 (over a^2) without cancellation at small alpha.
    let s = h.xy / alpha;
    let e = dot(s, s) + h.z * h.z;
#if GRAIN
    return INV_PI / (alpha.x * alpha.y * e * e);
#else
    return INV_PI / (alpha * alpha * e * e);
#endif
}

fn ggx_lambda(w: vec3f, alpha: Width) -> f32 {
    let s = alpha * w.xy;
    let x = dot(s, s) / max(w.z * w.z, 1e-20);
    return 0.5 * (sqrt(1.0 + x) - 1.0);
}

// pdf of visible normals: G1(wo) D(h) (wo.h) / wo.z.
fn pdf_visible_normal(wo: vec3f, h: vec3f, alpha: Width) -> f32 {
    return ggx_d(h, alpha) * max(0.0, dot(wo, h)) / ((1.0 + ggx_lambda(wo, alpha)) * wo.z);
}

// Height-correlated masking-shadowing of wi given that wo is visible: G2 / G1(wo).
fn shadowing(wo: vec3f, wi: vec3f, alpha: Width) -> f32 {
    let lo = ggx_lambda(wo, alpha);
    return (1.0 + lo) / (1.0 + lo + ggx_lambda(wi, alpha));
}

// Dupuy & Benyoub, "Sampling visible GGX normals with spherical caps", HPG 2023, listing 3.
fn sample_visible_normal(wo: vec3f, alpha: Width, u: vec2f) -> vec3f {
    let w = normalize(vec3f(alpha * wo.xy, wo.z));
    let phi = 2.0 * PI * u.x;
    let z = (1.0 - u.y) * (1.0 + w.z) - w.z;
    let sin_theta = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let h = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), z) + w;
    return normalize(vec3f(alpha * h.xy, max(h.z, 1e-10)));
}
