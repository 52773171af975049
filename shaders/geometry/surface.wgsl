// What a hit point looks like to the shading code.
#include "common/math.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/primitives.wgsl"
#if SMOOTH_NORMALS
@group(0) @binding(9) var normals: Table<vec4f>;
#endif

struct Surface {
    p: vec3f,
    error: f32, // bound on the distance of p from the true surface along n, m
    n: vec3f, // geometric normal, outward
    primitive: u32,
    ns: vec3f, // shading normal, on the side of n
#if COAT_NORMALS
    ns_of_shape: vec3f, // likewise, whatever maps say
#endif
    light: u32, // index of the light that this primitive is, or NONE
    arrival: vec3f, // direction of the ray that arrives
    way: f32, // its length
#if DISPERSION
    curvature: f32, // by how much the normal turns along the surface, 1/m: positive where it is convex, the mean over all directions
#endif
    on_ray: vec3f, // where it arrives, as the ray has it: less exact than p along n, but not beside the ray
}

fn surface_at(ray: Ray, hit: Hit) -> Surface {
    let primitive = primitive_at(hit.primitive);
    let r0 = primitive.r0;
    let r1 = primitive.r1;
    let r2 = primitive.r2;
    var s: Surface;
    s.arrival = ray.d;
    s.way = hit.t;
    s.on_ray = ray.o + hit.t * ray.d;
    s.primitive = hit.primitive;
    s.light = bitcast<u32>(r1.w);
#if QUADRICS
    let kind = bitcast<u32>(r0.w) >> 29u;
    if (kind != PRIMITIVE_TRIANGLE) {
        let q = ray.o + hit.t * ray.d - r0.xyz;
#if SPHERES
        if (kind == PRIMITIVE_SPHERE) {
            s.n = normalize(q);
#if DISPERSION
            s.curvature = 1.0 / r2.x;
#endif
            s.p = r0.xyz + r2.x * s.n; // back onto the sphere: the error no longer grows with the ray's length
        }
#endif
#if DISCS
        if (kind == PRIMITIVE_DISC) {
            s.n = r1.xyz;
            s.p = r0.xyz + (q - dot(q, s.n) * s.n);
        }
#endif
#if CYLINDERS
        if (kind == PRIMITIVE_CYLINDER) {
            let h = dot(q, r1.xyz);
            s.n = normalize(q - h * r1.xyz);
#if DISPERSION
            s.curvature = 1.0 / r2.x;
#endif
            s.p = r0.xyz + h * r1.xyz + r2.x * s.n;
        }
#endif
#if LENS_FACES
        if (kind == PRIMITIVE_LENS_FACE) {
            let place = place_on_lens_face(q, r1.xyz, r2.xyz);
            s.n = place.n;
#if DISPERSION
            s.curvature = place.curvature;
#endif
            s.p = r0.xyz + place.p;
        }
#endif
        let magnitude = abs(r0.xyz) + abs(s.p - r0.xyz);
        s.error = GAMMA_7 * dot(abs(s.n), magnitude);
        s.ns = s.n;
#if COAT_NORMALS
        s.ns_of_shape = s.ns;
#endif
        return s;
    }
#endif
    let b = vec3f(1.0 - hit.bary.x - hit.bary.y, hit.bary);
    s.n = normalize(cross(r1.xyz - r0.xyz, r2.xyz - r0.xyz));
    s.p = b.x * r0.xyz + b.y * r1.xyz + b.z * r2.xyz;
    s.error = GAMMA_7 * dot(abs(s.n), abs(b.x * r0.xyz) + abs(b.y * r1.xyz) + abs(b.z * r2.xyz));
    s.ns = s.n;
#if SMOOTH_NORMALS
    let at = bitcast<u32>(r2.w);
    if (at != NONE) {
        var n0 = load_normals(at).xyz;
        var n1 = load_normals(at + 1u).xyz;
        var n2 = load_normals(at + 2u).xyz;
#if INSTANCES
        if (primitive.instance != NONE) {
            let i = load_Instance(primitive.instance);
            n0 = carry_normal(i, n0);
            n1 = carry_normal(i, n1);
            n2 = carry_normal(i, n2);
        }
#endif
        let ns = b.x * n0 + b.y * n1 + b.z * n2;
        let length_squared = dot(ns, ns);
        if (length_squared > 0.0) {
            s.ns = ns * inverseSqrt(length_squared);
            s.ns = select(-s.ns, s.ns, dot(s.ns, s.n) > 0.0);
#if DISPERSION
            let e1 = r1.xyz - r0.xyz;
            let e2 = r2.xyz - r0.xyz;
            let e3 = e2 - e1;
            let turn = dot(n1 - n0, e1) + dot(n2 - n0, e2) + dot(n2 - n1, e3);
            s.curvature = turn / (dot(e1, e1) + dot(e2, e2) + dot(e3, e3)) * inverseSqrt(length_squared) * select(-1.0, 1.0, dot(ns, s.n) > 0.0);
#endif
        }
    }
#endif
#if COAT_NORMALS
    s.ns_of_shape = s.ns;
#endif
    return s;
}

// Origin of a ray that leaves `s` towards `d`: off the surface by the error bound, on d's side (pbrt-v4, 6.8.6). Back to the side that the path came
// from it goes along the ray that arrived, where the path has been, and no farther: near an edge, rounding could put `p` beyond the next face, and the
// path outside.
fn leave(s: Surface, d: vec3f) -> vec3f {
    let side = select(-1.0, 1.0, dot(d, s.n) >= 0.0);
    let cos_arrival = -side * dot(s.arrival, s.n);
    if (cos_arrival > 0.0625) {
        return s.on_ray + dot(s.p - s.on_ray, s.n) * s.n - min(2.0 * s.error / cos_arrival, 0.5 * s.way) * s.arrival;
    }
    return s.p + (side * s.error) * s.n;
}
