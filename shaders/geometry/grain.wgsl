// Where the grain of what is brushed points (the model: src/scene/grain.rs).
#include "geometry/surface.wgsl"
#include "geometry/tangent.wgsl"
#include "bsdf/mirror.wgsl"

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
