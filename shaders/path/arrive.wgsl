// What a path may find where it arrives, before chance decides what a surface is.
#include "geometry/trace.wgsl"
#include "geometry/primitives.wgsl"
#include "bsdf/material.wgsl"
#include "bsdf/bsdf.wgsl"
#include "path/state.wgsl"
#include "path/scatter.wgsl"
#if DISPERSION
#include "path/hero.wgsl"
#endif

#if MERGES_AT_SURFACES || DISPERSION
// Whether a path that meets the material `index` may, by chance or by what touches it there, meet a diffuse surface.
fn may_scatter_diffusely(index: u32, hit: Hit) -> bool {
    let kind = load_Material(index).kind;
#if CONTACT
    if (hit.contact != NONE && !is_opaque(kind)) {
        var touching = load_Material(material_of(hit.contact));
#if NORMAL_MAPS
        if (touching.kind == MATERIAL_KIND_NORMAL_MAPPED) {
            touching = load_Material(touching.b);
        }
#endif
        return scatters_diffusely(kind) || scatters_diffusely(touching.kind);
    }
#endif
    return scatters_diffusely(kind);
}
#endif

#if DISPERSION
// Whether a primitive's material is the same all over its surface. Where others are under it, it may not be.
fn is_plain(primitive: u32) -> bool {
#if TEXTURES || COMPOSITE
    let m = load_Material(material_of(primitive));
    return m.texture == NONE && m.kind != MATERIAL_KIND_MIX && m.kind != MATERIAL_KIND_COATED && m.kind != MATERIAL_KIND_SHEEN && m.kind != MATERIAL_KIND_GRADED;
#else
    return true;
#endif
}

// A path has come to its hero's end, if something scatters it or is a lamp, or if it has left the scene: in a medium (`in_fog`), on a surface of `material`, or nowhere.
fn end_hero(ray: Ray, hit: Hit, at: ptr<function, Interaction>, material: u32, in_fog: bool) {
    let on_surface = material != NONE;
    var is_diffuse = true;
    var plain = true;
    var ends = in_fog;
    if (on_surface) {
        is_diffuse = (*at).s.light != NONE || may_scatter_diffusely(material, hit);
        plain = is_plain(hit.primitive);
#if CONTACT
        if (hit.contact != NONE) {
            plain &= is_plain(hit.contact);
            is_diffuse |= bitcast<u32>(primitive_at(hit.contact).r1.w) != NONE;
        }
#endif
        ends = is_diffuse || !is_specular(load_Material(material));
    }
    var width = width_near_hero(ray.d, (*at).s.p, select((*at).s.n, ray.d, in_fog), is_diffuse, plain);
#if CAMERA_PATHS
#if LIGHT_ENVIRONMENT
    if (!on_surface && !in_fog) {
        width = width_far_away(ray.d);
        ends = true;
    }
#endif
#endif
    if (ends) {
        keep_within(width);
    }
}
#endif
