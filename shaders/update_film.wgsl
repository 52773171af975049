// Adds the samples of a dispatch of the camera pass to the film. A pass of its own, since here all lanes read the same weights at the same time: within
// the loop over paths this took a third of the time.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/spectra.wgsl"
#include "common/work.wgsl"
#include "common/tile.wgsl"
#include "common/counters.wgsl"

@group(0) @binding(5) var<storage, read_write> film: array<f32>;
#if MANY_BINS
@group(0) @binding(12) var<storage, read> wavelength_bins: array<u32>;
#endif
@group(0) @binding(14) var samples: WrittenTable<vec4f>;

fn sample_at(i: u32) -> vec4f {
    return load_samples(i);
}

// Adds the samples of a work item in its pixel `local` to the film.
fn update_pixel(in_tile: vec2u, item: WorkItem, local: u32) {
    let base = (in_tile.y * params.tile_width + in_tile.x) * (BINS + 3u);
    var xyz = vec3f(0.0);
#if !MANY_BINS
    var sums: array<vec4f, WAVELENGTHS4>;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        sums[k] = vec4f(0.0);
    }
#endif
    for (var i = 0u; i < item.count; i++) {
        let slot = slot_at(item.place + i, local) * WAVELENGTHS4;
        let pass_index = item.pass_index + i;
        begin_pass(pass_index);
        // Where the driver has ended the loop over paths.
        if (sample_at(slot).x == UNFINISHED) {
            atomicAdd(&counters[COUNTER_UNFINISHED], 1u);
            continue;
        }
        var all = vec4f(0.0);
        var least = vec4f(0.0);
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            let l = sample_at(slot + k);
            all += abs(l);
            least = min(least, l);
        }
        // A bad sample is dropped, and counted.
        if (!is_finite(sum4(all))) {
            atomicAdd(&counters[COUNTER_NOT_FINITE], 1u);
            continue;
        }
        if (min(min(least.x, least.y), min(least.z, least.w)) < 0.0) {
            atomicAdd(&counters[COUNTER_NEGATIVE], 1u);
            continue;
        }
        // Finite, but sums of such samples would not be.
        if (sum4(all) > LARGEST_SAMPLE) {
            atomicAdd(&counters[COUNTER_SATURATED], 1u);
            continue;
        }
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            let l = sample_at(slot + k);
            xyz += vec3f(dot(l, spectrum(ROW_X, k)), dot(l, spectrum(ROW_Y, k)), dot(l, spectrum(ROW_Z, k)));
            let w = l * spectrum(ROW_BIN, k);
#if MANY_BINS
            for (var c = 0u; c < 4u; c++) {
                if (4u * k + c < WAVELENGTHS) {
                    film[base + wavelength_bins[pass_index * WAVELENGTHS + 4u * k + c]] += w[c];
                }
            }
#else
            sums[k] += w;
#endif
        }
    }
#if !MANY_BINS
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        for (var c = 0u; c < 4u; c++) {
            if (4u * k + c < BINS) {
                film[base + 4u * k + c] += sums[k][c];
            }
        }
    }
#endif
    film[base + BINS] += xyz.x;
    film[base + BINS + 1u] += xyz.y;
    film[base + BINS + 2u] += xyz.z;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let first_of_all = work_group(params.first_group);
    let end_of_all = work_group(params.first_group + workgroups.x - 1u).end;
    first_place = first_of_all.place;
    let group = work_group(group_number(workgroup.x, workgroups.x));
    for (var at = group.first; at < group.end; at++) {
        let block = load_WorkItem(at).block;
        let in_tile = pixel_in_tile(block, local);
        // All units of a block are one invocation's: there is one film.
        if (!is_in_tile(in_tile) || (at > first_of_all.first && load_WorkItem(at - 1u).block == block)) {
            continue;
        }
        for (var i = at; i < end_of_all; i++) {
            let item = load_WorkItem(i);
            if (item.block != block) {
                break;
            }
            update_pixel(in_tile, item, local);
        }
    }
}
