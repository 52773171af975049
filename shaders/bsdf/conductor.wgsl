// Metal: smooth, or GGX with reciprocal energy compensation (the model: src/bsdf/conductor.rs).
#include "bsdf/bsdf.wgsl"
#include "bsdf/fresnel.wgsl"
#if ROUGH_CONDUCTOR
#include "bsdf/mirror.wgsl"
#endif

// Index of what touches the metal.
fn index_around_metal(b: ptr<function, Bsdf>, k: u32) -> vec4f {
#if COAT
    if ((*b).coat != NONE) {
        return spectrum(load_Material((*b).coat).a, k);
    }
#endif
    return index_outside(k);
}

// Reflectance for cos_i >= 0.
fn conductor_reflectance(b: ptr<function, Bsdf>, cos_i: f32, k: u32) -> vec4f {
    let m = (*b).m;
#if COLORED_CONDUCTOR
    if (m.b == NONE) {
        return schlick(cos_i, color_of(b, k));
    }
#endif
    let n = index_around_metal(b, k);
#if THIN_FILM
    if (m.c != 0u) {
        return film_reflectance(m, cos_i, n, spectrum(m.a, k), spectrum(m.b, k), k);
    }
#endif
    return fresnel_conductor(cos_i, spectrum(m.a, k) / n, spectrum(m.b, k) / n);
}

#if SMOOTH_CONDUCTOR
fn sample_smooth_conductor(b: ptr<function, Bsdf>, d: vec3f, n: vec3f) -> BsdfSample {
    let s = mirrored(d, n);
#if COAT
    var out = coat_transmittance(b, s.wi.z);
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let r = conductor_reflectance(b, s.wi.z, k);
#if COAT
        beta[k] *= mirror_under_coat(b, r, out[k], k);
#else
        beta[k] *= r;
#endif
    }
    return s;
}
#endif

#if ROUGH_CONDUCTOR
// Hemispherical mean of the reflectance.
fn conductor_average(b: ptr<function, Bsdf>, k: u32) -> vec4f {
    let m = (*b).m;
#if COLORED_CONDUCTOR
    if (m.b == NONE) {
        return schlick_average(color_of(b, k));
    }
#endif
#if THIN_FILM
    if (m.c != 0u) {
        // Four-point Gauss-Legendre as for bare metal.
        return 0.0241522 * conductor_reflectance(b, 0.0694318, k) + 0.2152141 * conductor_reflectance(b, 0.3300095, k)
            + 0.4369311 * conductor_reflectance(b, 0.6699905, k) + 0.3237026 * conductor_reflectance(b, 0.9305682, k);
    }
#endif
    let n = index_around_metal(b, k);
    return fresnel_conductor_average(spectrum(m.a, k) / n, spectrum(m.b, k) / n);
}

fn eval_rough_conductor(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let m = (*b).m;
    let facets = eval_mirror(m, wo, wi);
    let mean_missing = facets.mean_missing;
#if COAT
    var out = coat_transmittance(b, wi.z);
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let f_avg = conductor_average(b, k);
        var r = conductor_reflectance(b, facets.cos_facet, k);
        var r_multiple = f_avg * f_avg * (1.0 - mean_missing) / (1.0 - f_avg * mean_missing);
#if COAT
        r = mirror_under_coat(b, r, out[k], k);
        r_multiple = mirror_under_coat(b, r_multiple, out[k], k);
#endif
        (*f)[k] = select(vec4f(0.0), facets.single * r + facets.multiple * r_multiple, wi.z > 0.0);
    }
    return BsdfPdf(facets.pdf, facets.pdf, pdf_mirror(m, wi, wo));
}
#endif
