// The camera pass: paths from the sensor with next-event estimation, combined with BSDF-sampled emitter hits by multiple importance sampling.
// One invocation owns a pixel of each work item of a group and traces its paths one after the other, so that lanes whose path ends early take up the next.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/sampler.wgsl"
#include "common/work.wgsl"
#include "common/tile.wgsl"
#if SENSOR_LENS
#include "sensor/splat.wgsl"
#else
#include "common/store_sample.wgsl"
#endif
#include "common/counters.wgsl"
#include "sensor/sensor.wgsl"
#include "path/state.wgsl"
#include "path/start.wgsl"
#include "path/next_vertex.wgsl"

var<private> sampled_pixel: u32;
var<private> item: WorkItem; // at hand

// Sample `i` of the work item in its pixel `local`.
fn begin_path(pixel: vec2u, i: u32, local: u32) -> Ray {
    sampled_pixel = pixel.y * params.image_width + pixel.x;
    pass_of_path = item.pass_index + i;
    // Copies, 0 to 3, in bits that no sequence of a render has.
    start_sampler(sampled_pixel, params.sequence ^ (item.copy << 30u), params.seed, params.first_sample + pass_of_path);
    begin_pass(pass_of_path);
#if MERGING
    // Points outlive the dispatch.
    point_slot = (item.place + i) * 64u + local;
#endif
    let ray = start_ray(pixel);
    // The fewer samples, the more does each stand for.
    scale_beta(item.weight);
    start_path(ray);
#if INTERIORS
    inside = volumes_of(params.inside, params.inside_more);
#endif
#if CAUSTICS
#if !SENSOR_CAMERA
    // The sensor is like a diffuse surface, at which paths begin evenly over a pixel.
    path.light_path_density = f32(params.light_paths) * PI * sensor_area() / f32(params.image_width * params.image_height);
    path.view = VIEW_SCATTERED;
#endif
#endif
#if START_VOLUMES
    return find_start(ray);
#else
    return first_segment(ray);
#endif
}

// Goes on to the first item from `first` on, or `end`, of which the invocation's pixel is in the tile.
fn next_item(first: u32, end: u32, local: u32) -> u32 {
    var at = first;
    while (at < end) {
        item = load_WorkItem(at);
        if (is_in_tile(pixel_in_tile(item.block, local))) {
            break;
        }
        at += 1u;
    }
    return at;
}

fn pixel_of_item(local: u32) -> vec2u {
    return vec2u(params.tile_x, params.tile_y) + pixel_in_tile(item.block, local);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = work_group(group_number(workgroup.x, workgroups.x));
    first_place = work_group(params.first_group).place;
#if !SENSOR_LENS
    mark_unfinished(slot_at(group.place, local), group.samples);
#endif
    // As after the last path of an item before the first.
    var at = group.end;
    var next = group.first;
    var pixel = vec2u(0u);
    var i = 0u;
    var ray: Ray;
    path.ended = true;
    loop {
        if (path.ended) {
            if (i >= item.count) {
                at = next_item(next, group.end, local);
                if (at >= group.end) {
                    break;
                }
                next = at + 1u;
                pixel = pixel_of_item(local);
                i = 0u;
            }
            ray = begin_path(pixel, i, local);
        }
        ray = next_event(ray);
        if (path.ended) {
#if COUNTED
            count_path(path.depth);
#endif
#if SENSOR_LENS
            splat_sample();
#else
            store_sample(slot_at(item.place + i, local));
#endif
            i += 1u;
        }
    }
    report_rays();
#if SENSOR_LENS
    // Where the driver has ended the loop.
    if (at < group.end) {
        atomicAdd(&counters[COUNTER_UNFINISHED], 1u);
    }
#endif
}
