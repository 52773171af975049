// Spectra of the pass at hand. Wavelengths are shared by all paths of a pass, so the host evaluates every spectrum of the scene at them in
// double precision, and a spectrum here is a row of WAVELENGTHS4 vectors. The first rows, ROW_*, are the film's.
#include "common/params.wgsl"
#include "common/math.wgsl"

alias Spectrum = array<vec4f, WAVELENGTHS4>;

@group(0) @binding(4) var spectra: Table<vec4f, PassHead>;

var<private> pass_base: u32; // first texel of this pass

fn begin_pass(pass_index: u32) {
    pass_base = pass_index * params.spectra_stride;
}

fn pass_head() -> PassHead {
    return load_PassHead_at(pass_base);
}

// Wavelengths 4k .. 4k+3 of spectrum `row`.
fn spectrum(row: u32, k: u32) -> vec4f {
    return load_spectra(pass_base + TEXELS_OF_PassHead + row * WAVELENGTHS4 + k);
}

// What one wavelength's radiance counts for in its bin, X, Y and Z.
fn film_weights(wavelength: u32) -> vec4f {
    return load_spectra(pass_base + TEXELS_OF_PassHead + ROW_FILM * WAVELENGTHS4 + wavelength);
}

#if DISPERSION
// The index of refraction of row `row`, of a volume, at a wavelength that may be a hero, and what it changes by to the next (src/integrator/wavelengths.rs).
fn index_at(row: u32, hero: i32) -> vec2f {
    return load_spectra(pass_base + TEXELS_OF_PassHead + (row + 1u) * WAVELENGTHS4 + u32(hero + i32(BEYOND))).xy;
}
#endif

// One where the wavelength index is `wavelength`, else zero.
fn one_hot(wavelength: u32, k: u32) -> vec4f {
    return select(vec4f(0.0), vec4f(1.0), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) == vec4u(wavelength));
}

// Value of a spectrum at one wavelength.
fn spectrum_at(row: u32, wavelength: u32) -> f32 {
    return component(spectrum(row, wavelength / 4u), wavelength % 4u);
}
