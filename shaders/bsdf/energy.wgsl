// Energy tables of rough materials (the model: src/bsdf/energy.rs).
#include "common/math.wgsl"
@group(0) @binding(10) var<storage, read> tables: array<f32>;

// Weights of a linear interpolation between cell centres (i + 1/2) / n.
fn centred(x: f32, n: u32) -> vec2f {
    let f = clamp(x * f32(n) - 0.5, 0.0, f32(n - 1u));
    let i = min(floor(f), f32(n - 2u));
    return vec2f(i, f - i);
}

#if ROUGH_DIELECTRIC || COAT
// Where relative indices are among the rows of an energy table.
fn eta_rows(eta: vec4f) -> vec4f {
    return clamp((log(eta) / log(ENERGY_ETA_MAX) * 0.5 + 0.5) * f32(ENERGY_ETA - 1u), vec4f(0.0), vec4f(f32(ENERGY_ETA - 1u)));
}
#endif
