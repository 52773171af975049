// Hands a finished sample to update_film.wgsl: slot by slot, one for every sample of the dispatch.
fn store_sample(slot: u32) {
    for (var k = 0u; k < LANES4; k++) {
        samples[slot * LANES4 + k] = li[k];
    }
}

// Marks the slots from `first` on as those of samples that are not finished, until they are.
fn mark_unfinished(first: u32) {
    for (var i = 0u; i < params.samples; i++) {
        samples[(first + i) * LANES4].x = UNFINISHED;
    }
}
