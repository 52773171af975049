// Where a workgroup of the dispatch keeps the first sample of its invocation's pixel in its block `block`; the others of the pixel follow.
fn first_slot(group: u32, block: u32, local: u32) -> u32 {
    return ((group * params.blocks + block) * 64u + local) * params.samples;
}
