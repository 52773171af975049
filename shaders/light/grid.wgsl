// Which light to sample of those that have a place, by the table of the grid's cell around the point that is lit (src/gpu/light_grid.rs).
#include "light/lights.wgsl"

@group(0) @binding(22) var light_grid: Table<vec4u>;

// Texels of a cell's table, two entries to one.
const LIGHT_GRID_TEXELS = (LIGHT_ENTRIES + 1u) / 2u;

// Where the table of the cell around `p` begins. Lights are chosen for it alone, whether `p` is in the scene or not.
fn light_table_at(p: vec3f) -> u32 {
    let ramps = clamp((p - SCENE_RAMP_LOW) * SCENE_RAMP_PER_METRE, vec3f(0.0), vec3f(1.0))
        + clamp((p - NEAR_RAMP_LOW) * NEAR_RAMP_PER_METRE, vec3f(0.0), vec3f(1.0));
    let cell = min(vec3u(ramps * (0.5 * f32(LIGHT_GRID_SIDE))), vec3u(LIGHT_GRID_SIDE - 1u));
    return (cell.x + LIGHT_GRID_SIDE * (cell.y + LIGHT_GRID_SIDE * cell.z)) * LIGHT_GRID_TEXELS;
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
    let at = alias_entry(u, LIGHT_ENTRIES);
    var index = u32(at.x);
    var entry = light_entry(first, index);
    if (!is_kept(entry.x, at.y)) {
        index = entry.x & 0xffffu;
        entry = light_entry(first, index);
    }
    var probability = NEAR_SHARE * bitcast<f32>(entry.y);
    if (LIGHTS_OF_ENTRY > 1u) {
        // The first choice has used up its number.
        let begin = FIRST_LIGHT_IN_ORDER + index * LIGHTS_OF_ENTRY;
        let within = alias_entry(next_1d(), min(LIGHTS_OF_ENTRY, NEAR_LIGHTS - index * LIGHTS_OF_ENTRY));
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
    var probability = NEAR_SHARE;
    if (LIGHTS_OF_ENTRY > 1u) {
        let places = load_light_grid(FIRST_LIGHT_IN_ORDER + NEAR_LIGHTS + index / 4u);
        let place = select(select(places.x, places.y, index % 4u == 1u), select(places.z, places.w, index % 4u == 3u), index % 4u >= 2u);
        entry = place / LIGHTS_OF_ENTRY;
        probability *= bitcast<f32>(load_light_grid(FIRST_LIGHT_IN_ORDER + place).y);
    }
    return probability * bitcast<f32>(light_entry(light_table_at(p), entry).y);
}
