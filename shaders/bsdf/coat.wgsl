// Clear coats (the model and its sources: src/bsdf/coat.rs). A coat's own reflection and what lies under it are two parts, of which a path takes one, as of a
// mixture: so that of each of them pdf times cosine is what techniques.wgsl asks for. What enters at the path's own angle is in its throughput then,
// what leaves again is put to it with the direction.

var<private> coat: u32; // the material that covers the surface at hand, or NONE

// The last look-up in an energy table: most coats have one index for all wavelengths, and need no other.
var<private> known_at: vec3f; // table, cosine, relative index
var<private> known: vec2f;

// Of four relative indices what enters (x) and its mean over all cosines (y). A loop, so that compilers have one look-up to do.
fn coat_energy(table: u32, mu: f32, eta: vec4f) -> array<vec4f, 2> {
    var energy = array<vec4f, 2>(vec4f(0.0), vec4f(0.0));
    for (var c = 0u; c < 4u; c++) {
        let at = vec3f(f32(table), mu, component(eta, c));
        if (any(known_at != at)) {
            known_at = at;
            known = missing_energy(table, mu, at.z);
        }
        energy[0] = select(energy[0], vec4f(known.x), vec4u(0u, 1u, 2u, 3u) == vec4u(c));
        energy[1] = select(energy[1], vec4f(known.y), vec4u(0u, 1u, 2u, 3u) == vec4u(c));
    }
    return energy;
}

// What of light at cosine `mu` enters.
fn coat_transmittance(m: Material, mu: f32, k: u32) -> vec4f {
    let eta = spectrum(m.a, k) / index_outside(k);
#if ROUGH_COAT
    if (m.alpha > 0.0) {
        return coat_energy(m.table, mu, eta)[0];
    }
#endif
    return 1.0 - fresnel_dielectric(mu, eta);
}

// What is scattered at cosine `mu` and gets out of the coat, if there is one.
fn out_of_coat(mu: f32, k: u32) -> vec4f {
    if (coat == NONE) {
        return vec4f(1.0);
    }
    return coat_transmittance(material_at(coat), mu, k);
}

#if DIFFUSE
// Reflectance of paint of reflectance `rho` but for the ways in and out.
fn under_coat(rho: vec4f, k: u32) -> vec4f {
    if (coat == NONE) {
        return rho;
    }
    let m = material_at(coat);
    let eta = spectrum(m.a, k) / index_outside(k);
    let mean = coat_energy(m.table, 1.0, eta)[1];
    return rho / (eta * eta - rho * (eta * eta - mean));
}
#endif

#if CONDUCTOR
// Reflectance of a mirror or facet of reflectance `r`, but for the way in.
fn mirror_under_coat(r: vec4f, mu_o: f32, mu_i: f32, k: u32) -> vec4f {
    if (coat == NONE) {
        return r;
    }
    let m = material_at(coat);
    let out = coat_transmittance(m, mu_i, k);
    return r * out / max(1.0 - r + r * max(out, coat_transmittance(m, mu_o, k)), vec4f(1e-20));
}
#endif

// Decides between a coat's own reflection (true) and what is under it, for a path that arrives at cosine `mu`: puts the share that goes there into beta.
fn choose_coat(m: Material, mu: f32, u: f32) -> bool {
    var reflected = 0.0;
    for (var k = 0u; k < LANES4; k++) {
        reflected += dot(beta[k], 1.0 - coat_transmittance(m, mu, k));
    }
    let total = sum_beta();
    // Highlights are bright on what is dark: a quarter at least.
    let p = clamp(select(0.0, reflected / total, total > 0.0), 0.25, 0.999);
    let reflects = u < p;
    for (var k = 0u; k < LANES4; k++) {
        let entered = coat_transmittance(m, mu, k);
        // Rough coats weigh with the direction.
        let share = select(1.0 - entered, vec4f(1.0), m.alpha > 0.0);
        beta[k] *= select(entered / (1.0 - p), share / p, reflects);
    }
    return reflects;
}

#if ROUGH_COAT
// pdf of sampling a visible normal and reflecting there.
fn pdf_coat(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    let h = normalize(wo + wi);
    return select(0.0, pdf_visible_normal(wo, h, m.alpha) / (4.0 * max(dot(wo, h), 1e-10)), wo.z > 0.0 && wi.z > 0.0);
}

// Fills bsdf_f; returns the pdf.
fn eval_coat(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    let pdf = pdf_coat(m, wo, wi);
    let single = select(0.0, pdf * shadowing(wo, wi, m.alpha), pdf > 0.0);
    for (var k = 0u; k < LANES4; k++) {
        bsdf_f[k] = single * fresnel_dielectric(max(dot(wo, normalize(wo + wi)), 0.0), spectrum(m.a, k) / index_outside(k));
    }
    return pdf;
}
#endif
