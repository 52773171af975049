//! Sweeps: a sample of each is taken here, all of it by `tools/soak`, which sets `ABBE_SWEEP` to how many inputs each is to take.

/// How many inputs to take, or cases of a list: `few` here.
pub fn count(few: usize) -> usize {
    match std::env::var("ABBE_SWEEP") {
        Ok(text) => text.parse().unwrap_or_else(|_| panic!("ABBE_SWEEP is a count of inputs, not {text}")),
        Err(_) => few,
    }
}
