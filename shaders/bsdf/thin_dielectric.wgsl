// A pane with all its inner reflections, R' = 2R / (1 + R), or a film. What is not reflected goes straight through.
#include "bsdf/bsdf.wgsl"
#include "bsdf/fresnel.wgsl"

fn pane_reflectance(m: Material, cos_i: f32, k: u32) -> vec4f {
#if THIN_FILM
    if (m.c != 0u) {
        let around = index_outside(k);
        return film_reflectance(m, cos_i, around, around, vec4f(0.0), k);
    }
#endif
    let r = fresnel_dielectric(cos_i, spectrum(m.a, k));
    return 2.0 * r / (1.0 + r);
}

fn sample_thin_dielectric(b: ptr<function, Bsdf>, d: vec3f, n: vec3f) -> BsdfSample {
    let m = (*b).m;
    let cos_i = min(abs(dot(d, n)), 1.0);
    var reflected = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        reflected += beta[k] * pane_reflectance(m, cos_i, k);
    }
    let total = sum_beta();
    let q = select(0.0, sum4(reflected) / total, total > 0.0);
    let reflects = event_choice.x < q;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let r = pane_reflectance(m, cos_i, k);
        beta[k] *= select((1.0 - r) / (1.0 - q), r / q, reflects);
    }
    let out = select(d, normalize(d + 2.0 * cos_i * n), reflects);
    return BsdfSample(out, vec3f(0.0, 0.0, select(-cos_i, cos_i, reflects)), true);
}
