// Nested volumes by priority (Schmidt & Budge, "Simple nested dielectrics in ray traced images", JGT 7(2), 2002). A path keeps the volumes it is inside: a
// slot for each is its rank << 16 | how many of its bodies there are, 0 an empty one. The greatest rank rules; it is the place of the volume's record in
// `interiors`, which the host has put in order.
#include "bsdf/material.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
// Kernels in which only the ranks of volumes count do not read what is in them.
#if DIELECTRIC
@group(0) @binding(8) var interiors: Table<Interior>;
#elif CAMERA_PATHS || LIGHT_PATHS
#if MEDIA || CONDUCTOR || COAT || THIN_FILM
@group(0) @binding(8) var interiors: Table<Interior>;
#endif
#endif

#if MANY_VOLUMES
struct Volumes {
    low: vec4u,
    high: vec4u,
}

fn volumes_of(low: vec4u, high: vec4u) -> Volumes {
    return Volumes(low, high);
}

fn select_volumes(a: Volumes, b: Volumes, is_b: bool) -> Volumes {
    return Volumes(select(a.low, b.low, is_b), select(a.high, b.high, is_b));
}

fn ruling_interior(volumes: Volumes) -> u32 {
    return max(greatest_rank(volumes.low), greatest_rank(volumes.high));
}

fn contains(volumes: Volumes, interior: u32) -> bool {
    return any(slots_of(volumes.low, interior)) || any(slots_of(volumes.high, interior));
}

fn has_room(volumes: Volumes, interior: u32) -> bool {
    if (contains(volumes, interior)) {
        return !is_worn_out(volumes.low, interior) && !is_worn_out(volumes.high, interior);
    }
    return !all(volumes.low != vec4u(0u)) || !all(volumes.high != vec4u(0u));
}

fn with_interior(volumes: Volumes, interior: u32) -> Volumes {
    let goes_low = any(slots_of(volumes.low, interior)) || (!any(slots_of(volumes.high, interior)) && !all(volumes.low != vec4u(0u)));
    if (goes_low) {
        return Volumes(with_slot(volumes.low, interior), volumes.high);
    }
    return Volumes(volumes.low, with_slot(volumes.high, interior));
}

fn without_interior(volumes: Volumes, interior: u32) -> Volumes {
    return Volumes(without_slot(volumes.low, interior), without_slot(volumes.high, interior));
}
#else
alias Volumes = vec4u;

fn volumes_of(low: vec4u, high: vec4u) -> Volumes {
    return low;
}

fn select_volumes(a: Volumes, b: Volumes, is_b: bool) -> Volumes {
    return select(a, b, is_b);
}

// The volume that rules in `volumes`; 0 surrounds the scene.
fn ruling_interior(volumes: Volumes) -> u32 {
    return greatest_rank(volumes);
}

fn contains(volumes: Volumes, interior: u32) -> bool {
    return any(slots_of(volumes, interior));
}

// Whether one more body of this volume can be kept.
fn has_room(volumes: Volumes, interior: u32) -> bool {
    return select(!all(volumes != vec4u(0u)), !is_worn_out(volumes, interior), contains(volumes, interior));
}

fn with_interior(volumes: Volumes, interior: u32) -> Volumes {
    return with_slot(volumes, interior);
}

fn without_interior(volumes: Volumes, interior: u32) -> Volumes {
    return without_slot(volumes, interior);
}
#endif

var<private> inside: Volumes;

fn greatest_rank(slots: vec4u) -> u32 {
    return max(max(slots.x, slots.y), max(slots.z, slots.w)) >> 16u;
}

fn slots_of(slots: vec4u, interior: u32) -> vec4<bool> {
    return slots >> vec4u(16u) == vec4u(interior);
}

// Whether as many bodies of this volume are counted as can be.
fn is_worn_out(slots: vec4u, interior: u32) -> bool {
    return any(slots == vec4u(interior << 16u | 0xffffu));
}

fn with_slot(slots: vec4u, interior: u32) -> vec4u {
    let same = slots_of(slots, interior);
    let empty = slots == vec4u(0u);
    let first = vec4<bool>(empty.x, empty.y && !empty.x, empty.z && !empty.y && !empty.x, empty.w && !empty.z && !empty.y && !empty.x);
    return select(select(slots, vec4u(interior << 16u | 1u), first), select(slots, slots + vec4u(1u), same), any(same));
}

fn without_slot(slots: vec4u, interior: u32) -> vec4u {
    let fewer = select(slots - vec4u(1u), vec4u(0u), (slots & vec4u(0xffffu)) == vec4u(1u));
    return select(slots, fewer, slots_of(slots, interior));
}

// The volumes before and behind a surface. Which side is which is geometry: what a path leaves it was in, whatever it believed.
struct Sides {
    here: Volumes,
    beyond: Volumes,
    crowded: bool, // There are more than have room: what lies beyond is not known.
}

// Entering adds a body of a volume, also where there is one already; leaving takes one away.
fn cross_one(sides: Sides, interior: u32, enters: bool) -> Sides {
    if (enters) {
        return Sides(sides.here, with_interior(sides.beyond, interior), sides.crowded || !has_room(sides.beyond, interior));
    }
    let is_known = contains(sides.here, interior);
    let here = select_volumes(with_interior(sides.here, interior), sides.here, is_known);
    let crowded = sides.crowded || !(is_known || has_room(sides.here, interior));
    return Sides(here, without_interior(sides.beyond, interior), crowded);
}

// What `ray` crosses at `hit`. Surfaces that touch are crossed together: optical contact, whichever was found first.
fn cross_surface(volumes: Volumes, ray: Ray, s: Surface, interior: u32, hit: Hit) -> Sides {
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
// index do (whose rows of the spectral table are one) and no film lies between, nor does smooth glass tint what gets through.
fn is_invisible(m: Material, sides: Sides) -> bool {
    let here = ruling_interior(sides.here);
    let beyond = ruling_interior(sides.beyond);
    var invisible = m.kind == MATERIAL_KIND_BOUNDARY || here == beyond;
#if DIELECTRIC
    var is_bare = true;
#if THIN_FILM
    is_bare = m.kind != MATERIAL_KIND_SMOOTH_DIELECTRIC || m.c == 0u;
#endif
#if TINT
    is_bare = is_bare && (m.kind != MATERIAL_KIND_SMOOTH_DIELECTRIC || m.b == NONE);
#endif
    invisible = invisible || (is_bare && load_Interior(here).eta_row == load_Interior(beyond).eta_row);
#endif
    return invisible;
}
