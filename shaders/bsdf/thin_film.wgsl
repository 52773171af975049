// Thin films (the model: src/bsdf/film.rs), four wavelengths at a time.
#include "common/math.wgsl"
#include "common/spectra.wgsl"

struct Complex4 {
    re: vec4f,
    im: vec4f,
}

fn complex_mul(a: Complex4, b: Complex4) -> Complex4 {
    return Complex4(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}

fn complex_norm(a: Complex4) -> vec4f {
    return a.re * a.re + a.im * a.im;
}

// (a - b) / (a + b)
fn complex_contrast(a: Complex4, b: Complex4) -> Complex4 {
    let minus = Complex4(a.re - b.re, a.im - b.im);
    let plus = Complex4(a.re + b.re, a.im + b.im);
    let scale = 1.0 / max(complex_norm(plus), vec4f(1e-30));
    return Complex4((minus.re * plus.re + minus.im * plus.im) * scale, (minus.im * plus.re - minus.re * plus.im) * scale);
}

// sqrt(n^2 - s2) for n2 = n^2 of an imaginary part of 0 or more.
fn normal_wave(n2: Complex4, s2: vec4f) -> Complex4 {
    let re = n2.re - s2;
    let size = sqrt(re * re + n2.im * n2.im);
    return Complex4(sqrt(max(0.5 * (size + re), vec4f(0.0))), sqrt(max(0.5 * (size - re), vec4f(0.0))));
}

// Airy's sum of what the faces reflect, squared.
fn airy(front: Complex4, back: Complex4, delay: Complex4) -> vec4f {
    let b = complex_mul(back, delay);
    let ab = complex_mul(front, b);
    return complex_norm(Complex4(front.re + b.re, front.im + b.im)) / max(complex_norm(Complex4(1.0 + ab.re, ab.im)), vec4f(1e-30));
}

// Reflectance for cos_i >= 0 of a film of index `n`, so many wavelengths thick, between indices `near` and `far` + i `far_k`.
fn fresnel_film(cos_i: f32, near: vec4f, n: vec4f, waves: vec4f, far: vec4f, far_k: vec4f) -> vec4f {
    let zero = vec4f(0.0);
    let s2 = near * near * ((1.0 - cos_i) * (1.0 + cos_i));
    let near2 = Complex4(near * near, zero);
    let film2 = Complex4(n * n, zero);
    let far2 = Complex4(far * far - far_k * far_k, 2.0 * far * far_k);
    let q0 = Complex4(near * cos_i, zero);
    let q1 = normal_wave(film2, s2);
    let q2 = normal_wave(far2, s2);
    let fall = exp(-4.0 * PI * waves * q1.im);
    // Turns, less whole ones: sines of large angles are not to be trusted.
    let turns = 2.0 * waves * q1.re;
    let angle = 2.0 * PI * (turns - floor(turns));
    let delay = Complex4(fall * cos(angle), fall * sin(angle));
    let s = airy(complex_contrast(q0, q1), complex_contrast(q1, q2), delay);
    let p = airy(
        complex_contrast(complex_mul(film2, q0), complex_mul(near2, q1)),
        complex_contrast(complex_mul(far2, q1), complex_mul(film2, q2)),
        delay,
    );
    return select(min(0.5 * (s + p), vec4f(1.0)), vec4f(1.0), cos_i <= 0.0);
}

// Reflectance for cos_i >= 0 of the film on material `m`.
fn film_reflectance(m: Material, cos_i: f32, near: vec4f, far: vec4f, far_k: vec4f, k: u32) -> vec4f {
    return fresnel_film(cos_i, near, spectrum(m.c & 0xffffu, k), spectrum(m.c >> 16u, k), far, far_k);
}
