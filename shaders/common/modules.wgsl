// What both passes are made of.
#include "common/spectra.wgsl"
#include "common/path.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#if TEXTURES
#include "geometry/texture.wgsl"
#endif

// Lanes of what a picture may stand for: the reflectance of a diffuse surface, the first part's share of a mixture. The material was looked at.
fn color_of(m: Material, k: u32) -> vec4f {
#if TEXTURES
    if (m.texture != NONE) {
        return surface_color[k];
    }
#endif
    return spectrum(m.a, k);
}
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if MEDIA
#include "medium/homogeneous.wgsl"
#endif
#if CONDUCTOR || COAT || FILM
// Index of what a metal or coat lies in; its own is relative to that.
fn index_outside(k: u32) -> vec4f {
#if INTERIORS
    return spectrum(load_Interior(ruling_interior(inside)).eta_row, k);
#else
    return vec4f(1.0);
#endif
}
#endif
#if CONDUCTOR
fn index_around_metal(k: u32) -> vec4f {
#if COAT
    if (coat != NONE) {
        return spectrum(load_Material(coat).a, k);
    }
#endif
    return index_outside(k);
}

// Reflectance of a metal for cos_i >= 0; the material was looked at.
fn metal_reflectance(m: Material, cos_i: f32, k: u32) -> vec4f {
#if COLORED_CONDUCTOR
    if (m.b == NONE) {
        return schlick(cos_i, color_of(m, k));
    }
#endif
    let n = index_around_metal(k);
#if FILM
    if (m.c != 0u) {
        return film_reflectance(m, cos_i, n, spectrum(m.a, k), spectrum(m.b, k), k);
    }
#endif
    return fresnel_conductor(cos_i, spectrum(m.a, k) / n, spectrum(m.b, k) / n);
}
#endif
#if ROUGH_CONDUCTOR
// Its hemispherical mean.
fn metal_average(m: Material, k: u32) -> vec4f {
#if COLORED_CONDUCTOR
    if (m.b == NONE) {
        return schlick_average(color_of(m, k));
    }
#endif
#if FILM
    if (m.c != 0u) {
        // Four-point Gauss-Legendre as for bare metal.
        return 0.0241522 * metal_reflectance(m, 0.0694318, k) + 0.2152141 * metal_reflectance(m, 0.3300095, k)
            + 0.4369311 * metal_reflectance(m, 0.6699905, k) + 0.3237026 * metal_reflectance(m, 0.9305682, k);
    }
#endif
    let n = index_around_metal(k);
    return fresnel_conductor_average(spectrum(m.a, k) / n, spectrum(m.b, k) / n);
}
#endif
#if FRESNEL
#include "bsdf/fresnel.wgsl"
#endif
#if FILM
#include "bsdf/film.wgsl"

// Reflectance for cos_i >= 0 of the film on material `m`.
fn film_reflectance(m: Material, cos_i: f32, near: vec4f, far: vec4f, far_k: vec4f, k: u32) -> vec4f {
    return fresnel_film(cos_i, near, spectrum(m.c & 0xffffu, k), spectrum(m.c >> 16u, k), far, far_k);
}
#endif
#if ROUGH
#include "bsdf/rough.wgsl"
#endif
#if GRAIN
#include "geometry/grain.wgsl"
#endif
#if COAT
#include "bsdf/coat.wgsl"
#endif
#if SHEEN
#include "bsdf/sheen.wgsl"
#endif
#if GLOSSY
#include "bsdf/glossy.wgsl"
#endif
#if DIFFUSE
// Reflectance of paint, but for the ways into and out of a coat on it.
fn paint_of(m: Material, k: u32) -> vec4f {
#if COAT
    return under_coat(color_of(m, k), k);
#else
    return color_of(m, k);
#endif
}
#endif
#if LIGHTS_PRESENT
#include "light/lights.wgsl"
#endif
#if CAUSTICS
#include "light/aim.wgsl"
#include "sensor/density.wgsl"
#endif
#include "integrator/techniques.wgsl"
#if GATHERED
#include "integrator/visible_points.wgsl"
#endif
