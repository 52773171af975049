// Which volumes a ray starts in, where the surface that rays start on meets the boundary of one: those that the way up leaves and has not entered before.
// Upwards, so that an open sheet of water is above whoever is in it; a little askew, so that the way does not run along walls.
#include "bsdf/material.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#include "medium/interiors.wgsl"

var<private> first_ray: Ray; // waits until the volumes are known
var<private> entered: Volumes; // volumes that the way up has entered
var<private> starts_crowded: bool; // There are more than have room.

// The way up from the start of `ray`, which comes back in `first_ray`.
fn way_up(ray: Ray) -> Ray {
    first_ray = ray;
    inside = volumes_of(vec4u(0u), vec4u(0u));
    entered = inside;
    starts_crowded = false;
    return Ray(ray.o, INFINITE, UP, NONE, NONE, false);
}

// The way up enters the volume `interior`, or leaves it.
fn count_boundary(interior: u32, enters: bool) {
    if (interior == NONE) {
        return;
    }
    if (enters) {
        let far = cross_one(Sides(entered, entered, false), interior, true);
        starts_crowded = starts_crowded || far.crowded;
        entered = far.beyond;
    } else if (contains(entered, interior)) {
        entered = without_interior(entered, interior);
    } else {
        let start = cross_one(Sides(inside, inside, false), interior, true);
        starts_crowded = starts_crowded || start.crowded;
        inside = start.beyond;
    }
}

// Goes on from the surface at `hit`, whatever it is.
fn climb(ray: Ray, hit: Hit) -> Ray {
    let s = surface_at(ray, hit);
    count_boundary(load_Material(material_of(hit.primitive)).interior, dot(ray.d, s.n) < 0.0);
#if CONTACT
    if (hit.contact != NONE) {
        count_boundary(load_Material(material_of(hit.contact)).interior, dot(ray.d, surface_at(ray, at_contact(ray, hit)).n) < 0.0);
    }
#endif
    var r = ray;
    r.o = leave(s, ray.d);
    r.from_primitive = s.primitive;
    return r;
}
