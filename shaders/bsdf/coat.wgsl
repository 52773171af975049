// Clear coats (the model and its sources: src/bsdf/coat.rs). A coat's own reflection and what lies under it are two parts, of which a path takes one, as of a
// mixture: so that of each of them pdf times cosine is what techniques.wgsl asks for. What enters at the path's own angle is in its throughput then,
// what leaves again is put to it with the direction.
//
// A software driver takes both ways of every branch, and reads tables word by word: what a path needs to know of its coat is looked up once at each vertex
// and for all wavelengths together.

var<private> coat: u32; // the material that covers the surface at hand, or NONE
var<private> coat_eta: array<vec4f, LANES4>; // index of the coat that was looked at last, over that outside
var<private> coat_row: array<vec4f, LANES4>; // where that is in its energy table
var<private> coat_share: array<vec4f, LANES4>; // what it lets through at the cosine that was asked for last
var<private> coat_entered: array<vec4f, LANES4>; // what it lets in of the path at hand
var<private> coat_mean: array<vec4f, LANES4>; // what it lets in of uniform light
var<private> beta_on_coat: array<vec4f, LANES4>; // throughput of the path that arrives at it

fn look_at_coat(m: Material) {
    for (var k = 0u; k < LANES4; k++) {
        coat_eta[k] = spectrum(m.a, k) / index_outside(k);
        coat_row[k] = eta_rows(coat_eta[k]);
    }
}

// A column of the table at all indices: `at` is its entry in row 0, `stride` the way to the next row, `next` the weight of the entry beside it, 0 if
// that does not count. From row to row it is linear. Most coats have one index for all wavelengths, so that two rows are all.
fn coat_column(at: u32, stride: u32, next: f32) -> array<vec4f, LANES4> {
    var least = coat_row[0];
    var greatest = coat_row[0];
    for (var k = 1u; k < LANES4; k++) {
        least = min(least, coat_row[k]);
        greatest = max(greatest, coat_row[k]);
    }
    let last = min(u32(ceil(max4(greatest))), ENERGY_ETA - 1u);
    var row = min(u32(-max4(-least)), ENERGY_ETA - 2u);
    var entry = at + row * stride;
    var here = mix(tables[entry], tables[entry + 1u], next);
    var column: array<vec4f, LANES4>;
    for (var k = 0u; k < LANES4; k++) {
        column[k] = vec4f(here);
    }
    loop {
        entry += stride;
        let beyond = mix(tables[entry], tables[entry + 1u], next);
        for (var k = 0u; k < LANES4; k++) {
            column[k] += (beyond - here) * clamp(coat_row[k] - f32(row), vec4f(0.0), vec4f(1.0));
        }
        here = beyond;
        row += 1u;
        if (row >= last) {
            break;
        }
    }
    return column;
}

// Fills coat_share for the coat that was looked at.
fn look_through_coat(m: Material, mu: f32) {
#if ROUGH_COAT
    let cell = centred(mu, ENERGY_MU);
    coat_share = coat_column(m.table + u32(cell.x), ENERGY_MU, cell.y);
#endif
#if SMOOTH_COAT
    for (var k = 0u; k < LANES4; k++) {
        coat_share[k] = select(coat_share[k], 1.0 - fresnel_dielectric(mu, coat_eta[k]), m.alpha == 0.0);
    }
#endif
}

// Fills coat_share with what is scattered at cosine `mu` and gets out of the coat, if there is one.
fn look_out_of_coat(mu: f32) {
    look_through_coat(load_Material(select(coat, 0u, coat == NONE)), mu);
}

// A factor on what is under the coat, if there is one.
fn if_coated(factor: vec4f) -> vec4f {
    return select(factor, vec4f(1.0), coat == NONE);
}

#if DIFFUSE
// Reflectance of paint of reflectance `rho` but for the ways in and out.
fn under_coat(rho: vec4f, k: u32) -> vec4f {
    let n2 = coat_eta[k] * coat_eta[k];
    return rho * if_coated(1.0 / (n2 - rho * (n2 - coat_mean[k])));
}
#endif

#if CONDUCTOR
// Reflectance of a mirror or facet of reflectance `r`, but for the way in; coat_share is that of the way out.
fn mirror_under_coat(r: vec4f, k: u32) -> vec4f {
    return r * if_coated(coat_share[k] / max(1.0 - r + r * max(coat_share[k], coat_entered[k]), vec4f(1e-20)));
}
#endif

// Notes that what the path meets is under coat number `index`.
fn go_under_coat(index: u32) {
    coat = index;
    beta_on_coat = beta;
}

// Decides between the coat's own reflection (true) and what is under it, for a path that arrives at cosine `mu`: puts the share that goes there into beta.
fn choose_coat(mu: f32, u: f32) -> bool {
    let m = load_Material(coat);
    look_at_coat(m);
    look_through_coat(m, mu);
    coat_entered = coat_share;
    coat_mean = coat_column(m.table + ENERGY_ETA * ENERGY_MU, 1u, 0.0);
    var carried = vec4f(0.0);
    var reflected = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        carried += beta_on_coat[k];
        reflected += beta_on_coat[k] * (1.0 - coat_entered[k]);
    }
    let total = sum4(carried);
    // Highlights are bright on what is dark: a quarter at least.
    let p = clamp(select(0.0, sum4(reflected) / total, total > 0.0), 0.25, 0.999);
    let reflects = u < p;
    for (var k = 0u; k < LANES4; k++) {
        // Rough coats weigh with the direction.
        let share = select(1.0 - coat_entered[k], vec4f(1.0), m.alpha > 0.0);
        beta[k] = select(beta[k] * coat_entered[k] / (1.0 - p), beta_on_coat[k] * share / p, reflects);
    }
    return reflects;
}

#if ROUGH_COAT
// pdf of sampling a visible normal and reflecting there.
fn pdf_coat(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    let h = normalize(wo + wi);
    return select(0.0, pdf_visible_normal(wo, h, Width(m.alpha)) / (4.0 * max(dot(wo, h), 1e-10)), wo.z > 0.0 && wi.z > 0.0);
}

// Fills bsdf_f; returns the pdf.
fn eval_coat(m: Material, wo: vec3f, wi: vec3f) -> f32 {
    let pdf = pdf_coat(m, wo, wi);
    let single = select(0.0, pdf * shadowing(wo, wi, Width(m.alpha)), pdf > 0.0);
    let cos_i = max(dot(wo, normalize(wo + wi)), 0.0);
    for (var k = 0u; k < LANES4; k++) {
        bsdf_f[k] = single * fresnel_dielectric(cos_i, coat_eta[k]);
    }
    return pdf;
}
#endif
