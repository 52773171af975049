// A pane with all its inner reflections, or a film (the model: src/bsdf/pane.rs). What is not reflected goes straight through, or around that direction.
#include "bsdf/bsdf.wgsl"
#include "bsdf/fresnel.wgsl"
#if ROUGH_THIN_DIELECTRIC
#include "bsdf/mirror.wgsl"
#endif
#if HIGHLIGHTS
#include "light/highlight.wgsl"
#endif

// Shares of light.
struct Pane {
    reflected: vec4f,
    transmitted: vec4f,
}

// What a face reflects, or of what is itself a film the whole.
fn face_reflectance(m: Material, cos_i: f32, k: u32) -> vec4f {
    let eta = spectrum(m.a, k);
#if THIN_FILM
    if (m.c > 0xffffu) {
        let around = index_outside(k);
        return film_reflectance(m, cos_i, around, select(around * eta, around, is_film(m)), vec4f(0.0), k);
    }
#endif
    return fresnel_dielectric(cos_i, eta);
}

#if THIN_FILM
fn is_film(m: Material) -> bool {
    return (m.c & 0xffffu) == m.a;
}
#endif

fn pane_at(m: Material, cos_i: f32, k: u32) -> Pane {
    let r = face_reflectance(m, cos_i, k);
#if THIN_FILM
    if (m.c > 0xffffu && is_film(m)) {
        return Pane(r, 1.0 - r);
    }
#endif
#if ABSORBING_PANES
    if (m.c != 0u && m.c <= 0xffffu) {
        let cos_t = sqrt(max(cos_transmitted_squared(cos_i, spectrum(m.a, k)), vec4f(1e-12)));
        let t = exp(-spectrum(m.c, k) / cos_t);
        let out = (1.0 - r) * (1.0 - r) * t / max(1.0 - r * r * t * t, vec4f(1e-20));
        return Pane(r + out * r * t, out);
    }
#endif
    let all = 2.0 * r / (1.0 + r);
    return Pane(all, 1.0 - all);
}

#if SMOOTH_THIN_DIELECTRIC
fn sample_thin_dielectric(b: ptr<function, Bsdf>, p: vec3f, d: vec3f, n: vec3f) -> BsdfSample {
    let m = (*b).m;
    let cos_i = min(abs(dot(d, n)), 1.0);
    var reflected = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        reflected += beta[k] * pane_at(m, cos_i, k).reflected;
    }
    let total = sum_beta();
    let mirrored = normalize(d + 2.0 * cos_i * n);
    let reflectance = select(0.0, sum4(reflected) / total, total > 0.0);
    var q = reflectance;
#if HIGHLIGHTS
    q = share_of_reflection(reflectance, p, mirrored);
#endif
    let reflects = event_choice.x < q;
#if HIGHLIGHTS
    path.start *= worth_of_choice(reflectance, q, reflects); // roulette must not see it
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let pane = pane_at(m, cos_i, k);
        beta[k] *= select(pane.transmitted / (1.0 - q), pane.reflected / q, reflects);
    }
    let out = select(d, mirrored, reflects);
    return specular_sample(out, select(-cos_i, cos_i, reflects));
}
#endif

#if ROUGH_THIN_DIELECTRIC
// What a facet at cosine `cos_i` does with light.
struct PaneFacet {
    shares: Spectrum, // of reflection, or of what is let through
    p: f32, // probability of reflection, by what the path carries
    p_fixed: f32, // and by one wavelength, the same for all paths
}

fn facet_of_pane(m: Material, cos_i: f32, reflects: bool) -> PaneFacet {
    var facet: PaneFacet;
    var reflected = vec4f(0.0);
    var all = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let pane = pane_at(m, cos_i, k);
        facet.shares[k] = select(pane.transmitted, pane.reflected, reflects);
        reflected += beta[k] * pane.reflected;
        all += beta[k] * (pane.reflected + pane.transmitted);
        let share = pane.reflected / max(pane.reflected + pane.transmitted, vec4f(1e-20));
        facet.p_fixed += dot(share, one_hot(WAVELENGTHS / 2u, k));
    }
    let total = sum4(all);
    facet.p = select(0.5, sum4(reflected) / total, total > 0.0);
    return facet;
}

fn eval_rough_thin_dielectric(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let m = (*b).m;
    let reflects = wi.z > 0.0;
    let mirrored = vec3f(wi.xy, abs(wi.z));
    let mirror = eval_mirror(m, wo, mirrored);
    var facet = facet_of_pane(m, clamp(mirror.cos_facet, 0.0, 1.0), reflects);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*f)[k] = (mirror.single + mirror.multiple) * facet.shares[k];
    }
    let p = select(1.0 - facet.p, facet.p, reflects);
    let p_fixed = select(1.0 - facet.p_fixed, facet.p_fixed, reflects);
    return BsdfPdf(p * mirror.pdf, p_fixed * mirror.pdf, p_fixed * pdf_mirror(m, mirrored, wo));
}

// z = 0 marks a direction under the surface, whose light the compensation has.
fn sample_rough_thin_dielectric(b: ptr<function, Bsdf>, wo: vec3f) -> vec3f {
    let m = (*b).m;
    let wi = sample_mirror(m, wo, next_1d(), event_direction);
    let facet = facet_of_pane(m, clamp(dot(wo, normalize(wo + wi)), 0.0, 1.0), true);
    let side = select(-1.0, 1.0, next_1d() < facet.p);
    return select(vec3f(0.0), vec3f(wi.xy, side * wi.z), wi.z > 0.0);
}
#endif
