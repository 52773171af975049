// Which light to sample of those that have a place, by the table of the grid's cell around the point that is lit (src/gpu/scene/light_grid.rs).
#include "light/light.wgsl"

@group(0) @binding(22) var light_grid: Table<vec4u>;

// Where the table of the cell around `p` begins. Lights are chosen for it alone, whether `p` is in the scene or not.
fn light_table_at(p: vec3f) -> u32 {
    let ramps = clamp((p - params.scene_ramp_low.xyz) * params.scene_ramp_per_metre.xyz, vec3f(0.0), vec3f(1.0))
        + clamp((p - params.near_ramp_low.xyz) * params.near_ramp_per_metre.xyz, vec3f(0.0), vec3f(1.0));
    let cell = min(vec3u(ramps * (0.5 * f32(params.light_grid_side))), vec3u(params.light_grid_side - 1u));
    // Two entries to a texel.
    let texels_of_cell = (params.light_entries + 1u) / 2u;
    return (cell.x + params.light_grid_side * (cell.y + params.light_grid_side * cell.z)) * texels_of_cell;
}

// Threshold and alias, and probability, of an entry of the table that begins at `first`.
fn light_entry(first: u32, entry: u32) -> vec2u {
    let two = load_light_grid(first + entry / 2u);
    return select(two.xy, two.zw, (entry & 1u) != 0u);
}

fn is_kept(word: u32, left: f32) -> bool {
    return left * 65536.0 < f32(word >> 16u);
}

// A light that has a place, for the point `p`.
fn choose_near_light(p: vec3f, u: f32) -> LightChoice {
    let first = light_table_at(p);
    let at = alias_entry(u, params.light_entries);
    var index = u32(at.x);
    var entry = light_entry(first, index);
    if (!is_kept(entry.x, at.y)) {
        index = entry.x & 0xffffu;
        entry = light_entry(first, index);
    }
    var probability = params.near_share * bitcast<f32>(entry.y);
    if (params.lights_of_entry > 1u) {
        // The first choice has used up its number.
        let begin = params.first_light_in_order + index * params.lights_of_entry;
        let within = alias_entry(next_1d(), min(params.lights_of_entry, params.first_distant_light - index * params.lights_of_entry));
        var light = load_light_grid(begin + u32(within.x));
        if (!is_kept(light.x, within.y)) {
            light = load_light_grid(begin + (light.x & 0xffffu));
        }
        index = light.z;
        probability *= bitcast<f32>(light.y);
    }
    return LightChoice(index, probability);
}

// Probability that a camera path at `p` chooses the light `index`, which has a place.
fn probability_of_near_light(index: u32, p: vec3f) -> f32 {
    var entry = index;
    var probability = params.near_share;
    if (params.lights_of_entry > 1u) {
        let places = load_light_grid(params.first_light_in_order + params.first_distant_light + index / 4u);
        let place = select(select(places.x, places.y, index % 4u == 1u), select(places.z, places.w, index % 4u == 3u), index % 4u >= 2u);
        entry = place / params.lights_of_entry;
        probability *= bitcast<f32>(load_light_grid(params.first_light_in_order + place).y);
    }
    return probability * bitcast<f32>(light_entry(light_table_at(p), entry).y);
}
