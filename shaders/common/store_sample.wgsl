// Hands finished samples to update_film.wgsl: slot by slot, one for every sample of the dispatch.
#include "path/state.wgsl"
@group(0) @binding(14) var samples: WritableTable<vec4f>;

fn store_sample(slot: u32) {
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        store_samples(slot * WAVELENGTHS4 + k, li[k]);
    }
}

// Marks `count` slots, 64 apart, as those of samples that are not finished, until they are.
fn mark_unfinished(first: u32, count: u32) {
    for (var i = 0u; i < count; i++) {
        store_samples((first + 64u * i) * WAVELENGTHS4, vec4f(UNFINISHED));
    }
}
