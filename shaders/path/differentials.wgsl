// How a path's ray changes with its pixel, and with the index of refraction where its wavelengths part: ray differentials (Igehy 1999, "Tracing ray
// differentials") and spectral ray differentials (Elek et al. 2014, "Spectral ray differentials"). They tell which wavelengths end up so close to the hero's
// that they may share its way; light itself never goes by them.
#include "common/math.wgsl"
#include "geometry/surface.wgsl"
#include "path/state.wgsl"

// What a vertex does to differentials.
struct Bend {
    d: vec3f, // direction of the ray that arrives
    out: vec3f, // and of the one that leaves
    n: vec3f, // normal on the side of the path
    curvature: f32, // of the surface, of the normal on that side, 1/m
    reflects: bool,
    straight: bool, // through a pane
    eta: f32, // index on the side of the path over that beyond, of a refraction
}

// Over a vertex at distance `t`; `of_eta` is what `eta` changes by.
fn bend_differential(a: Differential, t: f32, bend: Bend, of_eta: f32) -> Differential {
    let cos_i = -dot(bend.d, bend.n);
    let side = a.p + t * a.d;
    // Where the changed ray meets the tangent plane.
    let p = side + bend.d * (dot(bend.n, side) / max(cos_i, 1e-4));
    if (bend.straight) {
        return Differential(p, a.d);
    }
    let of_n = bend.curvature * p;
    let of_cos = -(dot(a.d, bend.n) + dot(bend.d, of_n));
    if (bend.reflects) {
        return Differential(p, a.d + 2.0 * (of_cos * bend.n + cos_i * of_n));
    }
    // d' = eta d + (eta cos_i - cos_t) n, cos_t^2 = 1 - eta^2 (1 - cos_i^2).
    let cos_t = max(-dot(bend.out, bend.n), 1e-4);
    let of_cos_t = (bend.eta * bend.eta * cos_i * of_cos - bend.eta * (1.0 - cos_i * cos_i) * of_eta) / cos_t;
    let along_n = bend.eta * cos_i - cos_t;
    let of_along_n = of_eta * cos_i + bend.eta * of_cos - of_cos_t;
    return Differential(p, bend.eta * a.d + of_eta * bend.d + of_along_n * bend.n + along_n * of_n);
}

// Over a specular vertex at `s`.
fn bend_differentials(s: Surface, bend: Bend, of_eta: f32) {
    let t = distance(s.p, path.last_vertex);
    by_index = bend_differential(by_index, t, bend, of_eta);
#if CAMERA_PATHS
    by_pixel_x = bend_differential(by_pixel_x, t, bend, 0.0);
    by_pixel_y = bend_differential(by_pixel_y, t, bend, 0.0);
#else
    path.chain += t;
#endif
}

// A path begins at the sensor or at a lamp.
fn begin_differentials(d: vec3f) {
    by_index = Differential();
#if CAMERA_PATHS
#if SENSOR_CAMERA
    let head = pass_head();
    let frame = frame_around(d);
    by_pixel_x = Differential(head.merge_radius * frame[0], head.merge_radius_per_metre * frame[0]);
    by_pixel_y = Differential(head.merge_radius * frame[1], head.merge_radius_per_metre * frame[1]);
#else
    scatter_differentials(d);
#endif
#else
    path.chain = 0.0;
    path.spread = 0.0;
#endif
}

// A path leaves a vertex that is not specular along `d`: what comes now is spread over many directions, and is not sharper than that.
fn scatter_differentials(d: vec3f) {
    by_index = Differential();
    let spread = pass_head().spread;
#if CAMERA_PATHS
    let frame = frame_around(d);
    by_pixel_x = Differential(vec3f(0.0), spread * frame[0]);
    by_pixel_y = Differential(vec3f(0.0), spread * frame[1]);
#else
    path.chain = 0.0;
    path.spread = spread;
#endif
}

#if LIGHT_PATHS
// By how much the end of the path at `p`, where the surface has normal `n` (in a medium the path's direction), moves per unit of the index.
fn landing_by(d: vec3f, p: vec3f, n: vec3f) -> vec3f {
    let shift = by_index.p + distance(p, path.last_vertex) * by_index.d;
    let along = dot(n, d);
    return shift - d * (dot(n, shift) / select(1e-4, along, abs(along) > 1e-4));
}

// A move of the path's end at `p` over the width of what the path stands for, a pixel at least.
fn in_widths(by: vec3f, p: vec3f) -> f32 {
    let head = pass_head();
    let way = path.chain + distance(p, path.last_vertex);
    return length(by) / max(head.merge_radius + head.merge_radius_per_metre * distance(p, params.origin.xyz) + path.spread * way, 1e-30);
}
#else
// How far the end of the path at `p` moves per unit of the index: over the width of what the path stands for, a pixel at least.
fn shift_by_index(d: vec3f, p: vec3f) -> f32 {
    let t = distance(p, path.last_vertex);
    return shift_in_picture(d, by_index.p + t * by_index.d, by_pixel_x.p + t * by_pixel_x.d, by_pixel_y.p + t * by_pixel_y.d);
}
#endif

#if CAMERA_PATHS
// By how much of a pixel's width the path would have to start elsewhere, to end where it does.
fn shift_in_picture(d: vec3f, shift: vec3f, x: vec3f, y: vec3f) -> f32 {
    let frame = frame_around(d);
    let s = vec2f(dot(frame[0], shift), dot(frame[1], shift));
    let a = vec2f(dot(frame[0], x), dot(frame[1], x));
    let b = vec2f(dot(frame[0], y), dot(frame[1], y));
    let det = a.x * b.y - a.y * b.x;
    let q = vec2f(s.x * b.y - s.y * b.x, a.x * s.y - a.y * s.x);
    return length(q) / max(abs(det), 1e-30);
}
#endif
