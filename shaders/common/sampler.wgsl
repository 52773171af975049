// Low-discrepancy numbers keyed by pixel, sequence, sample and dimension: padded (0,2)-sequences with Owen scrambling by hashing
// (Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020). Never keyed by an invocation's place in a queue.
var<private> sampler_pixel: u32; // hash of pixel, sequence and seed
var<private> sampler_index: u32; // sample within the sequence
var<private> sampler_dimension: u32;

// Integer hash of good avalanche (Wellons, "prospecting for hash functions", lowbias32).
fn hash(x: u32) -> u32 {
    var h = x;
    h ^= h >> 16u;
    h *= 0x7feb352du;
    h ^= h >> 15u;
    h *= 0x846ca68bu;
    h ^= h >> 16u;
    return h;
}

fn hash2(a: u32, b: u32) -> u32 {
    return hash(a ^ (hash(b) + 0x9e3779b9u + (a << 6u) + (a >> 2u)));
}

// Nested uniform scramble of a bit-reversed integer (Laine-Karras permutation with Vegdahl's constants).
fn owen_scramble_reversed(v: u32, seed: u32) -> u32 {
    var x = v;
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Second dimension of the Sobol' sequence: the index times the Pascal matrix modulo 2, in five butterfly steps; bit-reversed.
fn sobol_second_reversed(index: u32) -> u32 {
    var x = index;
    x ^= (x >> 16u) & 0x0000ffffu;
    x ^= (x >> 8u) & 0x00ff00ffu;
    x ^= (x >> 4u) & 0x0f0f0f0fu;
    x ^= (x >> 2u) & 0x33333333u;
    x ^= (x >> 1u) & 0x55555555u;
    return x;
}

fn unit_float(x: u32) -> f32 {
    return f32(x >> 8u) * 0x1p-24;
}

// Restarts the sequence for a sample of a pixel.
fn start_sampler(pixel: u32, sequence: u32, seed: u32, index: u32) {
    sampler_pixel = hash2(hash2(pixel, sequence), seed);
    sampler_index = index;
    sampler_dimension = 0u;
}

// The next two dimensions, in [0, 1).
fn next_2d() -> vec2f {
    let key = hash2(sampler_pixel, sampler_dimension);
    sampler_dimension += 1u;
    // Shuffling the index decorrelates the pairs; each pair stays a (0,2)-sequence.
    let index = reverseBits(owen_scramble_reversed(reverseBits(sampler_index), key));
    let x = reverseBits(owen_scramble_reversed(index, hash(key ^ 0xa511e9b3u)));
    let y = reverseBits(owen_scramble_reversed(sobol_second_reversed(index), hash(key ^ 0x63d83595u)));
    return vec2f(unit_float(x), unit_float(y));
}

fn next_1d() -> f32 {
    return next_2d().x;
}
