// Hands finished samples to update_film.wgsl: slot by slot, one for every sample of the dispatch.

fn store_sample(slot: u32) {
    for (var k = 0u; k < LANES4; k++) {
        textureStore(samples, texel(slot * LANES4 + k), bitcast<vec4u>(li[k]));
    }
}

// Marks `count` slots, 64 apart, as those of samples that are not finished, until they are.
fn mark_unfinished(first: u32, count: u32) {
    for (var i = 0u; i < count; i++) {
        textureStore(samples, texel((first + 64u * i) * LANES4), bitcast<vec4u>(vec4f(UNFINISHED)));
    }
}
