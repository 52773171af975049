// Unpolarised Fresnel reflectance, four wavelengths at a time.
#include "common/math.wgsl"

// Square of the transmitted cosine, negative under total internal reflection; `eta` = eta_t / eta_i. Written without 1 - cos^2, so that it keeps its
// digits near the critical angle and is exactly cos_i^2 for matched indices.
fn cos_transmitted_squared(cos_i: f32, eta: vec4f) -> vec4f {
    return ((eta - 1.0) * (eta + 1.0) + cos_i * cos_i) / (eta * eta);
}

// Direction of `d` behind a boundary with normal `n` towards it; `cos_t2` as above.
fn refracted_direction(d: vec3f, n: vec3f, cos_i: f32, eta: f32, cos_t2: f32) -> vec3f {
    return normalize(d / eta + (cos_i / eta - sqrt(max(cos_t2, 0.0))) * n);
}

// Reflectance of a smooth dielectric boundary for cos_i >= 0.
fn fresnel_dielectric(cos_i: f32, eta: vec4f) -> vec4f {
    let c2 = cos_transmitted_squared(cos_i, eta);
    let cos_t = sqrt(max(c2, vec4f(0.0)));
    let tiny = vec4f(1e-20);
    let rs = (cos_i - eta * cos_t) / max(cos_i + eta * cos_t, tiny);
    let rp = (eta * cos_i - cos_t) / max(eta * cos_i + cos_t, tiny);
    return select(0.5 * (rs * rs + rp * rp), vec4f(1.0), c2 <= vec4f(0.0));
}

// What refraction does to what a path carries: radiance changes with the square of the index (Veach 1997, 5.2), flux does not.
fn refracted_radiance(eta: vec4f) -> vec4f {
#if LIGHT_PATHS
    return vec4f(1.0);
#else
    return 1.0 / (eta * eta);
#endif
}

#if CONDUCTOR
// Reflectance of a metal of relative index eta + i k (Born & Wolf 14.2; Lagarde 2013, with a^2 + b^2 + c^2 - 2 a c as (a - c)^2 + b^2 and the like,
// so that digits do not cancel where little is reflected).
fn fresnel_conductor(cos_i: f32, eta: vec4f, k: vec4f) -> vec4f {
    let c2 = cos_i * cos_i;
    let s2 = 1.0 - c2;
    let tiny = vec4f(1e-30);
    let t0 = eta * eta - k * k - s2;
    let t1 = 2.0 * eta * eta * k * k;
    let sum = sqrt(t0 * t0 + 2.0 * t1); // a^2 + b^2
    let a2 = select(0.5 * (sum + t0), t1 / max(sum - t0, tiny), t0 < vec4f(0.0));
    let b2 = select(0.5 * (sum - t0), t1 / max(sum + t0, tiny), t0 > vec4f(0.0));
    let a = sqrt(a2);
    let minus = a - cos_i;
    let plus = a + cos_i;
    let rs = (minus * minus + b2) / max(plus * plus + b2, tiny);
    let minus_p = cos_i * a - s2;
    let plus_p = cos_i * a + s2;
    let rp = rs * (minus_p * minus_p + c2 * b2) / max(plus_p * plus_p + c2 * b2, tiny);
    return 0.5 * (rs + rp);
}

#if ROUGH_CONDUCTOR
// Hemispherical mean of it by four-point Gauss-Legendre, to 5e-4: it weighs only what rough metal scatters more than once.
fn fresnel_conductor_average(eta: vec4f, k: vec4f) -> vec4f {
    return 0.0241522 * fresnel_conductor(0.0694318, eta, k) + 0.2152141 * fresnel_conductor(0.3300095, eta, k)
        + 0.4369311 * fresnel_conductor(0.6699905, eta, k) + 0.3237026 * fresnel_conductor(0.9305682, eta, k);
}
#endif
#endif

#if COLORED_CONDUCTOR
// Reflectance of what reflects `f0` at normal incidence (Schlick 1994, eq. 15).
fn schlick(cos_i: f32, f0: vec4f) -> vec4f {
    let s = 1.0 - cos_i;
    let s2 = s * s;
    return f0 + (1.0 - f0) * (s2 * s2 * s);
}

#if ROUGH_CONDUCTOR
fn schlick_average(f0: vec4f) -> vec4f {
    return f0 + (1.0 - f0) / 21.0;
}
#endif
#endif
