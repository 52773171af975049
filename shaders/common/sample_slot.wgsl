// Paths of an invocation of the camera pass: `samples` of its pixel in one block, then of that in the next.
fn paths_of_invocation() -> u32 {
    return params.blocks * params.samples;
}

// Where a workgroup of the dispatch keeps the sample of an invocation's path `number`.
fn sample_slot(group: u32, local: u32, number: u32) -> u32 {
    let block = group * params.blocks + number / params.samples;
    return (block * 64u + local) * params.samples + number % params.samples;
}
