// Sheen over a material (the model and its sources: src/bsdf/sheen.rs): its own reflection and what lies under it are two parts, of which a path takes one,
// as of a coat.
#include "bsdf/bsdf.wgsl"
#include "bsdf/energy.wgsl"

// Behind the albedos of a sheen: half of 1 / alpha, the factor of its distribution, its greatest colour, the fit of its shadows.
const SHEEN_POWER = ENERGY_SHEEN;
const SHEEN_FACTOR = ENERGY_SHEEN + 1u;
const SHEEN_MOST = ENERGY_SHEEN + 2u;
const SHEEN_FIT = ENERGY_SHEEN + 3u;

fn sheen_albedo(m: Material, mu: f32) -> f32 {
    let c = centred(sqrt(max(mu, 0.0)), ENERGY_SHEEN);
    let at = m.table + u32(c.x);
    return mix(tables[at], tables[at + 1u], c.y);
}

fn sheen_transmittance(m: Material, mu: f32) -> f32 {
    return 1.0 - tables[m.table + SHEEN_MOST] * min(sheen_albedo(m, mu), 1.0);
}

// A factor on what is scattered at cosine `mu` under the sheen `index` of which the path entered with the share `entered`, if there is one.
fn out_of_sheen(index: u32, entered: f32, mu: f32) -> f32 {
    let share = sheen_transmittance(load_Material(select(index, 0u, index == NONE)), mu);
    return select(min(share / max(entered, 1e-6), 1.0), 1.0, index == NONE);
}

// Decides between the sheen's own reflection and what is under it, for a path that arrives at cosine `mu` with the throughput `above`: puts the share that
// goes there into beta. Returns 0 for the reflection, else the factor on what is under it.
fn choose_sheen(b: ptr<function, Bsdf>, above: ptr<function, Spectrum>, mu: f32, u: f32) -> f32 {
    let m = load_Material((*b).sheen);
    (*b).sheen_entered = sheen_transmittance(m, mu);
    var carried = vec4f(0.0);
    var reflected = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        carried += (*above)[k];
        reflected += (*above)[k] * spectrum(m.a, k);
    }
    let own = min(sheen_albedo(m, mu), 1.0) * sum4(reflected) / max(sum4(carried), 1e-30);
    let p = clamp(own / max(own + (*b).sheen_entered, 1e-6), 0.05, 0.95);
    let reflects = u < p;
    let below = (*b).sheen_entered / (1.0 - p);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] = select(beta[k] * below, (*above)[k] / p, reflects);
    }
    return select(below, 0.0, reflects);
}

fn pdf_sheen(wo: vec3f, wi: vec3f) -> f32 {
    return select(0.0, wi.z * INV_PI, wo.z > 0.0 && wi.z > 0.0);
}

fn sheen_fit(at: u32, x: f32) -> f32 {
    return tables[at] / (1.0 + tables[at + 1u] * pow(max(x, 1e-9), tables[at + 2u])) + tables[at + 3u] * x + tables[at + 4u];
}

fn sheen_lambda(m: Material, mu: f32) -> f32 {
    let at = m.table + SHEEN_FIT;
    return exp(select(2.0 * sheen_fit(at, 0.5) - sheen_fit(at, 1.0 - mu), sheen_fit(at, mu), mu < 0.5));
}

fn eval_sheen(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let m = (*b).m;
    let pdf = pdf_sheen(wo, wi);
    let h = normalize(wo + wi);
    let slope = pow(max(dot(h.xy, h.xy), 1e-30), tables[m.table + SHEEN_POWER]);
    let shadows = max(wo.z, 1e-6) * (1.0 + sheen_lambda(m, min(wo.z, 1.0)) + sheen_lambda(m, clamp(wi.z, 0.0, 1.0)));
    let limit = max(max(sheen_albedo(m, wo.z), sheen_albedo(m, wi.z)), 1.0);
    let g = select(0.0, tables[m.table + SHEEN_FACTOR] * slope / (shadows * limit), pdf > 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*f)[k] = g * spectrum(m.a, k);
    }
    return BsdfPdf(pdf, pdf, pdf_sheen(wi, wo));
}
