// Hands a finished sample to update_film.wgsl: slot by slot, one for every sample of the dispatch.
fn store_sample(slot: u32) {
    for (var k = 0u; k < LANES4; k++) {
        samples[slot * LANES4 + k] = li[k];
    }
}
