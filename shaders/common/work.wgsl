// Work of the camera pass (integrator/sample_counts.rs): items in groups, and where their samples wait for update_film.wgsl.
#include "common/params.wgsl"
#include "common/groups.wgsl"

@group(0) @binding(24) var work: Table<WorkItem, WorkGroup>; // items, then groups of them

fn work_group(number: u32) -> WorkGroup {
    return load_WorkGroup_at(params.first_work_group + number * TEXELS_OF_WorkGroup);
}

var<private> first_place: u32; // of the dispatch

// Where a sample of pixel `local` of its block is kept.
fn slot_at(place: u32, local: u32) -> u32 {
    return 64u * (place - first_place) + local;
}
