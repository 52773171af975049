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

fn filter_weight(x: f32) -> f32 {
    return filter_weights(vec4f(x)).x;
}

// One of the pixels whose filter covers `x` (pixels), by its weight: (pixel, sum of weights), negative if none.
fn choose_pixel(x: f32, u: f32) -> vec2f {
    let first = ceil(x - 0.5 - params.filter_reach);
    let last = floor(x - 0.5 + params.filter_reach);
    var total = 0.0;
    var chosen = -1.0;
    var v = u;
    for (var p = first; p <= last; p += 1.0) {
        let w = filter_weight(x - 0.5 - p);
        total += w;
        // Reservoir of one: keeps p with probability w / total.
        let keep = w > 0.0 && v * total < w;
        chosen = select(chosen, p, keep);
        v = select((v * total - w) / max(total - w, 1e-20), v * total / max(w, 1e-20), keep);
    }
    return vec2f(chosen, total);
}
