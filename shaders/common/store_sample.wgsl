// Hands finished samples to update_film.wgsl: slot by slot, one for every sample of the dispatch.
#include "common/sample_slot.wgsl"

fn store_sample(slot: u32) {
    for (var k = 0u; k < LANES4; k++) {
        textureStore(samples, texel(slot * LANES4 + k), bitcast<vec4u>(li[k]));
    }
}

// Marks an invocation's slots as those of samples that are not finished, until they are.
fn mark_unfinished(group: u32, local: u32) {
    for (var block = 0u; block < params.blocks; block++) {
        let first = first_slot(group, block, local);
        for (var i = 0u; i < params.samples; i++) {
            textureStore(samples, texel((first + i) * LANES4), bitcast<vec4u>(vec4f(UNFINISHED)));
        }
    }
}
