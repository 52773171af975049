// The light pass, where anything bends light: paths from the lights are joined to the sensor wherever they scatter, and gathered at the visible points of
// the camera pass. One invocation traces `samples` passes of a path of each of `blocks` blocks of 64.
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/bindings.wgsl"

@group(0) @binding(13) var<storage, read_write> splats: array<atomic<u32>>;

var<private> pass_of_path: u32; // pass within the table of spectra

#include "common/modules.wgsl"
#if GUIDED
#include "light/guide.wgsl"
#endif
#include "light/emit.wgsl"
#include "sensor/connect.wgsl"
#include "integrator/vertex.wgsl"
#include "integrator/scatter.wgsl"

fn begin_path(index: u32, sample: u32) -> Ray {
    // One sequence over all paths of the batch: 0xffffffff is no pixel.
    start_sampler(0xffffffffu, params.batch, params.seed, sample * params.light_paths + index);
    pass_of_path = sample - params.first_sample;
    pass_base = pass_of_path * params.spectra_stride;
    return emit();
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let first = 64u * (params.first_group + group.x) * params.blocks + local;
    if (first >= params.light_paths) {
        return;
    }
    let end_index = min(first + 64u * params.blocks, params.light_paths);
    let end = params.first_sample + params.samples;
    var index = first;
    var sample = params.first_sample;
    var ray = begin_path(index, sample);
    loop {
        ray = next_event(ray);
        if (path.ended) {
#if COUNTED
            count_path(path.depth);
#endif
#if GUIDED
            report_use();
#endif
            sample += 1u;
            if (sample >= end) {
                index += 64u;
                if (index >= end_index) {
                    break;
                }
                sample = params.first_sample;
            }
            ray = begin_path(index, sample);
        }
    }
    atomicAdd(&counters[COUNTER_RAYS], rays_traced);
#if COUNTED
    report_counts();
#endif
    // Where the driver has ended the loop.
    if (index < end_index) {
        let blocks_left = (end_index - index + 63u) / 64u;
        atomicAdd(&counters[COUNTER_UNFINISHED], blocks_left * params.samples - (sample - params.first_sample));
    }
}
