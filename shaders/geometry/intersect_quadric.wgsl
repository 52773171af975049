// Spheres, discs and cylinders, without facets.

fn intersect_quadric(ray: Ray, primitive: u32, kind: u32, center: vec3f, axis: vec3f, size: vec3f, hit: ptr<function, Hit>) {
    let f = ray.o - center;
    let from_here = leaves(ray, primitive);
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
    // Sphere, or the circle that is the cylinder's cross-section.
    let radius = size.x;
    let is_cylinder = kind == PRIMITIVE_CYLINDER;
    let g = select(f, f - dot(f, axis) * axis, is_cylinder);
    let e = select(ray.d, ray.d - dot(ray.d, axis) * axis, is_cylinder);
    let a = select(1.0, dot(e, e), is_cylinder);
    if (a == 0.0) {
        return;
    }
    let b = -dot(g, e) / a;
    if (from_here) {
        // The origin lies on the surface: one root is zero by construction, the other is 2b, whatever rounding says.
        accept_root(2.0 * b, ray, primitive, is_cylinder, f, axis, size.y, hit);
        return;
    }
    // Discriminant from the nearest point to the centre, stable for far and small spheres (Haines et al., Ray Tracing Gems ch. 7, eq. 5).
    let l = g + b * e;
    let discriminant = (radius * radius - dot(l, l)) / a;
    // A ray that only touches crosses nothing: rounding would have to say whether it enters or leaves.
    if (discriminant <= 0.0) {
        return;
    }
    let g_length = length(g);
    let c = (g_length - radius) * (g_length + radius) / a;
    let q = b + select(-1.0, 1.0, b >= 0.0) * sqrt(discriminant);
    if (q == 0.0) {
        return;
    }
    let other = c / q;
    if (!accept_root(min(q, other), ray, primitive, is_cylinder, f, axis, size.y, hit)) {
        accept_root(max(q, other), ray, primitive, is_cylinder, f, axis, size.y, hit);
    }
}

fn accept_root(t: f32, ray: Ray, primitive: u32, is_cylinder: bool, f: vec3f, axis: vec3f, height: f32, hit: ptr<function, Hit>) -> bool {
    if (is_cylinder) {
        let h = dot(f + t * ray.d, axis);
        if (h < 0.0 || h > height) {
            return false;
        }
    }
    return offer_hit(ray, t, primitive, vec2f(0.0), hit);
}
