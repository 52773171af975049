// The light pass, where anything bends light: paths from the lights are connected to the sensor wherever they scatter, and merged at the visible points of
// the camera pass.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/sampler.wgsl"
#include "common/groups.wgsl"
#include "common/counters.wgsl"
#if GUIDED
#include "light/guide.wgsl"
#endif
#include "light/emit.wgsl"
#include "sensor/connect.wgsl"
#include "path/state.wgsl"
#include "path/next_vertex.wgsl"

// The first item from `first` on, or `end`, in which the invocation has a path: the last item of a pass may have fewer than 64.
fn next_item(first: u32, end: u32, items_of_pass: u32, local: u32) -> u32 {
    var item = first;
    while (item < end && 64u * (item % items_of_pass) + local >= params.light_paths) {
        item += 1u;
    }
    return item;
}

fn begin_path(item: u32, items_of_pass: u32, local: u32) -> Ray {
    pass_of_path = item / items_of_pass;
    let index = 64u * (item % items_of_pass) + local;
    // One sequence over all paths of all passes: 0xffffffff is no pixel.
    start_sampler(0xffffffffu, params.light_sequence, params.seed, (params.first_light_pass + pass_of_path) * params.light_paths + index);
    begin_pass(pass_of_path);
    return emit();
}

// All invocations together go through the paths pass by pass, so that those at work at a time look for the same visible points. A work item is a path of
// each of 64 invocations.
@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let items_of_pass = (params.light_paths + 63u) / 64u;
    let first = group_number(workgroup.x, workgroups.x) * params.light_units;
    let end = min(first + params.light_units, items_of_pass * params.samples);
    var item = end;
    var next = first;
    var ray: Ray;
    path.ended = true;
    loop {
        if (path.ended) {
            item = next_item(next, end, items_of_pass, local);
            if (item >= end) {
                break;
            }
            next = item + 1u;
            ray = begin_path(item, items_of_pass, local);
        }
        ray = next_event(ray);
        if (path.ended) {
#if COUNTED
            count_path(path.depth);
#endif
#if GUIDED
            store_guiding_sample();
#endif
        }
    }
    report_rays();
    // Where the driver has ended the loop.
    if (item < end) {
        atomicAdd(&counters[COUNTER_UNFINISHED], end - item);
    }
}
