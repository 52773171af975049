// Rough mirrors: GGX facets that reflect all light, and a lobe that gives back what single scattering loses (the model and its tables: src/bsdf/energy.rs). Of
// what they reflect metal keeps its share; a pane throws some to its other side.
#include "bsdf/material.wgsl"
#include "bsdf/energy.wgsl"
#include "bsdf/ggx.wgsl"

// What facets reflect from `wi` to `wo`, cosine included.
struct RoughMirror {
    single: f32, // by one facet
    multiple: f32, // what more of them give back
    mean_missing: f32, // the share of all light that is lost to one
    cos_facet: f32, // at the facet that reflects `wo` to `wi`
    pdf: f32,
}

#if GRAIN
fn is_brushed(m: Material) -> bool {
    return m.kind == MATERIAL_KIND_BRUSHED_CONDUCTOR || m.kind == MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC;
}
#endif

// Where the mean of a mirror's energy table is; behind it, where it is brushed, come its width along x and cosine and sine of the grain's rotation.
fn mirror_mean(m: Material) -> u32 {
#if GRAIN
    return m.table + ENERGY_MU * select(1u, ENERGY_GRAIN, is_brushed(m));
#else
    return m.table + ENERGY_MU;
#endif
}

fn mirror_width(m: Material) -> Width {
#if GRAIN
    if (is_brushed(m)) {
        return vec2f(tables[mirror_mean(m) + 1u], m.alpha);
    }
#endif
    return Width(m.alpha);
}

// What single scattering of a perfect mirror loses of light along `w`, 1 - E.
fn mirror_missing(m: Material, w: vec3f) -> f32 {
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

// `wi.z` > 0, of `wo` as well.
fn pdf_mirror(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let h = normalize(wo + wi);
    let visible = pdf_visible_normal(wo, h, mirror_width(m)) / (4.0 * max(dot(wo, h), 1e-10));
    return mix(visible, wi.z * INV_PI, mirror_missing(m, wo));
}

fn eval_mirror(m: Material, wo: vec3f, wi: vec3f) -> RoughMirror {
    let h = normalize(wo + wi);
    let width = mirror_width(m);
    let visible = select(0.0, pdf_visible_normal(wo, h, width) / (4.0 * max(dot(wo, h), 1e-10)), wi.z > 0.0);
    let single = select(0.0, visible * shadowing(wo, wi, width), wi.z > 0.0);
    let missing_o = mirror_missing(m, wo);
    let missing_i = mirror_missing(m, wi);
    let mean_missing = tables[mirror_mean(m)];
    let multiple =
        select(0.0, missing_o * missing_i * wi.z * INV_PI / mean_missing, mean_missing > ENERGY_MIN_MEAN);
    let pdf = select(0.0, mix(visible, wi.z * INV_PI, missing_o), wi.z > 0.0);
    return RoughMirror(single, multiple, mean_missing, dot(wo, h), pdf);
}

fn sample_mirror(m: Material, wo: vec3f, u_lobe: f32, u: vec2f) -> vec3f {
    if (u_lobe < mirror_missing(m, wo)) {
        return sample_cosine(u);
    }
    return reflect(-wo, sample_visible_normal(wo, mirror_width(m), u));
}
