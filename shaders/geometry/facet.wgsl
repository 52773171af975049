// Shading normals that lose no light: facets on a mirror (the model: src/bsdf/facet.rs).
#include "common/math.wgsl"
#include "geometry/surface.wgsl"

var<private> event_facet: vec2f; // random numbers of the event, of a direction from and to the light

// A direction as the facet has it.
struct Faced {
    w: vec3f,
    weight: f32, // how many such directions it was chosen from
}

// `w` mirrored in the plane of normal `n`, if it is not on the `side` (its sign) of it. Never quite in that plane.
fn raised(w: vec3f, n: vec3f, side: f32) -> vec3f {
    let height = sign(side) * dot(w, n);
    return normalize(w + (sign(side) * (max(abs(height), 1e-6) - height)) * n);
}

// `w`, or its image in the plane of normal `mirror` if both are on the `side` of `valid`; the image never is unless `w` is.
fn choose_facing(w: vec3f, mirror: vec3f, valid: vec3f, side: f32, u: f32) -> Faced {
    let image = w - 2.0 * dot(w, mirror) * mirror;
    let both = dot(image, valid) * side > 0.0;
    return Faced(select(w, image, both && u < 0.5), select(1.0, 2.0, both));
}

// How light that arrives from `w` comes on a facet of normal `ns`.
fn light_on_facet(w: vec3f, n: vec3f, ns: vec3f) -> Faced {
    return choose_facing(w, n, ns, dot(w, n), event_facet.x);
}
