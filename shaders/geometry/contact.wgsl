// Where a ray meets two surfaces at once, as far as rounding can tell. Surfaces that lie in each other are crossed together, as optical contact. Of two that
// cross each other the ray meets one after the other: on which side of the second it goes on is kept in mind, since its origin is as close to that surface
// as rounding, and may lie on either side.
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#include "bsdf/material.wgsl"

// What passes through the origin of the ray at hand beside the surface that it leaves.
struct Beside {
    primitive: u32, // or NONE
    bary: vec2f, // as in a hit
    n: vec3f, // its normal towards the side that the path is on; 0 if both surfaces are left together
}

const NOTHING = Beside(NONE, vec2f(0.0), vec3f(0.0));

var<private> beside: Beside;

// Distances along `ray` that cannot be told apart around `t`.
fn contact_slack(ray: Ray, t: f32) -> f32 {
    let o = abs(ray.o);
    return 2e-6 * (max(o.x, max(o.y, o.z)) + t);
}

// Weights of a triangle's vertices 1 and 2 at `p`, which lies on it.
fn weights_at(primitive: u32, p: vec3f) -> vec2f {
    let t = primitive_at(primitive);
    let e1 = t.r1.xyz - t.r0.xyz;
    let e2 = t.r2.xyz - t.r0.xyz;
    let q = p - t.r0.xyz;
    let n = cross(e1, e2);
    let w = clamp(vec2f(dot(cross(q, e2), n), dot(cross(e1, q), n)) / max(dot(n, n), 1e-37), vec2f(0.0), vec2f(1.0));
    return w / max(w.x + w.y, 1.0);
}

// The same place on the surface that touches.
fn at_contact(ray: Ray, hit: Hit) -> Hit {
    return Hit(hit.t, hit.contact, weights_at(hit.contact, ray.o + hit.t * ray.d), NONE);
}

fn is_corner(p: vec3f, t: Primitive) -> bool {
    return all(p == t.r0.xyz) || all(p == t.r1.xyz) || all(p == t.r2.xyz);
}

// True for two triangles with an edge or a corner in common.
fn share_a_corner(a: u32, b: u32) -> bool {
    let s = primitive_at(a);
    let t = primitive_at(b);
    let flat = (bitcast<u32>(s.r0.w) | bitcast<u32>(t.r0.w)) >> 29u == PRIMITIVE_TRIANGLE;
    return flat && (is_corner(s.r0.xyz, t) || is_corner(s.r1.xyz, t) || is_corner(s.r2.xyz, t));
}

// Whether a point of these weights of vertices 1 and 2 lies within `slack` of an edge of a triangle.
fn is_at_edge(primitive: u32, bary: vec2f, slack: f32) -> bool {
    let t = primitive_at(primitive);
    if (bitcast<u32>(t.r0.w) >> 29u != PRIMITIVE_TRIANGLE) {
        return false;
    }
    let e1 = t.r1.xyz - t.r0.xyz;
    let e2 = t.r2.xyz - t.r0.xyz;
    let e3 = e2 - e1;
    // A weight is the distance from the edge across over the height above it, which is the doubled area over the edge's length.
    let heights = length(cross(e1, e2)) * inverseSqrt(max(vec3f(dot(e3, e3), dot(e2, e2), dot(e1, e1)), vec3f(1e-37)));
    return any(vec3f(1.0 - bary.x - bary.y, bary) * heights <= vec3f(slack));
}

// True for primitives that may bound the same volume, or are of the same material.
fn are_alike(a: u32, b: u32) -> bool {
    let interior = load_Material(material_of(a)).interior;
    return material_of(a) == material_of(b) || (interior != NONE && interior == load_Material(material_of(b)).interior);
}

// True for a surface that light passes straight through without entering a volume.
fn is_sheet(primitive: u32) -> bool {
    let m = load_Material(material_of(primitive));
    return m.kind == MATERIAL_KIND_THIN_DIELECTRIC || m.kind == MATERIAL_KIND_ROUGH_THIN_DIELECTRIC
        || m.kind == MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC || m.kind == MATERIAL_KIND_DIFFUSE_TRANSMISSION
        || (m.kind == MATERIAL_KIND_BOUNDARY && m.interior == NONE);
}

// Finds what lies beside the ray that leaves `hit`, at which `ray` arrives. Only a surface that lies in the one met remains its contact. Of neighbours in
// one surface the next ray finds out by itself: behind their common edge only one of them is there.
fn settle_contact(ray: Ray, hit: ptr<function, Hit>) {
    beside = NOTHING;
    let slack = contact_slack(ray, 0.0);
    let is_behind = (*hit).contact == NONE && (*hit).t <= 16.0 * slack;
    if ((*hit).primitive == NONE || ((*hit).contact == NONE && !is_behind)) {
        return;
    }
    let n = surface_at(ray, *hit).n;
    if (is_behind) {
        // A path that has come no farther off the surface that it left may be on either side of that again.
        (*hit).contact = select(NONE, ray.from_primitive, abs(dot(ray.d, n)) * (*hit).t <= slack);
    }
    let second = (*hit).contact;
    if (second == NONE || second == (*hit).primitive) {
        (*hit).contact = NONE;
        return;
    }
    let other = at_contact(ray, *hit);
    let m = surface_at(ray, other).n;
    let touches = !is_behind && abs(dot(n, m)) > 0.99;
    let same_sense = dot(ray.d, n) * dot(ray.d, m) > 0.0;
    // Of two that lie in each other neighbours have the hit at their edges; else they are copies of one volume that overlap.
    let is_between = same_sense && (is_at_edge((*hit).primitive, (*hit).bary, slack) || is_at_edge(second, other.bary, slack));
    let are_neighbours = are_alike((*hit).primitive, second) && select(share_a_corner((*hit).primitive, second), is_between, touches);
    (*hit).contact = select(NONE, second, touches && !are_neighbours);
    if (are_neighbours) {
        return;
    }
    if ((*hit).contact != NONE && is_sheet((*hit).primitive) && load_Material(material_of(second)).interior != NONE) {
        // A sheet in the boundary of a volume is not there: past it light would go straight on into the volume, and come out refracted.
        beside = Beside((*hit).primitive, (*hit).bary, vec3f(0.0));
        (*hit) = Hit(other.t, other.primitive, other.bary, (*hit).primitive);
        return;
    }
    // What was left is behind the path; what is yet to be crossed has the path on the side that it comes from.
    let arrives_against = dot(ray.d, m) <= 0.0;
    let towards_path = select(-m, m, arrives_against != is_behind);
    beside = Beside(second, other.bary, select(towards_path, vec3f(0.0), touches));
}
