// Units of camera paths: some samples of a block of 8 x 8 pixels in passes in a row (integrator/sample_counts.rs), in groups, and where they wait for
// update_film.wgsl.
#include "common/groups.wgsl"

@group(0) @binding(24) var units: Table; // units, then groups of them

struct Unit {
    place: u32, // samples of a pixel in all units before
    index: u32, // of the first one within the batch
    count: u32,
    pass_index: u32, // of the first one, within the table of spectra
    weight: f32, // passes per sample of the block
    block: u32,
}

fn unit_at(i: u32) -> Unit {
    let t = fetch(units, i);
    return Unit(t.x, t.y, t.z & 0xffu, t.z >> 8u & 0xffu, f32(t.z >> 16u & 0xffu) / f32(t.z >> 24u), t.w);
}

// Units that an invocation has a pixel of.
struct Group {
    first: u32,
    end: u32,
    place: u32, // samples of a pixel in all groups before
    samples: u32, // and in this one
}

fn group_at(number: u32) -> Group {
    let t = fetch(units, params.units + number);
    return Group(t.x, t.y, t.z, t.w);
}

var<private> first_place: u32; // of the dispatch

// Where a sample of pixel `local` of its block is kept.
fn slot_at(place: u32, local: u32) -> u32 {
    return 64u * (place - first_place) + local;
}
