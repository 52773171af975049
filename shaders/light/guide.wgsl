// Guided emission: the random numbers that a light path begins with (choice of a light, point on it, direction: primary sample space) are warped to where
// paths were of use before (Guo et al. 2018, "Primary sample space path guiding"; the tree: src/integrator/guide.rs). The warp's density divides the
// throughput; multiple importance sampling goes on with the density without it, which camera paths can work out: any weights are right that add up to one.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/sampler.wgsl"

@group(0) @binding(18) var guide: Table<vec4u>;

// Two vectors for each path that was of use, kept by chance: point and direction; light, wavelength, squared contribution without the warp, density of the warp.
struct GuidingSamples {
    count: atomic<u32>,
    records: array<vec4f>,
}
@group(0) @binding(19) var<storage, read_write> guiding_samples: GuidingSamples;

// A contribution beyond this is not told from this: single bright paths would draw many after them (64, 1024 and 16384 were measured to be worse the larger).
const MOST_CONTRIBUTION = 16.0;

struct EmissionNumbers {
    at: vec4f, // point on the light (axes 0 and 1), direction (2 and 3)
    choices: vec2f, // of a light (axis 4), of the wavelength that a path keeps where they part (5)
}

var<private> numbers: EmissionNumbers;
var<private> guide_density: f32; // of the numbers, relative to even ones
// Squared, without the warp, in units of CONTRIBUTION_UNIT: the points of a cell come in any order, which sums of floats would show.
var<private> guiding_contribution: u32;
const CONTRIBUTION_UNIT = 0x1p-22;

fn guided_numbers() -> EmissionNumbers {
    var v = next_2d();
    var u = vec4f(next_2d(), next_2d());
    var low = vec4f(0.0);
    var size = vec4f(1.0);
    var low_v = vec2f(0.0);
    var size_v = vec2f(1.0);
    guide_density = 1.0;
    guiding_contribution = 0u;
    var node = load_guide(GUIDE_ROOT);
    while (node.x < GUIDE_AXES) {
        let is_axis = vec4u(node.x) == vec4u(0u, 1u, 2u, 3u);
        let is_choice = vec2u(node.x) == vec2u(4u, 5u);
        let x = select(component(u, node.x), select(v.x, v.y, is_choice.y), any(is_choice));
        let lower = bitcast<f32>(node.z);
        let goes_up = x >= lower;
        // What is left of the number goes on, within [0, 1).
        let rest = clamp(select(x / lower, (x - lower) / (1.0 - lower), goes_up), 0.0, 0x1.fffffep-1);
        u = select(u, vec4f(rest), is_axis);
        v = select(v, vec2f(rest), is_choice);
        size = select(size, 0.5 * size, is_axis);
        size_v = select(size_v, 0.5 * size_v, is_choice);
        low += select(vec4f(0.0), size, is_axis & vec4<bool>(goes_up));
        low_v += select(vec2f(0.0), size_v, is_choice & vec2<bool>(goes_up));
        guide_density *= 2.0 * select(lower, 1.0 - lower, goes_up);
        node = load_guide(GUIDE_ROOT + node.y + select(0u, 1u, goes_up));
    }
    let most = 0x1.fffffep-1;
    numbers = EmissionNumbers(min(low + size * u, vec4f(most)), min(low_v + size_v * v, vec2f(most)));
    return numbers;
}

// A splat of this radiance (sum over the bins) into `pixel`: how much of what the pixel has it would be in a pass of one path for each pixel.
fn add_to_guiding_sample(pixel: vec2u, radiance: f32) {
    let block = pixel * GUIDE_BLOCKS / vec2u(params.image_width, params.image_height);
    let of_splat = min(guide_density * radiance * bitcast<f32>(load_guide(block.y * GUIDE_BLOCKS + block.x).x), MOST_CONTRIBUTION);
    let sum = guiding_contribution + u32(of_splat * of_splat / CONTRIBUTION_UNIT + 0.5);
    guiding_contribution = select(sum, 0xffffffffu, sum < guiding_contribution);
}

// The path has ended. It is reported with a probability in proportion to what it adds to the integral of squared use, so that a rare bright one is not missed.
fn store_guiding_sample() {
    let name = hash2(sampler_index, sampler_pixel);
    let contribution_squared = f32(guiding_contribution) * CONTRIBUTION_UNIT;
    if (unit_float(name) < params.guiding_sample_rate * contribution_squared / guide_density) {
        let at = atomicAdd(&guiding_samples.count, 1u);
        if (at < params.guiding_sample_room) {
            guiding_samples.records[2u * at] = numbers.at;
            guiding_samples.records[2u * at + 1u] = vec4f(numbers.choices, contribution_squared, guide_density);
        }
    }
}
