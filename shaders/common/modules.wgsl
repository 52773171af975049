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
#if CONDUCTOR
// Index of what a metal lies in; its own is relative to that.
fn index_around(k: u32) -> vec4f {
#if INTERIORS
    return spectrum(interior_at(ruling_interior(inside)).eta_row, k);
#else
    return vec4f(1.0);
#endif
}
#endif
#if FRESNEL
#include "bsdf/fresnel.wgsl"
#endif
#if ROUGH
#include "bsdf/rough.wgsl"
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
