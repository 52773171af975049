// Tangents of meshes, as their vertices have them.
#include "geometry/surface.wgsl"

// The tangent of the mesh at `s`, as its vertices have it; 0 where there is none. w: 1, or -1 where texture coordinates are mirrored.
fn tangent_at(s: Surface) -> vec4f {
    var tangent = vec4f(0.0, 0.0, 0.0, 1.0);
#if SMOOTH_NORMALS
    let primitive = primitive_at(s.primitive);
    let at = bitcast<u32>(primitive.r2.w);
#if QUADRICS
    let is_triangle = (bitcast<u32>(primitive.r0.w) >> 29u) == PRIMITIVE_TRIANGLE;
#else
    let is_triangle = true;
#endif
    if (is_triangle && at != NONE) {
        if (load_normals(at).w > 0.0) {
            let e1 = primitive.r1.xyz - primitive.r0.xyz;
            let e2 = primitive.r2.xyz - primitive.r0.xyz;
            let n = cross(e1, e2);
            let scale = 1.0 / max(dot(n, n), 1e-37);
            let p = s.p - primitive.r0.xyz;
            let b1 = dot(cross(p, e2), n) * scale;
            let b2 = dot(cross(e1, p), n) * scale;
            let first = load_normals(at + 3u);
            let along = (1.0 - b1 - b2) * first.xyz + b1 * load_normals(at + 4u).xyz
                + b2 * load_normals(at + 5u).xyz;
            tangent = vec4f(along, first.w);
#if INSTANCES
            if (primitive.instance != NONE) {
                let i = load_Instance(primitive.instance);
                tangent = vec4f(carry_direction(to_world(i), along), first.w);
            }
#endif
        }
    }
#endif
    return tangent;
}
