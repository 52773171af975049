// Rough conductor and dielectric: single-scattering GGX plus reciprocal energy compensation (the model and its tables: src/bsdf/energy.rs).
#include "bsdf/ggx.wgsl"

var<private> bsdf_f: array<vec4f, LANES4>; // f * |cos(wi)| per lane, radiance carried from wi to wo

// Weights of a linear interpolation between cell centres (i + 1/2) / n.
fn centred(x: f32, n: u32) -> vec2f {
    let f = clamp(x * f32(n) - 0.5, 0.0, f32(n - 1u));
    let i = min(floor(f), f32(n - 2u));
    return vec2f(i, f - i);
}

#if ROUGH_CONDUCTOR
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

// Fills bsdf_f; returns the pdf.
fn eval_rough_conductor(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    if (wi.z <= 0.0) {
        for (var k = 0u; k < LANES4; k++) {
            bsdf_f[k] = vec4f(0.0);
        }
        return 0.0;
    }
    let h = normalize(wo + wi);
    let width = conductor_width(m);
    let visible = pdf_visible_normal(wo, h, width) / (4.0 * max(dot(wo, h), 1e-10));
    let single = visible * shadowing(wo, wi, width);
    let missing_o = conductor_missing(m, wo);
    let missing_i = conductor_missing(m, wi);
    let mean_missing = tables[conductor_mean(m)];
    let multiple = select(0.0, missing_o * missing_i * wi.z * INV_PI / mean_missing, mean_missing > ENERGY_MIN_MEAN);
#if COAT
    look_out_of_coat(wi.z);
#endif
    for (var k = 0u; k < LANES4; k++) {
        let f_avg = metal_average(m, k);
        var f = metal_reflectance(m, dot(wo, h), k);
        var f_ms = f_avg * f_avg * (1.0 - mean_missing) / (1.0 - f_avg * mean_missing);
#if COAT
        f = mirror_under_coat(f, k);
        f_ms = mirror_under_coat(f_ms, k);
#endif
        bsdf_f[k] = single * f + multiple * f_ms;
    }
    return mix(visible, wi.z * INV_PI, missing_o);
}

fn sample_rough_conductor(m: Material, wo: vec3f, u_lobe: f32, u: vec2f) -> vec3f {
    if (u_lobe < conductor_missing(m, wo)) {
        return sample_cosine(u);
    }
    return reflect(-wo, sample_visible_normal(wo, conductor_width(m), u));
}
#endif

#if ROUGH_DIELECTRIC || COAT
// Where relative indices are among the rows of an energy table.
fn eta_rows(eta: vec4f) -> vec4f {
    return clamp((log(eta) / log(ENERGY_ETA_MAX) * 0.5 + 0.5) * f32(ENERGY_ETA - 1u), vec4f(0.0), vec4f(f32(ENERGY_ETA - 1u)));
}
#endif

#if ROUGH_DIELECTRIC
// Row of the energy table and weight for a relative index.
fn eta_cell(eta: f32) -> vec2f {
    let f = eta_rows(vec4f(eta)).x;
    let i = min(floor(f), f32(ENERGY_ETA - 2u));
    return vec2f(i, f - i);
}

// (1 - E(mu), M) of the side that sees relative index eta.
fn missing_energy(table: u32, mu: f32, eta: f32) -> vec2f {
    let e = eta_cell(eta);
    let c = centred(mu, ENERGY_MU);
    let at = table + u32(e.x) * ENERGY_MU + u32(c.x);
    let missing = mix(mix(tables[at], tables[at + 1u], c.y), mix(tables[at + ENERGY_MU], tables[at + ENERGY_MU + 1u], c.y), e.y);
    let averages = table + ENERGY_ETA * ENERGY_MU + u32(e.x);
    return vec2f(missing, mix(tables[averages], tables[averages + 1u], e.y));
}

// One wavelength: x = f |cos wi| without the factor of refracted radiance, y = pdf. `eta` = index beyond / index on wo's side.
fn rough_dielectric_lane(m: Material, wo: vec3f, wi: vec3f, eta: f32) -> vec2f {
    let reflects = wi.z > 0.0;
    var single = 0.0;
    var h = wo + wi;
    if (!reflects) {
        h = -(wo + eta * wi);
        h = select(h, -h, h.z < 0.0);
    }
    let h_length = length(h);
    if (h_length > 0.0) {
        h /= h_length;
        let oh = dot(wo, h);
        let ih = dot(wi, h);
        if (oh > 0.0 && select(-ih, ih, reflects) > 0.0) {
            let f = fresnel_dielectric(oh, vec4f(eta)).x;
            let s = oh + eta * ih;
            let jacobian = select(eta * eta * abs(ih) / max(s * s, 1e-20), 0.25 / oh, reflects);
            single = select(1.0 - f, f, reflects) * pdf_visible_normal(wo, h, Width(m.alpha)) * jacobian;
        }
    }
    let here = missing_energy(m.table, wo.z, eta);
    let there = missing_energy(m.table, abs(wi.z), select(1.0 / eta, eta, reflects));
    let beyond = eta * eta * missing_energy(m.table, 1.0, 1.0 / eta).y;
    let total = here.y + beyond;
    var multiple = 0.0;
    var multiple_pdf = abs(wi.z) * INV_PI;
    if (there.y > ENERGY_MIN_MEAN && total > 0.0) {
        let share = select(beyond, here.y, reflects) / total;
        multiple = share * here.x * there.x * abs(wi.z) * INV_PI / there.y;
        multiple_pdf *= share;
    } else {
        multiple_pdf *= 0.5;
    }
    return vec2f(single * shadowing(wo, wi, Width(m.alpha)) + multiple, mix(single, multiple_pdf, here.x));
}

// Fills bsdf_f; returns the pdf of the mixture over wavelengths, weighted by beta.
fn eval_rough_dielectric(m: Material, wo: vec3f, wi: vec3f, near_row: u32, far_row: u32) -> f32 {
    var pdf = 0.0;
    let total = sum_beta();
    for (var k = 0u; k < LANES4; k++) {
        let eta = spectrum(far_row, k) / spectrum(near_row, k);
        var f = vec4f(0.0);
        for (var c = 0u; c < 4u; c++) {
            if (beta[k][c] > 0.0) {
                let r = rough_dielectric_lane(m, wo, wi, eta[c]);
                f[c] = r.x;
                pdf += beta[k][c] * r.y;
            }
        }
        bsdf_f[k] = select(f * refracted_radiance(eta), f, wi.z > 0.0);
    }
    return select(0.0, pdf / total, total > 0.0);
}

// Direction sampled for one wavelength; z = 0 marks failure (absorbed, its energy is in the compensation).
fn sample_rough_dielectric(m: Material, wo: vec3f, eta: f32, u_lobe: vec2f, u: vec2f) -> vec3f {
    let here = missing_energy(m.table, wo.z, eta);
    if (u_lobe.x < here.x) {
        let beyond = eta * eta * missing_energy(m.table, 1.0, 1.0 / eta).y;
        let total = here.y + beyond;
        let share = select(0.5, here.y / total, total > 0.0);
        let w = sample_cosine(u);
        return select(vec3f(w.xy, -w.z), w, u_lobe.y < share);
    }
    let h = sample_visible_normal(wo, Width(m.alpha), u);
    let oh = dot(wo, h);
    let f = fresnel_dielectric(oh, vec4f(eta)).x;
    if (u_lobe.y < f) {
        let wi = reflect(-wo, h);
        return select(vec3f(0.0), wi, wi.z > 0.0);
    }
    let c2 = cos_transmitted_squared(oh, vec4f(eta)).x;
    let wi = normalize(-wo / eta + (oh / eta - sqrt(max(c2, 0.0))) * h);
    return select(vec3f(0.0), wi, wi.z < 0.0);
}
#endif
