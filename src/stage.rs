//! What loading and set-up are busy with, for whoever shows it.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The stages, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Files are read and checked.
    Reading,
    /// What the scene needs is worked out.
    Planning,
    /// Lights are listed.
    Lights,
    /// Hierarchies are built over the primitives.
    Hierarchies,
    /// Tables go to the adapter.
    Uploading,
    /// Kernels are compiled.
    Compiling,
}

/// What the stages are called.
pub const NAMES: [&str; 6] =
    ["reading the scene", "planning", "listing lights", "building hierarchies", "uploading", "compiling"];

static NOW: AtomicUsize = AtomicUsize::new(0);

/// A stage begins.
pub(crate) fn enter(stage: Stage) {
    NOW.store(stage as usize, Relaxed);
}

/// The number of the stage under way, from 0.
pub fn now() -> usize {
    NOW.load(Relaxed)
}
