// Spectra of the pass at hand. Wavelengths are shared by all paths of a pass, so the host evaluates every spectrum of the scene at them in
// double precision, and a spectrum here is a row of LANES4 vectors. Rows 0..3 are the film's weights (bin, X, Y, Z).

const ROW_BIN = 0u;
const ROW_X = 1u;
const ROW_Y = 2u;
const ROW_Z = 3u;

var<private> pass_base: u32; // first vector of this pass

// Lanes 4k .. 4k+3 of spectrum `row`.
fn spectrum(row: u32, k: u32) -> vec4f {
    return bitcast<vec4f>(fetch(spectra, pass_base + row * LANES4 + k));
}

// One where the lane index is `lane`, else zero.
fn one_hot(lane: u32, k: u32) -> vec4f {
    return select(vec4f(0.0), vec4f(1.0), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) == vec4u(lane));
}
