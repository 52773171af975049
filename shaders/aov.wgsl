// What the rays of every pixel meet first: a pass of its own, run only on request. One invocation owns one pixel and sends `samples` rays through its
// filter and the lens. Fog hides nothing.
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
#if INTERIORS
#include "bsdf/material.wgsl"
#endif
#if START_VOLUMES
#include "medium/start.wgsl"
#endif
#include "sensor/sensor.wgsl"

@group(0) @binding(5) var albedos: Table<vec4f>; // of every material: colour, and the share of rays that it stops
@group(0) @binding(14) var<storage, read_write> aovs: array<vec4f>; // per pixel: sum of normals and depths; of albedos, and their number

// start_ray fills these.
var<private> beta: array<vec4f, WAVELENGTHS4>;
var<private> li: array<vec4f, WAVELENGTHS4>;

struct Aov {
    n: vec3f, // shading normal, on the side of the ray
    depth: f32, // m
    albedo: vec4f, // w is 1, or 0 where the ray meets nothing
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

fn aov(start: Ray) -> Aov {
    var ray = start;
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
        let interior = load_Material(index).interior;
        if (interior != NONE) {
            let sides = cross_surface(inside, ray, s, interior, hit);
            // What is there of a mixture that is no glass is seen whatever the volumes.
            let m = bare_material(index);
            is_there = is_there && (m.kind == MATERIAL_KIND_MIX || !is_invisible(m, sides));
            inside = sides.beyond;
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
            return Aov(side * s.ns, distance(start.o, s.p), vec4f(albedo_of(index).xyz, 1.0));
        }
        ray.o = leave(s, ray.d);
        ray.from_primitive = s.primitive;
    }
    return Aov(vec3f(0.0), 0.0, vec4f(0.0));
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
    for (var sample = 0u; sample < params.samples; sample++) {
        start_sampler(pixel.y * params.image_width + pixel.x, params.batch, params.seed, sample);
        let met = aov(start_ray(pixel));
        normal_depth += vec4f(met.n, met.depth);
        albedo += met.albedo;
    }
    let slot = 2u * (in_tile.y * params.tile_width + in_tile.x);
    aovs[slot] = normal_depth;
    aovs[slot + 1u] = albedo;
}
