// Nested volumes by priority (Schmidt & Budge, "Simple nested dielectrics in ray traced images", JGT 7(2), 2002). A path keeps the multiset
// of volumes it is inside; an entry is a rank (1 << 31 | priority << 16 | index into `interiors`), 0 an empty slot; the greatest rules.
#include "bsdf/material.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
@group(0) @binding(8) var interiors: Table<Interior>;

var<private> inside: vec4u;

fn with_interior(volumes: vec4u, rank: u32) -> vec4u {
    let empty = volumes == vec4u(0u);
    let first = vec4<bool>(empty.x, empty.y && !empty.x, empty.z && !empty.y && !empty.x, empty.w && !empty.z && !empty.y && !empty.x);
    return select(volumes, vec4u(rank), first);
}

fn without_interior(volumes: vec4u, rank: u32) -> vec4u {
    let same = volumes == vec4u(rank);
    let first = vec4<bool>(same.x, same.y && !same.x, same.z && !same.y && !same.x, same.w && !same.z && !same.y && !same.x);
    return select(volumes, vec4u(0u), first);
}

fn ruling_rank(volumes: vec4u) -> u32 {
    return max(max(volumes.x, volumes.y), max(volumes.z, volumes.w));
}

// Index into `interiors` of the volume that rules in `volumes`; 0 surrounds the scene.
fn ruling_interior(volumes: vec4u) -> u32 {
    return ruling_rank(volumes) & 0xffffu;
}

// The volumes before and behind a surface. Which side is which is geometry: what a path leaves it was in, whatever it believed.
struct Sides {
    here: vec4u,
    beyond: vec4u,
    crowded: bool, // There are more than have room: what lies beyond is not known.
}

// Entering adds a volume, also one that is there already (two of a kind may overlap); leaving takes one away.
fn cross_one(sides: Sides, interior: u32, enters: bool) -> Sides {
    let rank = load_Interior(interior).rank;
    if (enters) {
        return Sides(sides.here, with_interior(sides.beyond, rank), sides.crowded || all(sides.beyond != vec4u(0u)));
    }
    let others = without_interior(sides.here, rank);
    return Sides(with_interior(others, rank), without_interior(sides.beyond, rank), sides.crowded || all(others != vec4u(0u)));
}

// What `ray` crosses at `hit`. Surfaces that touch are crossed together: optical contact, whichever was found first.
fn cross_surface(volumes: vec4u, ray: Ray, s: Surface, interior: u32, hit: Hit) -> Sides {
    let sides = cross_one(Sides(volumes, volumes, false), interior, dot(ray.d, s.n) < 0.0);
#if CONTACT
    if (hit.contact != NONE) {
        let touched = load_Material(material_of(hit.contact));
        if (touched.interior != NONE) {
            return cross_one(sides, touched.interior, dot(ray.d, surface_at(ray, at_contact(ray, hit)).n) < 0.0);
        }
    }
#endif
    return sides;
}

// Whether light of every kind goes straight on through a surface of material `m`: there is nothing, the same volume rules on both sides, or volumes of equal
// index do (whose rows of the spectral table are one) and no film lies between.
fn is_invisible(m: Material, sides: Sides) -> bool {
    let here = ruling_rank(sides.here);
    let beyond = ruling_rank(sides.beyond);
    var invisible = m.kind == MATERIAL_KIND_BOUNDARY || here == beyond;
#if DIELECTRIC
    var is_bare = true;
#if THIN_FILM
    is_bare = m.kind != MATERIAL_KIND_SMOOTH_DIELECTRIC || m.c == 0u;
#endif
    invisible = invisible || (is_bare && load_Interior(here & 0xffffu).eta_row == load_Interior(beyond & 0xffffu).eta_row);
#endif
    return invisible;
}
