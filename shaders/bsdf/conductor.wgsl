// Metal: smooth, or GGX with reciprocal energy compensation (the model and its tables: src/bsdf/energy.rs).
#include "bsdf/bsdf.wgsl"
#include "bsdf/fresnel.wgsl"
#if ROUGH_CONDUCTOR
#include "bsdf/energy.wgsl"
#endif
#if ROUGH_CONDUCTOR
#include "bsdf/ggx.wgsl"
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

#if GRAIN
fn is_brushed(m: Material) -> bool {
    return m.kind == MATERIAL_KIND_BRUSHED_CONDUCTOR;
}
#endif

// Where the mean of a mirror's energy table is; behind it, for brushed metal, come its width along x and cosine and sine of the grain's rotation.
fn conductor_mean(m: Material) -> u32 {
#if GRAIN
    return m.table + ENERGY_MU * select(1u, ENERGY_GRAIN, is_brushed(m));
#else
    return m.table + ENERGY_MU;
#endif
}

fn conductor_width(m: Material) -> Width {
#if GRAIN
    if (is_brushed(m)) {
        return vec2f(tables[conductor_mean(m) + 1u], m.alpha);
    }
#endif
    return Width(m.alpha);
}

// What single scattering of a perfect mirror loses of light along `w`, 1 - E.
fn conductor_missing(m: Material, w: vec3f) -> f32 {
    let c = centred(w.z, ENERGY_MU);
    let at = m.table + u32(c.x);
#if GRAIN
    if (is_brushed(m)) {
        // Facets look the wider the nearer the azimuth is to x.
        let row = abs(w.x) * inverseSqrt(max(dot(w.xy, w.xy), 1e-30)) * f32(ENERGY_GRAIN - 1u);
        let first = min(floor(row), f32(ENERGY_GRAIN - 2u));
        let here = at + u32(first) * ENERGY_MU;
        let next = here + ENERGY_MU;
        return mix(mix(tables[here], tables[here + 1u], c.y), mix(tables[next], tables[next + 1u], c.y), row - first);
    }
#endif
    return mix(tables[at], tables[at + 1u], c.y);
}

fn pdf_rough_conductor(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let h = normalize(wo + wi);
    let visible = pdf_visible_normal(wo, h, conductor_width(m)) / (4.0 * max(dot(wo, h), 1e-10));
    return mix(visible, wi.z * INV_PI, conductor_missing(m, wo));
}

fn eval_rough_conductor(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let m = (*b).m;
    let h = normalize(wo + wi);
    let width = conductor_width(m);
    let visible = select(0.0, pdf_visible_normal(wo, h, width) / (4.0 * max(dot(wo, h), 1e-10)), wi.z > 0.0);
    let single = select(0.0, visible * shadowing(wo, wi, width), wi.z > 0.0);
    let missing_o = conductor_missing(m, wo);
    let missing_i = conductor_missing(m, wi);
    let mean_missing = tables[conductor_mean(m)];
    let multiple =
        select(0.0, missing_o * missing_i * wi.z * INV_PI / mean_missing, mean_missing > ENERGY_MIN_MEAN);
#if COAT
    var out = coat_transmittance(b, wi.z);
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let f_avg = conductor_average(b, k);
        var r = conductor_reflectance(b, dot(wo, h), k);
        var r_multiple = f_avg * f_avg * (1.0 - mean_missing) / (1.0 - f_avg * mean_missing);
#if COAT
        r = mirror_under_coat(b, r, out[k], k);
        r_multiple = mirror_under_coat(b, r_multiple, out[k], k);
#endif
        (*f)[k] = select(vec4f(0.0), single * r + multiple * r_multiple, wi.z > 0.0);
    }
    let pdf = select(0.0, mix(visible, wi.z * INV_PI, missing_o), wi.z > 0.0);
    return BsdfPdf(pdf, pdf, pdf_rough_conductor(m, wi, wo));
}

fn sample_rough_conductor(m: Material, wo: vec3f, u_lobe: f32, u: vec2f) -> vec3f {
    if (u_lobe < conductor_missing(m, wo)) {
        return sample_cosine(u);
    }
    return reflect(-wo, sample_visible_normal(wo, conductor_width(m), u));
}
#endif
