// Watertight ray-triangle test by Pluecker coordinates relative to the ray's origin (Davidovic et al., "3D rasterization", 2012). The edge function of
// a shared edge is computed from the sum and the difference of its end points, so that both triangles get it with exactly opposite signs,
// whether or not products are fused; a ray through the edge belongs to at least one of them.
#include "geometry/trace.wgsl"

fn intersect_triangle(ray: Ray, primitive: u32, p0: vec3f, p1: vec3f, p2: vec3f, hit: ptr<function, Hit>) {
    let v0 = p0 - ray.o;
    let v1 = p1 - ray.o;
    let v2 = p2 - ray.o;
    let e0 = v2 - v0;
    let e1 = v0 - v1;
    let e2 = v1 - v2;
    let u = dot(cross(v2 + v0, e0), ray.d); // weight of vertex 1
    let v = dot(cross(v0 + v1, e1), ray.d); // weight of vertex 2
    let w = dot(cross(v1 + v2, e2), ray.d); // weight of vertex 0
    let smallest = min(u, min(v, w));
    let greatest = max(u, max(v, w));
    if (smallest < 0.0 && greatest > 0.0) {
        return;
    }
    let n = cross(e0, e1);
    let denominator = dot(n, ray.d);
    let sum = u + v + w;
    if (denominator == 0.0 || sum == 0.0) {
        return;
    }
    let t = dot(v0, n) / denominator;
    offer_hit(ray, t, primitive, vec2f(u, v) / sum, hit);
}
