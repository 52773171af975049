// Where wavelengths arrive in the picture, each in a pixel of its own.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/spectra.wgsl"
#include "sensor/filter.wgsl"

// One of the pixels from `low` on, below `high`, whose filter covers `x` (pixels), by its weight; and the sum of their weights.
struct Chosen {
    pixel: vec4f,
    total: vec4f,
}

fn choose_pixels(x: vec4f, u: f32, low: f32, high: f32) -> Chosen {
#if FILTER_TENT || FILTER_GAUSSIAN
    var chosen = Chosen(vec4f(-1.0), vec4f(0.0));
    var v = vec4f(u);
    let reach = ceil(params.filter_reach);
    for (var step = -reach; step <= reach; step += 1.0) {
        let p = floor(x) + step;
        let w = select(vec4f(0.0), filter_weights(x - 0.5 - p), (p >= vec4f(low)) & (p < vec4f(high)));
        let total = chosen.total + w;
        // Reservoir of one: keeps p with probability w / total.
        let keep = (w > vec4f(0.0)) & (v * total < w);
        chosen.pixel = select(chosen.pixel, p, keep);
        // Pixels that are not covered leave the number as it is.
        let rest = select((v * total - w) / max(total - w, vec4f(1e-20)), v * total / max(w, vec4f(1e-20)), keep);
        v = select(v, rest, w > vec4f(0.0));
        chosen.total = total;
    }
    return chosen;
#else
    let p = floor(x);
    return Chosen(p, select(vec4f(0.0), vec4f(1.0), (p >= vec4f(low)) & (p < vec4f(high))));
#endif
}

// The pixel of each wavelength, by its number within the tile, or NONE; and what radiance counts there.
var<private> landed_pixel: array<vec4u, WAVELENGTHS4>;
var<private> landed_weight: array<vec4f, WAVELENGTHS4>;

// Chooses the pixels of wavelengths 4k .. 4k+3, where they arrive at all, around these places of the picture (pixels). Returns the sum of the filter's weights there.
fn land_in_pixels(k: u32, column: vec4f, row: vec4f, arrives: vec4<bool>, u: vec2f) -> vec4f {
    let low = vec2f(f32(params.tile_x), f32(params.tile_y));
    let high = low + vec2f(f32(params.tile_width), f32(params.tile_height));
    // Far away steps of one pixel would be lost in rounding.
    let margin = params.filter_reach + 1.0;
    let columns = choose_pixels(clamp(column, vec4f(low.x - margin), vec4f(high.x + margin)), u.x, low.x, high.x);
    let rows = choose_pixels(clamp(row, vec4f(low.y - margin), vec4f(high.y + margin)), u.y, low.y, high.y);
    let share = select(vec4f(0.0), columns.total * rows.total, arrives);
    let lands = share > vec4f(0.0);
    let at = select(vec4f(0.0), (rows.pixel - low.y) * f32(params.tile_width) + columns.pixel - low.x, lands);
    landed_pixel[k] = select(vec4u(NONE), vec4u(at), lands);
    landed_weight[k] = share;
    return share;
}
