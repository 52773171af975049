// What is counted for people (COUNTER_*), and, in kernels that are asked to, what traversal does and how long paths are.
@group(0) @binding(6) var<storage, read_write> counters: array<atomic<u32>>;

#if COUNTED
var<private> nodes_tested: u32;
var<private> primitives_tested: u32;

fn count_path(depth: u32) {
    atomicAdd(&counters[COUNTER_ENDED + min(depth, COUNTED_DEPTHS - 1u)], 1u);
}
#endif
