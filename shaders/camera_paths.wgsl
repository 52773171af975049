// The camera pass: paths from the sensor with next-event estimation, combined with chance hits by multiple importance sampling.
// One invocation owns one pixel and traces `samples` paths one after the other, so that lanes whose path ends early take up the next; each turn of
// the loop traces one ray, a path's next segment or a light sample's shadow ray, so that there is one call of `trace`.
#include "common/math.wgsl"
#include "common/sampler.wgsl"

#include "common/bindings.wgsl"

@group(0) @binding(5) var<storage, read_write> film: array<f32>;

#include "common/modules.wgsl"
#include "sensor/sensor.wgsl"
#include "common/deposit.wgsl"
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
            deposit(film_base, sample);
            sample += 1u;
            if (sample >= end) {
                break;
            }
            ray = begin_path(pixel, sample);
        }
    }
    atomicAdd(&counters[COUNTER_RAYS], rays);
}
