//! Random numbers keyed by what they are for, so that results do not depend on threads.

/// SplitMix64 (Steele, Lea & Flood 2014), started from a hash of the seed, the batch and the path.
pub(super) struct Rng(u64);

impl Rng {
    pub(super) fn new(seed: u64, batch: u32, path: u64) -> Self {
        Self(mix(mix(mix(seed) ^ u64::from(batch)) ^ path))
    }

    /// Uniform in [0, 1).
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn next2(&mut self) -> [f64; 2] {
        [self.next(), self.next()]
    }
}

fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
