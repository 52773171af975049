// State of the path that an invocation is tracing.

var<private> beta: array<vec4f, LANES4>; // throughput per lane
var<private> li: array<vec4f, LANES4>; // radiance gathered so far
var<private> pending: array<vec4f, LANES4>; // light-sample contribution that waits for its shadow ray

fn sum_beta() -> f32 {
    var s = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        s += beta[k];
    }
    return sum4(s);
}

fn scale_beta(factor: f32) {
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= factor;
    }
}

#if LANE_CHOICE
var<private> lane_shares: array<vec4f, LANES4>; // probabilities, but for a common factor

// A lane with probability lane_shares / their sum.
fn choose_lane(u: f32) -> u32 {
    var total = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        total += lane_shares[k];
    }
    let target_sum = u * sum4(total);
    var lane = 0u;
    var last = 0u;
    var s = 0.0;
    for (var k = 0u; k < LANES4; k++) {
        for (var c = 0u; c < 4u; c++) {
            let share = lane_shares[k][c];
            // The last lane of a share that is not zero catches what rounding leaves over.
            last = select(last, 4u * k + c, share > 0.0);
            s += share;
            lane = select(lane, 4u * k + c + 1u, s <= target_sum);
        }
    }
    return min(lane, last);
}

// A lane with probability beta / sum(beta): the one-sample mixture over wavelengths; callers divide by the mixture's pdf.
fn sample_lane(u: f32) -> u32 {
    lane_shares = beta;
    return choose_lane(u);
}
#endif

fn at_lane(values: ptr<private, array<vec4f, LANES4>>, lane: u32) -> f32 {
    var chosen = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        chosen += (*values)[k] * one_hot(lane, k);
    }
    return sum4(chosen);
}

fn beta_at(lane: u32) -> f32 {
    return at_lane(&beta, lane);
}

// Value of a spectrum at one lane.
fn spectrum_at(row: u32, lane: u32) -> f32 {
    return component(spectrum(row, lane / 4u), lane % 4u);
}
