// Spectra of the pass at hand. Wavelengths are shared by all paths of a pass, so the host evaluates every spectrum of the scene at them in
// double precision, and a spectrum here is a row of LANES4 vectors. The first rows, ROW_*, are the film's.
#include "common/params.wgsl"
#include "common/math.wgsl"

alias Spectrum = array<vec4f, LANES4>;

@group(0) @binding(4) var spectra: Table<vec4f, PassHead>;

var<private> pass_base: u32; // first texel of this pass

fn begin_pass(pass_index: u32) {
    pass_base = pass_index * params.spectra_stride;
}

fn pass_head() -> PassHead {
    return load_PassHead_at(pass_base);
}

// Lanes 4k .. 4k+3 of spectrum `row`.
fn spectrum(row: u32, k: u32) -> vec4f {
    return load_spectra(pass_base + TEXELS_OF_PassHead + row * LANES4 + k);
}

// One where the lane index is `lane`, else zero.
fn one_hot(lane: u32, k: u32) -> vec4f {
    return select(vec4f(0.0), vec4f(1.0), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) == vec4u(lane));
}

// Value of a spectrum at one lane.
fn spectrum_at(row: u32, lane: u32) -> f32 {
    return component(spectrum(row, lane / 4u), lane % 4u);
}
