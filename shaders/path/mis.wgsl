// Multiple importance sampling over all the ways in which a path can be found (balance heuristic: Veach 1997, 9.2.2), exact by a closed form
// instead of a recursion.
//
// A path runs from the eye over y1, y2 .. to x0 on a light, whose neighbour is x1. Relative to a BSDF-sampled emitter hit, its densities are
//   1                     for a BSDF-sampled emitter hit (0 for a light of zero size),
//   L / p(x1)             for a light sample: L its density, p(x1) the pdf of the direction that a camera path takes from x1 to x0,
//   N g c/p(y1) / W       for a light path connected to the sensor at y1: N light paths, of emission density g over the cosine at x0;
//                         c/p(y1) cosine over pdf of the direction that a camera path takes from y1, W the density of camera paths at y1 per area,
//   N g c/p(ym) A         for a light path merged at ym: A the kernel's area (in fog its volume times the extinction there).
// The vertices between do not appear: pdf times cosine of the one end is the same for both directions of travel at diffuse surfaces and in fog, cancels
// where the surface is smooth, and nearly so where it is rough; what is left there is left out alike by all passes, which is allowed since any weights
// that add up to one are. Light paths are merged only at the first vertex of a camera path that is diffuse or in fog, and
// only if something has bent the path before.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/spectra.wgsl"
#include "path/state.wgsl"
#if LIGHTS_PRESENT
#include "light/light.wgsl"
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
    pdf_rev: f32, // pdf of a path coming from there to go where this one came from
    bends: bool, // a rough metal or glass
    extinction: f32, // of fog; 0 on a surface
}

fn merges_at(v: Vertex) -> bool {
    return !v.bends;
}

fn safe_ratio(a: f32, b: f32) -> f32 {
    return a / max(b, 1e-30);
}

#if MERGING
// Radius of merging for a camera path of this length.
fn merge_radius(path_length: f32) -> f32 {
    let head = pass_head();
    return head.merge_radius + head.merge_radius_per_metre * min(path_length, params.merge_reach);
}

// In fog the kernel is a cylinder along the camera ray, since nobody sees how deep in the fog something lies: half its length. In a dense fog a mean free path, over
// which transmittance, by which light counts, does not change by much.
fn fog_kernel(radius: f32, extinction: f32) -> f32 {
    return min(f32(POINT_LINKS) * radius, 1.0 / extinction);
}

// A of the density of merging.
fn merge_measure(v: Vertex, radius: f32) -> f32 {
    return PI * radius * radius * select(1.0, 2.0 * fog_kernel(radius, v.extinction) * v.extinction, v.extinction > 0.0);
}
#endif

#if SHAFTS
// Whether what light `index` sends straight to `v`, a vertex in fog, is left to the light paths that find it.
fn is_left_to_light_paths(index: u32, v: Vertex) -> bool {
    let kind = load_Light(index).kind;
    return v.extinction > 0.0 && (kind == LIGHT_KIND_SPOT || kind == LIGHT_KIND_PROFILE || kind == LIGHT_KIND_BEAM);
}
#endif

#if CAMERA_PATHS
#if CAUSTICS
// Density by light paths of the path that goes on from `v`, over that of emission.
fn light_path_density_at(v: Vertex) -> f32 {
    var light_path_density = path.light_path_density;
#if LIGHT_TRACING
#if SENSOR_CAMERA
    if (path.depth == 1u) {
        let d = v.p - path.last_vertex;
        let d2 = dot(d, d);
        light_path_density += safe_ratio(f32(params.light_paths) * v.cos_to, v.pdf * v.cos_from * sensor_density(d * inverseSqrt(d2), d2));
    }
#endif
#endif
#if MERGING
    if (path.view == VIEW_BENT && merges_at(v)) {
        light_path_density += f32(params.light_paths) * merge_measure(v, merge_radius(path.length)) * safe_ratio(v.cos_to, v.pdf);
    }
#endif
    return light_path_density;
}
#endif

// The path goes on from `v`.
fn leave_vertex(v: Vertex) {
#if CAUSTICS
    path.light_path_density = light_path_density_at(v);
    path.view = select(VIEW_SCATTERED, path.view, v.bends);
#endif
}

// Share of a BSDF-sampled emitter hit: `light_pdf` is what light sampling would have given it, `emission` the density of light paths.
fn mis_weight_emitter_hit(light_pdf: f32, emission: f32) -> f32 {
#if BSDF_SAMPLING
    var others = 0.0;
#if NEXT_EVENT_ESTIMATION
    others += select(safe_ratio(light_pdf, path.pdf), 0.0, path.pdf < 0.0);
#endif
#if CAUSTICS
    others += path.light_path_density * emission;
#endif
    return 1.0 / (1.0 + others);
#else
    return 0.0;
#endif
}

#if CONNECT
// Share of a light sample taken at `v`, times its weight.
fn mis_weight_connection(light: LightSample, v: Vertex) -> f32 {
    var others = 0.0;
#if BSDF_SAMPLING
    others += light.hittable;
#endif
#if CAUSTICS
    let light_path_density = light_path_density_at(v);
#if SHAFTS
    if (light_path_density > 0.0 && is_left_to_light_paths(light.index, v)) {
        return 0.0;
    }
#endif
    others += light_path_density * pdf_le_of_sample(light, v.p);
#endif
    return light.weight * light.density / (light.density + v.pdf * others);
}
#endif
#else
// Density of finding the path from the camera alone, where `v` is the vertex of this number.
fn camera_path_density_at(v: Vertex, number: u32) -> f32 {
    var others = path.camera_path_density;
#if NEXT_EVENT_ESTIMATION
    var sampled = number == 1u;
#if SHAFTS
    sampled &= !is_left_to_light_paths(path.light, v);
#endif
    if (sampled) {
        others += safe_ratio(light_density_at(v.p), v.pdf_rev);
    }
#endif
    return others;
}

fn leave_vertex(v: Vertex) {
    path.camera_path_density = camera_path_density_at(v, path.depth);
#if MERGING
    if (merges_at(v)) {
        path.merges = safe_ratio(v.cos_from, v.pdf_rev);
        path.extinction = v.extinction;
        path.length = 0.0;
    }
#endif
}

#if CONNECT
// Share of the connection of `v` with the sensor, times its weight; its density is that of camera paths at `v`, over the cosine.
fn mis_weight_connection(sensor: LightSample, v: Vertex) -> f32 {
    let joined = path.emission * safe_ratio(v.cos_from, v.pdf_rev * v.cos_to * sensor.density);
    var others = camera_path_density_at(v, path.depth);
#if MERGING
    if (v.bends && path.merges > 0.0) {
        var merging = v;
        merging.extinction = path.extinction;
        others += path.emission * path.merges * merge_measure(merging, merge_radius(path.length + sensor.distance));
    }
#endif
    return sensor.weight / (1.0 + safe_ratio(others, joined));
}
#endif
#endif
