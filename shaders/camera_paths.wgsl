// The camera pass: paths from the sensor with next-event estimation, combined with chance hits by multiple importance sampling.
// One invocation owns one pixel and traces `samples` paths one after the other, so that lanes whose path ends early take up the next; each turn of
// the loop traces one ray, a path's next segment or a light sample's shadow ray, so that there is one call of `trace`.
#include "common/math.wgsl"
#include "common/sampler.wgsl"

#include "common/bindings.wgsl"

@group(0) @binding(14) var<storage, read_write> samples: array<vec4f>;

#include "common/modules.wgsl"
#include "sensor/sensor.wgsl"
#include "common/store_sample.wgsl"
#include "common/tile.wgsl"
#include "integrator/vertex.wgsl"
#include "integrator/scatter.wgsl"

fn begin_path(pixel: vec2u, sample: u32) -> Ray {
    start_sampler(pixel.y * params.image_width + pixel.x, params.batch, params.seed, sample);
    pass_base = (sample - params.first_sample) * params.spectra_stride;
    let ray = start_ray(pixel);
    start_path(ray);
#if INTERIORS
    inside = params.inside;
#endif
    return ray;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let in_tile = pixel_in_tile(group.x, local);
    if (in_tile.x >= params.tile_width || in_tile.y >= params.tile_height) {
        return;
    }
    let pixel = vec2u(params.tile_x, params.tile_y) + in_tile;
    let first_slot = (group.x * 64u + local) * params.samples;
    var sample = params.first_sample;
    let end = params.first_sample + params.samples;
    var rays = 0u;
    var ray = begin_path(pixel, sample);
    loop {
        let hit = trace(ray);
        rays += 1u;
#if CONNECT
        if (path.in_shadow) {
            ray = resume_after_shadow(ray, hit);
        } else {
            ray = advance(ray, hit);
        }
#else
        ray = advance(ray, hit);
#endif
        if (path.ended) {
            store_sample(first_slot + sample - params.first_sample);
            sample += 1u;
            if (sample >= end) {
                break;
            }
            ray = begin_path(pixel, sample);
        }
    }
    atomicAdd(&counters[COUNTER_RAYS], rays);
}
