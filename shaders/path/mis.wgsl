// Multiple importance sampling over all the ways in which a path can be found (balance heuristic: Veach 1997, 9.2.2), exact by a closed form
// instead of a recursion.
//
// A path runs from the eye over y1, y2 .. to x0 on a light, whose neighbour is x1. Relative to a chance hit, its densities are
//   1                     for a chance hit (0 for a light of zero size),
//   L / p(x1)             for a light sample: L its density, p(x1) the pdf of the direction that a camera path takes from x1 to x0,
//   N g c/p(y1) / W       for a light path joined to the sensor at y1: N light paths, of emission density g over the cosine at x0;
//                         c/p(y1) cosine over pdf of the direction that a camera path takes from y1, W the density of camera paths at y1 per area,
//   N g c/p(ym) A         for a light path gathered at ym: A the kernel's area (in fog its volume times the extinction there).
// The vertices between do not appear: pdf times cosine of the one end is the same for both directions of travel at diffuse surfaces and in fog, cancels
// where the surface is smooth, and nearly so where it is rough; what is left there is left out alike by all passes, which is allowed since any weights
// that add up to one are. Light paths are gathered only at the first vertex of a camera path that is diffuse or in fog, and
// only if something has bent the path before.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/spectra.wgsl"
#include "path/state.wgsl"
#if LIGHTS_PRESENT
#include "light/lights.wgsl"
#endif
#if CAUSTICS
#include "light/aim.wgsl"
#endif
#if CAUSTICS
#include "sensor/density.wgsl"
#endif
#if LIGHT_PATHS
#include "light/emit.wgsl"
#endif

// A vertex at which a path scatters: to a connection, or to its next vertex.
struct Vertex {
    p: vec3f,
    cos_from: f32, // cosine to where the path came from; 1 in fog
    cos_to: f32, // cosine to where it goes
    pdf: f32, // of going there, per solid angle
    reverse: f32, // pdf of a path coming from there to go where this one came from
    bends: bool, // a rough metal or glass
    extinction: f32, // of fog; 0 on a surface
}

fn is_gathering(v: Vertex) -> bool {
    return !v.bends;
}

fn safe_ratio(a: f32, b: f32) -> f32 {
    return a / max(b, 1e-30);
}

#if GATHERED
// Radius of gathering for a camera path of this length.
fn gather_radius(path_length: f32) -> f32 {
    let head = pass_head();
    return head.merge_radius + head.merge_radius_per_metre * min(path_length, params.gather_reach);
}

// A of the density of gathering.
fn gather_measure(v: Vertex, radius: f32) -> f32 {
    return PI * radius * radius * select(1.0, 4.0 / 3.0 * radius * v.extinction, v.extinction > 0.0);
}
#endif

#if CAMERA_PATHS
#if CAUSTICS
// Density by light paths of the path that goes on from `v`, over that of emission.
fn joins_at(v: Vertex) -> f32 {
    var joins = path.joins;
#if JOINED
#if SENSOR_CAMERA
    if (path.depth == 1u) {
        let d = v.p - path.last_vertex;
        let d2 = dot(d, d);
        joins += safe_ratio(f32(params.light_paths) * v.cos_to, v.pdf * v.cos_from * sensor_density(d * inverseSqrt(d2), d2));
    }
#endif
#endif
#if GATHERED
    if (path.view == VIEW_BENT && is_gathering(v)) {
        joins += f32(params.light_paths) * gather_measure(v, gather_radius(path.length)) * safe_ratio(v.cos_to, v.pdf);
    }
#endif
    return joins;
}
#endif

// The path goes on from `v`.
fn leave_vertex(v: Vertex) {
#if CAUSTICS
    path.joins = joins_at(v);
    path.view = select(VIEW_SCATTERED, path.view, v.bends);
#endif
}

// Share of a chance hit: `light_pdf` is what light sampling would have given it, `emission` the density of light paths.
fn chance_share(light_pdf: f32, emission: f32) -> f32 {
#if CHANCE
    var others = 0.0;
#if LIGHT_SAMPLES
    others += select(safe_ratio(light_pdf, path.pdf), 0.0, path.pdf < 0.0);
#endif
#if CAUSTICS
    others += path.joins * emission;
#endif
    return 1.0 / (1.0 + others);
#else
    return 0.0;
#endif
}

#if CONNECT
// Share of a light sample taken at `v`, times its weight.
fn connection_weight(light: LightSample, v: Vertex) -> f32 {
    var others = 0.0;
#if CHANCE
    others += light.chance;
#endif
#if CAUSTICS
    others += joins_at(v) * emission_density_of_sample(light, v.p);
#endif
    return light.weight * light.density / (light.density + v.pdf * others);
}
#endif
#else
// Density of finding the path from the camera alone, where `v` is the vertex of this number.
fn camera_density_at(v: Vertex, number: u32) -> f32 {
    var others = path.chance;
#if LIGHT_SAMPLES
    if (number == 1u) {
        others += safe_ratio(light_density_at(v.p), v.reverse);
    }
#endif
    return others;
}

fn leave_vertex(v: Vertex) {
    path.chance = camera_density_at(v, path.depth);
#if GATHERED
    if (is_gathering(v)) {
        path.gathers = safe_ratio(v.cos_from, v.reverse);
        path.extinction = v.extinction;
        path.length = 0.0;
    }
#endif
}

#if CONNECT
// Share of the joint of `v` with the sensor, times its weight; its density is that of camera paths at `v`, over the cosine.
fn connection_weight(sensor: LightSample, v: Vertex) -> f32 {
    let joined = path.emission * safe_ratio(v.cos_from, v.reverse * v.cos_to * sensor.density);
    var others = camera_density_at(v, path.depth);
#if GATHERED
    if (v.bends && path.gathers > 0.0) {
        var gathering = v;
        gathering.extinction = path.extinction;
        others += path.emission * path.gathers * gather_measure(gathering, gather_radius(path.length + sensor.distance));
    }
#endif
    return path.at_joints * sensor.weight / (1.0 + safe_ratio(others, joined));
}
#endif
#endif
