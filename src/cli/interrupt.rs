//! Ctrl-C: the first stops a render after its current batch, so that what exists is written; the next ends the process at once.

use super::{INTERRUPTED, print::note};
use crate::error::{Error, Result};
use crate::output::remove_temporaries;
use std::sync::atomic::{AtomicBool, Ordering};

/// A render is under way that will look at [`requested`].
static HEEDED: AtomicBool = AtomicBool::new(false);
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Installs the handler.
pub fn install() -> Result<()> {
    ctrlc::set_handler(|| {
        let again = REQUESTED.swap(true, Ordering::SeqCst);
        if again || !HEEDED.load(Ordering::SeqCst) {
            remove_temporaries();
            std::process::exit(i32::from(INTERRUPTED));
        }
        note("\nstopping after this batch; Ctrl-C again quits at once and writes nothing");
    })
    .map_err(|e| Error::usage(format!("cannot watch for Ctrl-C: {e}"), "this system refuses signal handlers; report it"))
}

/// From here on a Ctrl-C is answered by [`requested`] instead of ending the process.
pub fn heed() {
    HEEDED.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C has been pressed.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}
