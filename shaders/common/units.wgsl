// Units of camera paths: some samples of a block of 8 x 8 pixels in passes in a row (integrator/sample_counts.rs), and where they wait for
// update_film.wgsl.
@group(0) @binding(24) var units: Table;

struct Unit {
    place: u32, // samples of a pixel in all units before
    index: u32, // of the first one within the batch
    count: u32,
    pass_index: u32, // of the first one, within the table of spectra
    weight: f32, // passes per sample of the block
    block: u32,
}

fn block_of(i: u32) -> u32 {
    return fetch(units, i).w;
}

fn unit_at(i: u32) -> Unit {
    let t = fetch(units, i);
    return Unit(t.x, t.y, t.z & 0xffu, t.z >> 8u & 0xffu, f32(params.round) / f32(t.z >> 16u), t.w);
}

// Where the first sample of an invocation's pixel is kept; the others of the pixel follow.
fn first_slot(i: u32, local: u32) -> u32 {
    return ((i - params.first_group * params.blocks) * 64u + local) * params.samples;
}
