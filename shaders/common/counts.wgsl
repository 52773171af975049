// What traversal does and how long paths are; only in pipelines that are asked to count.

var<private> nodes_tested: u32;
var<private> primitives_tested: u32;

fn count_path(depth: u32) {
    atomicAdd(&counters[COUNTER_ENDED + min(depth, COUNTED_DEPTHS - 1u)], 1u);
}
