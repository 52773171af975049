// Where the grain of what is brushed points (the model: src/scene/grain.rs).
#include "geometry/surface.wgsl"
#include "bsdf/mirror.wgsl"

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

// The local frame at `s` around its shading normal `ns` on the side of the path, x along the grain of material `m`.
fn frame_along_grain(m: Material, s: Surface, ns: vec3f) -> mat3x3f {
    if (!is_brushed(m)) {
        return frame_around(ns);
    }
    let tangent = tangent_at(s);
    let across = tangent.xyz - dot(s.ns, tangent.xyz) * s.ns;
    let size = dot(across, across);
    let along = select(level_frame(s.ns)[0], across * inverseSqrt(max(size, 1e-37)), size > 0.0);
    let at = mirror_mean(m) + 2u;
    let x = tables[at] * along + (tables[at + 1u] * tangent.w) * cross(s.ns, along);
    return mat3x3f(x, cross(ns, x), ns);
}
