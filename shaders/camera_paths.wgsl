// The camera pass: paths from the sensor with next-event estimation, combined with chance hits by multiple importance sampling.
// One invocation owns one pixel and traces `samples` paths one after the other, so that lanes whose path ends early take up the next; each turn of
// the loop traces one ray, a path's next segment or a light sample's shadow ray, so that there is one call of `trace`.
#include "common/math.wgsl"
#include "common/sampler.wgsl"

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> bvh: array<vec4u>;
@group(0) @binding(2) var<storage, read> primitives: array<vec4f>;
@group(0) @binding(3) var<storage, read> materials: array<Material>;
@group(0) @binding(4) var<storage, read> spectra: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> film: array<f32>;
@group(0) @binding(6) var<storage, read_write> counters: array<atomic<u32>>;
#if LIGHTS_PRESENT
@group(0) @binding(7) var<storage, read> lights: array<Light>;
#endif
#if INTERIORS
@group(0) @binding(8) var<storage, read> interiors: array<Interior>;
#endif
#if SMOOTH_NORMALS
@group(0) @binding(9) var<storage, read> normals: array<vec4f>;
#endif
#if ROUGH
@group(0) @binding(10) var<storage, read> tables: array<f32>;
#endif
#if ENV_IMAGE
@group(0) @binding(11) var<storage, read> environment: array<vec4f>;
#endif
#if MANY_BINS
@group(0) @binding(12) var<storage, read> lane_bins: array<u32>;
#endif

#include "common/spectra.wgsl"
#include "common/path.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if MEDIA
#include "medium/homogeneous.wgsl"
#endif
#if FRESNEL
#include "bsdf/fresnel.wgsl"
#endif
#if ROUGH
#include "bsdf/rough.wgsl"
#endif
#include "light/mis.wgsl"
#if LIGHTS_PRESENT
#include "light/lights.wgsl"
#endif
#include "sensor/sensor.wgsl"
#include "common/deposit.wgsl"
#include "integrator/vertex.wgsl"
#include "integrator/scatter.wgsl"

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    // A workgroup is an 8 x 8 block of the tile; blocks are numbered row by row from the dispatch's first.
    let block = params.first_block + group.x;
    let blocks_across = (params.tile_width + 7u) / 8u;
    let in_tile = vec2u(8u * (block % blocks_across) + (local & 7u), 8u * (block / blocks_across) + (local >> 3u));
    if (in_tile.x >= params.tile_width || in_tile.y >= params.tile_height) {
        return;
    }
    let pixel = vec2u(params.tile_x, params.tile_y) + in_tile;
    let film_base = (in_tile.y * params.tile_width + in_tile.x) * (BINS + 3u);

    var sample = params.first_sample;
    let end = params.first_sample + params.samples;
    var rays = 0u;
    var ray = begin_path(pixel, sample);
    loop {
        let hit = trace(ray);
        rays += 1u;
#if NEE
        if (path.in_shadow) {
            ray = resume_after_shadow(ray, hit);
        } else {
            ray = advance(ray, hit);
        }
#else
        ray = advance(ray, hit);
#endif
        if (path.ended) {
            deposit(film_base, sample);
            sample += 1u;
            if (sample >= end) {
                break;
            }
            ray = begin_path(pixel, sample);
        }
    }
    atomicAdd(&counters[COUNTER_RAYS_LOW], rays);
}
