// What the rays of every pixel meet first, and what they meet behind smooth glass and in mirrors: a pass of its own, run only on request. One invocation owns
// one pixel and sends `samples` rays through its filter and the lens. Fog hides nothing.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/sampler.wgsl"
#include "common/groups.wgsl"
#include "common/tile.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if INTERIORS || BEHIND
#include "bsdf/material.wgsl"
#endif
#if BEHIND
#include "bsdf/fresnel.wgsl"
#if SHADING_NORMALS
#include "geometry/facet.wgsl"
#endif
#endif
#if START_VOLUMES
#include "medium/start.wgsl"
#endif
#include "sensor/sensor.wgsl"

@group(0) @binding(5) var albedos: Table<vec4f>; // of every material: colour, and the share of rays that it stops
@group(0) @binding(14) var<storage, read_write> aovs: array<vec4f>; // per pixel: sum of normals and depths; of albedos, and their number; likewise behind

// start_ray fills these.
var<private> beta: array<vec4f, WAVELENGTHS4>;
var<private> li: array<vec4f, WAVELENGTHS4>;

struct Aov {
    n: vec3f, // shading normal, on the side of the ray
    depth: f32, // length of the way, m
    albedo: vec4f, // w is 1, or 0 where the ray meets nothing
}

struct Aovs {
    first: Aov,
#if BEHIND
    behind: Aov, // of the first surface that is neither smooth glass nor a mirror
#endif
}

fn albedo_of(material: u32) -> vec4f {
    return load_albedos(material);
}

// Whether a surface of this material stops the ray at hand: boundaries do not, mixtures with them sometimes.
fn stops(material: u32) -> bool {
    let share = albedo_of(material).w;
    return share >= 1.0 || next_1d() < share;
}

#if INTERIORS
// The material under a map of normals.
fn bare_material(index: u32) -> Material {
    let m = load_Material(index);
#if NORMAL_MAPS
    if (m.kind == MATERIAL_KIND_NORMAL_MAPPED) {
        return load_Material(m.b);
    }
#endif
    return m;
}
#endif

#if BEHIND
// Where a ray goes on.
struct Onward {
    d: vec3f,
    goes: bool, // false where the surface is not smooth
    reflects: bool,
}

// Past a surface of relative index `eta`. One way stands for all: through glass and panes what is not reflected totally, so that what is seen there has no noise.
fn onward(ray: Ray, s: Surface, index: u32, eta: f32) -> Onward {
    var kind = load_Material(index).kind;
#if SMOOTH_COAT
    // A coat reflects little: what lies under it counts.
    let m = load_Material(index);
    if (kind == MATERIAL_KIND_COATED && m.alpha == 0.0) {
        let base = load_Material(m.b).kind;
        kind = select(kind, base, base == MATERIAL_KIND_SMOOTH_CONDUCTOR);
    }
#endif
    if (kind == MATERIAL_KIND_THIN_DIELECTRIC) {
        return Onward(ray.d, true, false);
    }
    let side = select(1.0, -1.0, dot(s.n, ray.d) > 0.0);
    let n = side * s.ns;
    var d = ray.d;
#if SHADING_NORMALS
    d = -raised(-ray.d, n, 1.0);
#endif
    let cos_i = min(-dot(d, n), 1.0);
    let is_glass = kind == MATERIAL_KIND_SMOOTH_DIELECTRIC;
    let cos_t2 = cos_transmitted_squared(cos_i, vec4f(eta)).x;
    let reflects = !is_glass || cos_t2 <= 0.0;
    var out = select(refracted_direction(d, n, cos_i, eta, cos_t2), normalize(d + 2.0 * cos_i * n), reflects);
#if SHADING_NORMALS
    out = raised(out, side * s.n, select(-1.0, 1.0, reflects));
#endif
    return Onward(out, is_glass || kind == MATERIAL_KIND_SMOOTH_CONDUCTOR, reflects);
}
#endif

fn trace_aovs(start: Ray) -> Aovs {
    var ray = start;
    var found: Aovs;
    var way = 0.0;
    var last = start.o; // where the ray went another way
#if BEHIND
    var bends = 0u;
    var eta = 1.0;
#endif
#if CONTACT
    beside = NOTHING;
#endif
#if INTERIORS
    inside = volumes_of(params.inside, params.inside_more);
#endif
#if START_VOLUMES
    var is_starting = true;
    ray = way_up(start);
#endif
    for (var crossings = 0u; crossings <= MAX_CROSSINGS; crossings++) {
        let hit = trace(ray);
#if START_VOLUMES
        if (is_starting) {
            is_starting = hit.primitive != NONE;
            if (is_starting) {
                ray = climb(ray, hit);
            } else {
                ray = start;
#if CONTACT
                beside = NOTHING;
#endif
            }
            continue;
        }
#endif
        if (hit.primitive == NONE) {
            break;
        }
        let s = surface_at(ray, hit);
        var index = material_of(hit.primitive);
        var is_there = stops(index);
#if INTERIORS
        var here = inside;
        let interior = load_Material(index).interior;
        if (interior != NONE) {
            let sides = cross_surface(inside, ray, s, interior, hit);
            // What is there of a mixture that is no glass is seen whatever the volumes.
            let m = bare_material(index);
            is_there = is_there && (m.kind == MATERIAL_KIND_MIX || !is_invisible(m, sides));
            here = sides.here;
            inside = sides.beyond;
#if BEHIND
#if DIELECTRIC
            eta = load_Interior(ruling_interior(inside)).eta_d / load_Interior(ruling_interior(here)).eta_d;
#endif
#endif
#if CONTACT
            if (hit.contact != NONE) {
                // Of a volume's surface and another that touches it, the other is seen.
                let other = material_of(hit.contact);
                if (load_Material(other).interior == NONE && stops(other)) {
                    index = other;
                    is_there = true;
                }
            }
#endif
        }
#endif
        if (is_there) {
            let side = select(1.0, -1.0, dot(s.n, ray.d) > 0.0);
            let met = Aov(side * s.ns, way + distance(last, s.p), vec4f(albedo_of(index).xyz, 1.0));
#if BEHIND
            if (bends == 0u) {
                found.first = met;
            }
            let next = onward(ray, s, index, eta);
            if (!next.goes) {
                found.behind = met;
                return found;
            }
            // What is caught in glass meets nothing.
            if (bends == params.max_depth) {
                return found;
            }
            bends++;
            way = met.depth;
            last = s.p;
            ray.d = next.d;
#if INTERIORS
            inside = select_volumes(inside, here, next.reflects);
#endif
#else
            found.first = met;
            return found;
#endif
        }
        ray.o = leave(s, ray.d);
        ray.from_primitive = s.primitive;
    }
    return found;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let in_tile = pixel_in_tile(group_number(workgroup.x, workgroups.x), local);
    if (!is_in_tile(in_tile)) {
        return;
    }
    let pixel = vec2u(params.tile_x, params.tile_y) + in_tile;
    var normal_depth = vec4f(0.0);
    var albedo = vec4f(0.0);
#if BEHIND
    var normal_depth_behind = vec4f(0.0);
    var albedo_behind = vec4f(0.0);
#endif
    for (var sample = 0u; sample < params.samples; sample++) {
        start_sampler(pixel.y * params.image_width + pixel.x, params.sequence, params.seed, sample);
        let found = trace_aovs(start_ray(pixel));
        normal_depth += vec4f(found.first.n, found.first.depth);
        albedo += found.first.albedo;
#if BEHIND
        normal_depth_behind += vec4f(found.behind.n, found.behind.depth);
        albedo_behind += found.behind.albedo;
#endif
    }
    let at = in_tile.y * params.tile_width + in_tile.x;
#if BEHIND
    let slot = 4u * at;
    aovs[slot + 2u] = normal_depth_behind;
    aovs[slot + 3u] = albedo_behind;
#else
    let slot = 2u * at;
#endif
    aovs[slot] = normal_depth;
    aovs[slot + 1u] = albedo;
}
