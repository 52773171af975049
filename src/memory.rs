//! How much memory is held, and a limit to it (`--max-memory`) for what a scene's size decides: loading and set-up.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The system's allocator, which counts what is held; for the `abbe` command. Where the limit would be passed the process ends, as an allocation
/// cannot fail otherwise: by what [`at_limit`] was given, or else it is aborted.
#[derive(Debug)]
pub struct Counted;

static HELD: AtomicU64 = AtomicU64::new(0);
static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);
static AT_LIMIT: OnceLock<fn(u64) -> !> = OnceLock::new();

/// Says how the process ends where the limit, in bytes, would be passed. The limit is lifted by then. Only the first call counts.
pub fn at_limit(end: fn(u64) -> !) {
    let _ = AT_LIMIT.set(end);
}

/// From here on no more than so many bytes may be held, or as many as there are.
pub fn limit(bytes: Option<u64>) {
    LIMIT.store(bytes.unwrap_or(u64::MAX), Relaxed);
}

/// Counts bytes that an adapter is to hold, while there is a limit.
pub(crate) fn count_on_adapter(bytes: u64) {
    if LIMIT.load(Relaxed) != u64::MAX {
        count(bytes);
    }
}

fn count(bytes: u64) {
    let held = HELD.fetch_add(bytes, Relaxed) + bytes;
    let most = LIMIT.load(Relaxed);
    if held > most {
        // Saying it takes some memory, too.
        limit(None);
        AT_LIMIT.get().map_or_else(|| std::process::abort(), |end| end(most))
    }
}

// SAFETY: all memory comes from and goes back to the system's allocator, with the layouts as given.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as u64);
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as u64);
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size() as u64, Relaxed);
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size as u64);
        HELD.fetch_sub(layout.size() as u64, Relaxed);
        unsafe { System.realloc(memory, layout, size) }
    }
}
