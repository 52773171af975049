// The reconstruction filter, from the side of the film.
#include "common/params.wgsl"

// Weight of the reconstruction filter at distance x from a pixel's centre, normalised to integral 1; pixels.
fn filter_weights(x: vec4f) -> vec4f {
#if FILTER_TENT
    return max(vec4f(0.0), 1.0 - abs(x) / params.filter_radius) / params.filter_radius;
#elif FILTER_GAUSSIAN
    let s = x / params.filter_radius;
    // It ends at its reach, for which it is normalised.
    return select(vec4f(0.0), exp(-0.5 * s * s) * 0.4000222589 / params.filter_radius, abs(x) <= vec4f(params.filter_reach));
#else
    return select(vec4f(0.0), vec4f(1.0), (x >= vec4f(-0.5)) & (x < vec4f(0.5)));
#endif
}
