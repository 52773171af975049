//! Renders on the adapter: against the double-precision reference, against known answers, and how the GPU's side gets there.

#[path = "../support/adapter.rs"]
mod adapter;
mod agreement;
mod film;
mod gpu;
mod passes;
mod patches;
#[path = "../support/random.rs"]
mod random;
#[path = "../support/scenes.rs"]
mod scenes;
#[path = "../support/sweep.rs"]
mod sweep;
mod validate;
