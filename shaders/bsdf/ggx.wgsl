// Isotropic GGX in the local frame of the shading normal, +z outward on the side of wo.

fn ggx_d(h: vec3f, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // 1 - z^2 + a^2 z^2 without cancellation at small alpha.
    let e = dot(h.xy, h.xy) + a2 * h.z * h.z;
    return a2 * INV_PI / max(e * e, 1e-30);
}

fn ggx_lambda(w: vec3f, alpha: f32) -> f32 {
    let tan2 = dot(w.xy, w.xy) / max(w.z * w.z, 1e-20);
    return 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

// pdf of visible normals: G1(wo) D(h) (wo.h) / wo.z.
fn pdf_visible_normal(wo: vec3f, h: vec3f, alpha: f32) -> f32 {
    return ggx_d(h, alpha) * max(0.0, dot(wo, h)) / ((1.0 + ggx_lambda(wo, alpha)) * wo.z);
}

// Height-correlated masking-shadowing of wi given that wo is visible: G2 / G1(wo).
fn shadowing(wo: vec3f, wi: vec3f, alpha: f32) -> f32 {
    let lo = ggx_lambda(wo, alpha);
    return (1.0 + lo) / (1.0 + lo + ggx_lambda(wi, alpha));
}

// Dupuy & Benyoub, "Sampling visible GGX normals with spherical caps", HPG 2023, listing 3.
fn sample_visible_normal(wo: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let w = normalize(vec3f(alpha * wo.xy, wo.z));
    let phi = 2.0 * PI * u.x;
    let z = (1.0 - u.y) * (1.0 + w.z) - w.z;
    let sin_theta = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let h = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), z) + w;
    return normalize(vec3f(alpha * h.xy, max(h.z, 1e-10)));
}
