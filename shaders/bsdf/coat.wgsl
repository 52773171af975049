// Clear coats (the model and its sources: src/bsdf/coat.rs). A coat's own reflection and what lies under it are two parts, of which a path takes one, as of a
// mixture: so that of each of them pdf times cosine is what path/mis.wgsl asks for. What enters at the path's own angle is in its throughput then,
// what leaves again is put to it with the direction.
//
// A software driver takes both ways of every branch, and reads tables word by word: what a path needs to know of its coat is looked up once at each vertex
// and for all wavelengths together.
#include "bsdf/bsdf.wgsl"
#if NORMAL_MAPS
#include "geometry/texture.wgsl"
#endif
#include "bsdf/fresnel.wgsl"
#include "bsdf/energy.wgsl"
#include "bsdf/ggx.wgsl"

// Notes of the coat `m` what does not depend on directions.
fn look_at_coat(b: ptr<function, Bsdf>, m: Material) {
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*b).coat_eta[k] = spectrum(m.a, k) / index_outside(k);
        (*b).coat_row[k] = eta_rows((*b).coat_eta[k]);
    }
}

// A column of the table at all indices: `at` is its entry in row 0, `stride` the way to the next row, `next` the weight of the entry beside it, 0 if
// that does not count. From row to row it is linear. Most coats have one index for all wavelengths, so that two rows are all.
fn coat_column(b: ptr<function, Bsdf>, at: u32, stride: u32, next: f32) -> Spectrum {
    var least = (*b).coat_row[0];
    var greatest = (*b).coat_row[0];
    for (var k = 1u; k < WAVELENGTHS4; k++) {
        least = min(least, (*b).coat_row[k]);
        greatest = max(greatest, (*b).coat_row[k]);
    }
    let last = min(u32(ceil(max4(greatest))), ENERGY_ETA - 1u);
    var row = min(u32(-max4(-least)), ENERGY_ETA - 2u);
    var entry = at + row * stride;
    var here = mix(tables[entry], tables[entry + 1u], next);
    var column: Spectrum;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        column[k] = vec4f(here);
    }
    loop {
        entry += stride;
        let beyond = mix(tables[entry], tables[entry + 1u], next);
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            column[k] += (beyond - here) * clamp((*b).coat_row[k] - f32(row), vec4f(0.0), vec4f(1.0));
        }
        here = beyond;
        row += 1u;
        if (row >= last) {
            break;
        }
    }
    return column;
}

// What the coat `m`, of which look_at_coat took note, lets through at cosine `mu`.
fn transmittance_of_coat(b: ptr<function, Bsdf>, m: Material, mu: f32) -> Spectrum {
    var share: Spectrum;
#if ROUGH_COAT
    let cell = centred(mu, ENERGY_MU);
    share = coat_column(b, m.table + u32(cell.x), ENERGY_MU, cell.y);
#endif
#if SMOOTH_COAT
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        share[k] = select(share[k], 1.0 - fresnel_dielectric(mu, (*b).coat_eta[k]), m.alpha == 0.0);
    }
#endif
    return share;
}

// What is scattered at cosine `mu` and gets out of the coat, if there is one.
fn coat_transmittance(b: ptr<function, Bsdf>, mu: f32) -> Spectrum {
    return transmittance_of_coat(b, load_Material(select((*b).coat, 0u, (*b).coat == NONE)), mu);
}

// A factor on what is under the coat, if there is one.
fn if_coated(b: ptr<function, Bsdf>, factor: vec4f) -> vec4f {
    return select(factor, vec4f(1.0), (*b).coat == NONE);
}

#if DIFFUSE
// Reflectance of paint of reflectance `rho` but for the ways in and out.
fn under_coat(b: ptr<function, Bsdf>, rho: vec4f, k: u32) -> vec4f {
    let n2 = select((*b).coat_eta[k] * (*b).coat_eta[k], (*b).coat_mean[k], (*b).coat_is_seen);
    return rho * if_coated(b, 1.0 / (n2 - rho * (n2 - (*b).coat_mean[k])));
}
#endif

#if CONDUCTOR
// Reflectance of a mirror or facet of reflectance `r`, but for the way in; `out` is what gets out.
fn mirror_under_coat(b: ptr<function, Bsdf>, r: vec4f, out: vec4f, k: u32) -> vec4f {
    return r * if_coated(b, out / max(1.0 - r + r * max(out, (*b).coat_entered[k]), vec4f(1e-20)));
}
#endif

// Decides between the coat's own reflection (true) and what is under it, for a path that arrives with the throughput `above` at cosine `mu` to the normal of
// what is under it and `mu_coat` to its own: puts the share that goes there into beta.
fn choose_coat(b: ptr<function, Bsdf>, above: ptr<function, Spectrum>, mu: f32, mu_coat: f32, u: f32) -> bool {
    let m = load_Material((*b).coat);
    look_at_coat(b, m);
    (*b).coat_is_seen = (m.c & 1u) != 0u;
    (*b).coat_entered = transmittance_of_coat(b, m, mu);
    // The share that is not reflected, and that which gets to what is under it.
    var enters = (*b).coat_entered;
#if COAT_NORMALS
    enters = transmittance_of_coat(b, m, mu_coat);
#endif
#if LIGHT_PATHS
    let below = (*b).coat_entered;
#else
    let below = enters;
#endif
    (*b).coat_mean = coat_column(b, m.table + ENERGY_ETA * ENERGY_MU, 1u, 0.0);
    var carried = vec4f(0.0);
    var reflected = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        carried += (*above)[k];
        reflected += (*above)[k] * (1.0 - enters[k]);
    }
    let total = sum4(carried);
    // Highlights are bright on what is dark: a quarter at least.
    let p = clamp(select(0.0, sum4(reflected) / total, total > 0.0), 0.25, 0.999);
    let reflects = u < p;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        // Rough coats weigh with the direction.
        let share = select(1.0 - enters[k], vec4f(1.0), m.alpha > 0.0);
        beta[k] = select(beta[k] * below[k] / (1.0 - p), (*above)[k] * share / p, reflects);
    }
    return reflects;
}

#if COAT_NORMALS
// The normal of the coat `m` at `s`.
fn normal_of_coat(m: Material, s: Surface) -> vec3f {
    var shape = s;
    shape.ns = select(s.ns, s.ns_of_shape, m.c > 1u);
#if NORMAL_MAPS
    if (m.c > 3u) {
        return mapped_normal((m.c >> 1u) - 2u, shape);
    }
#endif
    return shape.ns;
}

#if LIGHT_PATHS
// What the eye at `w` sees of light from under the coat, over what it would if the coat had the normal `ns` of that.
fn seen_through_coat(b: ptr<function, Bsdf>, ns: vec3f, w: vec3f) -> Spectrum {
    var share: Spectrum;
    let m = load_Material(select((*b).coat, 0u, (*b).coat == NONE));
    let as_it_is = transmittance_of_coat(b, m, min(abs(dot(w, (*b).coat_normal)), 1.0));
    let as_base = transmittance_of_coat(b, m, min(abs(dot(w, ns)), 1.0));
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        share[k] = if_coated(b, as_it_is[k] / max(as_base[k], vec4f(1e-9)));
    }
    return share;
}
#endif
#endif

#if ROUGH_COAT
// pdf of sampling a visible normal and reflecting there.
fn pdf_coat(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    let h = normalize(wo + wi);
    return select(0.0, pdf_visible_normal(wo, h, Width(m.alpha)) / (4.0 * max(dot(wo, h), 1e-10)), wo.z > 0.0 && wi.z > 0.0);
}

fn eval_coat(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let m = (*b).m;
    let pdf = pdf_coat(m, wo, wi);
    let single = select(0.0, pdf * shadowing(wo, wi, Width(m.alpha)), pdf > 0.0);
    let cos_i = max(dot(wo, normalize(wo + wi)), 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*f)[k] = single * fresnel_dielectric(cos_i, (*b).coat_eta[k]);
    }
    return BsdfPdf(pdf, pdf, pdf_coat(m, wi, wo));
}
#endif
