// Spheres, discs and cylinders, without facets.
#include "geometry/trace.wgsl"

fn intersect_quadric(ray: Ray, primitive: u32, kind: u32, center: vec3f, axis: vec3f, size: vec3f, hit: ptr<function, Hit>) {
    let f = ray.o - center;
    let from_here = leaves(ray, primitive);
#if DISCS
    if (kind == PRIMITIVE_DISC) {
        let cos_theta = dot(axis, ray.d);
        if (from_here || cos_theta == 0.0) {
            return;
        }
        let t = -dot(f, axis) / cos_theta;
        let p = f + t * ray.d;
        if (dot(p, p) <= size.x * size.x) {
            offer_hit(ray, t, primitive, vec2f(0.0), hit);
        }
        return;
    }
#endif
#if SPHERES || CYLINDERS
    // Sphere, or the circle that is the cylinder's cross-section.
    let radius = size.x;
    var g = f;
    var e = ray.d;
    var a = 1.0;
#if CYLINDERS
    let is_cylinder = kind == PRIMITIVE_CYLINDER;
    if (is_cylinder) {
        g = f - dot(f, axis) * axis;
        e = ray.d - dot(ray.d, axis) * axis;
        a = dot(e, e);
    }
    if (a == 0.0) {
        return;
    }
#endif
    let b = -dot(g, e) / a;
    // Discriminant from the nearest point to the centre, stable for far and small spheres (Haines et al., Ray Tracing Gems ch. 7, eq. 5).
    let l = g + b * e;
    let discriminant = (radius * radius - dot(l, l)) / a;
    let g_length = length(g);
    let c = (g_length - radius) * (g_length + radius) / a;
    let q = b + select(-1.0, 1.0, b >= 0.0) * sqrt(max(discriminant, 0.0));
    // A ray that only touches crosses nothing: rounding would have to say whether it enters or leaves.
    if (!from_here && (discriminant <= 0.0 || q == 0.0)) {
        return;
    }
    let other = c / q;
    var first = min(q, other);
    var second = max(q, other);
    if (from_here) {
        // The origin lies on the surface: one root is zero by construction, the other is 2b, whatever rounding says.
        first = 2.0 * b;
        second = first;
    }
    var t = select(second, first, first > 0.0);
#if CYLINDERS
    if (is_cylinder && !is_within(dot(f + t * ray.d, axis), size.y)) {
        t = second;
    }
    if (is_cylinder && !is_within(dot(f + t * ray.d, axis), size.y)) {
        return;
    }
#endif
    offer_hit(ray, t, primitive, vec2f(0.0), hit);
#endif
}

#if CYLINDERS
fn is_within(h: f32, height: f32) -> bool {
    return h >= 0.0 && h <= height;
}
#endif
