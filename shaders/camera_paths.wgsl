// The camera pass: paths from the sensor with next-event estimation, combined with chance hits by multiple importance sampling.
// One invocation owns a pixel of each of `blocks` blocks and traces `samples` paths for each one after the other, so that lanes whose path ends early take up
// the next.
#include "common/math.wgsl"
#include "common/sampler.wgsl"

#include "common/bindings.wgsl"

@group(0) @binding(14) var samples: WritableTable;

#include "common/modules.wgsl"
#include "sensor/sensor.wgsl"
#include "common/store_sample.wgsl"
#include "common/tile.wgsl"
#include "integrator/vertex.wgsl"
#include "integrator/scatter.wgsl"

#if LIT_SENSOR
// Light that falls on an irradiance sensor straight from a light: sampled as at a diffuse surface, since `ray` leaves it likewise.
fn light_on_sensor(ray: Ray) -> Ray {
    path.pdf = dot(sensor_normal, ray.d) * INV_PI;
    let choice = next_1d();
    let light = connect(ray.o, choice, next_2d());
    let pdf = dot(sensor_normal, light.wi) * INV_PI;
    if (light.weight <= 0.0 || pdf <= 0.0) {
        return ray;
    }
    let w = connection_weight(light, Vertex(ray.o, 1.0, pdf * PI, pdf, 0.0, false, 0.0)) * pdf;
    for (var k = 0u; k < LANES4; k++) {
        pending[k] = w * beta[k] * light_spectrum(light, k);
    }
#if INTERIORS
    shadow_starts_in(inside, light);
#endif
    return shadow_then(ray, true, light, ray.o, NONE);
}
#endif

var<private> sampled_pixel: u32;

// `place` is the pixel's number in the order of invocations.
fn begin_path(pixel: vec2u, sample: u32, place: u32) -> Ray {
    sampled_pixel = pixel.y * params.image_width + pixel.x;
    start_sampler(sampled_pixel, params.batch, params.seed, sample);
    pass_base = (sample - params.first_sample) * params.spectra_stride;
#if GATHERED
    // Points outlive the dispatch: pass by pass, as light paths look for them.
    point_slot = (sample - params.first_sample) * 64u * blocks_of_tile() + place;
#endif
    let ray = start_ray(pixel);
    start_path(ray);
#if INTERIORS
    inside = params.inside;
#endif
#if CAUSTICS
#if !SENSOR_CAMERA
    // The sensor is like a diffuse surface, at which paths begin evenly over a pixel.
    path.joins = f32(params.light_paths) * PI * sensor_area() / f32(params.image_width * params.image_height);
    path.view = VIEW_SCATTERED;
#endif
#endif
#if LIT_SENSOR
    return light_on_sensor(ray);
#else
    return ray;
#endif
}

// The first block from `first` on, or `end`, in which the invocation's pixel is in the tile.
fn block_in_tile(first: u32, end: u32, local: u32) -> u32 {
    var block = first;
    while (block < end && !is_in_tile(pixel_in_tile(block, local))) {
        block += 1u;
    }
    return block;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let first_block = (params.first_group + group.x) * params.blocks;
    let end_block = first_block + params.blocks;
    let end = params.first_sample + params.samples;
    mark_unfinished(group.x, local);
    var block = block_in_tile(first_block, end_block, local);
    if (block >= end_block) {
        return;
    }
    var pixel = vec2u(params.tile_x, params.tile_y) + pixel_in_tile(block, local);
    var sample = params.first_sample;
    var slot = first_slot(group.x, block - first_block, local);
    var ray = begin_path(pixel, sample, block * 64u + local);
    loop {
        ray = next_event(ray);
        if (path.ended) {
#if COUNTED
            count_path(path.depth);
#endif
            store_sample(slot);
            sample += 1u;
            slot += 1u;
            if (sample >= end) {
                block = block_in_tile(block + 1u, end_block, local);
                if (block >= end_block) {
                    break;
                }
                pixel = vec2u(params.tile_x, params.tile_y) + pixel_in_tile(block, local);
                sample = params.first_sample;
                slot = first_slot(group.x, block - first_block, local);
            }
            ray = begin_path(pixel, sample, block * 64u + local);
        }
    }
    atomicAdd(&counters[COUNTER_RAYS], rays_traced);
#if COUNTED
    report_counts();
#endif
}
