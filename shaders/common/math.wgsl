// Small mathematics shared by all modules. Nothing here relies on NaN comparisons, fused multiply-adds or accurate acos/atan2.

const PI = 3.14159265358979;
const INV_PI = 0.318309886183791;
const INFINITE = 3.0e38;
const NONE = 0xffffffffu;
// Stands for the value of a sample that the driver did not let finish: no radiance is this.
const UNFINISHED = -3.0e38;
// Radiance that the film takes, summed over the wavelengths of a sample, W m^-2 sr^-1 nm^-1: 2^22 of its luminances still have a sum in single precision.
const LARGEST_SAMPLE = 1.0e26;
// gamma(n) = n u / (1 - n u), u = 2^-24: bound on n rounded operations (Higham 2002; pbrt-v4, 6.8.1).
const GAMMA_7 = 4.1723254e-7;

// True for neither NaN nor infinity: tests the exponent's bits, since comparisons with NaN are unreliable on some adapters.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn sum4(v: vec4f) -> f32 {
    return (v.x + v.y) + (v.z + v.w);
}

fn max4(v: vec4f) -> f32 {
    return max(max(v.x, v.y), max(v.z, v.w));
}

// Component `i` of four; an index that differs between lanes is slow on a software driver.
fn component(v: vec4f, i: u32) -> f32 {
    return select(select(v.x, v.y, i == 1u), select(v.z, v.w, i == 3u), i >= 2u);
}

// Orthonormal basis around a unit vector: columns tangent, bitangent, n. Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017.
fn frame_around(n: vec3f) -> mat3x3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat3x3f(vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y), n);
}

// Likewise, the tangent level and the bitangent upright (along z, around directions that are upright themselves): as edges tend to be, so that the guide
// finds them along its axes.
fn level_frame(n: vec3f) -> mat3x3f {
    let up = select(vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0), abs(n.y) > 0.9999);
    let level = normalize(cross(up, n));
    return mat3x3f(level, cross(n, level), n);
}

// Unit disc, area-preserving (Shirley & Chiu 1997).
fn sample_disc(u: vec2f) -> vec2f {
    let p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0) {
        return vec2f(0.0);
    }
    let wide = abs(p.x) > abs(p.y);
    let r = select(p.y, p.x, wide);
    let phi = select(0.5 * PI - 0.25 * PI * (p.x / p.y), 0.25 * PI * (p.y / p.x), wide);
    return r * vec2f(cos(phi), sin(phi));
}

// Cosine-weighted direction about +z; pdf (solid angle) = z / pi.
fn sample_cosine(u: vec2f) -> vec3f {
    let p = sample_disc(u);
    return vec3f(p, sqrt(max(0.0, 1.0 - dot(p, p))));
}

// Uniform direction in the cone about +z with 1 - cos(angle) = `one_minus_cos`; pdf = 1 / (2 pi one_minus_cos). By way of the disc, in which straight edges
// stay nearly straight: in angle and radius they are curves, and a slit is what no box of the guide fits.
fn sample_cone(u: vec2f, one_minus_cos: f32) -> vec3f {
    let p = sample_disc(u);
    let h = one_minus_cos * dot(p, p);
    return vec3f(p * sqrt(one_minus_cos * (2.0 - h)), 1.0 - h);
}
