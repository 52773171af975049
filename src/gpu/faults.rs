//! What becomes of a device that fails: the driver reports it lost, memory runs out, or wgpu panics on what it did not expect.
//!
//! wgpu tells of most failures through callbacks, on no particular call, and takes a submission to a lost device without a word. So the first failure is
//! kept here, and whoever has waited for the device asks for it before believing what the device has written.

use crate::error::{Error, Result};
use std::cell::{Cell, RefCell};
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Mutex, Once, PoisonError};

/// The first failure of a device.
#[derive(Debug, Clone, Default)]
pub struct Faults(Arc<Mutex<Option<Fault>>>);

#[derive(Debug, Clone)]
struct Fault {
    problem: String,
    remedy: &'static str,
}

const OUT_OF_MEMORY: &str = "free some of its memory, or ask for a smaller --size or fewer --channels";
const LOST: &str = "render again; if it fails again, update its driver or choose another with --device";

impl Faults {
    /// Has the callbacks of `device` tell of its failures from now on.
    pub(super) fn watch(&self, device: &wgpu::Device) {
        let faults = self.clone();
        device.on_uncaptured_error(Arc::new(move |e| faults.record_error(&e)));
        let faults = self.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Destroyed by its owner, it has not failed.
            if reason != wgpu::DeviceLostReason::Destroyed {
                // Memory that runs out where WebGPU has no error for it is a loss, too.
                let remedy = if message.to_lowercase().contains("memory") { OUT_OF_MEMORY } else { LOST };
                faults.record(format!("it was lost: {message}"), remedy);
            }
        });
    }

    fn record(&self, problem: String, remedy: &'static str) {
        self.lock().get_or_insert(Fault { problem, remedy });
    }

    /// Takes note that the device no longer answers, unless more is known already.
    pub(super) fn lost(&self, e: &dyn fmt::Display) -> Error {
        self.record(format!("it stopped answering: {e}"), LOST);
        self.error()
    }

    /// Takes note of an error of wgpu.
    pub(super) fn record_error(&self, e: &wgpu::Error) {
        match e {
            wgpu::Error::OutOfMemory { .. } => self.record("out of memory".to_string(), OUT_OF_MEMORY),
            wgpu::Error::Validation { .. } | wgpu::Error::Internal { .. } => self.record(e.to_string(), LOST),
        }
    }

    /// Whether the device has failed, as far as is known.
    fn any(&self) -> bool {
        self.lock().is_some()
    }

    /// What the device has written until now may be believed.
    ///
    /// # Errors
    /// [`Error::Fault`] if it has failed, [`Error::OutOfMemory`] for want of memory.
    pub fn check(&self) -> Result<()> {
        if self.any() { Err(self.error()) } else { Ok(()) }
    }

    /// The first failure.
    fn error(&self) -> Error {
        let (problem, remedy) = self.lock().as_ref().map_or(("unknown".to_string(), LOST), |f| (f.problem.clone(), f.remedy));
        let (problem, remedy) = (format!("the device failed: {problem}"), remedy.to_string());
        if remedy == OUT_OF_MEMORY { Error::OutOfMemory { problem, remedy } } else { Error::Fault { problem, remedy } }
    }

    /// Does `work` with the device. A panic in it, as wgpu has on failures that it does not expect, is a failure of the device.
    ///
    /// # Errors
    /// Those of `work`, and those of [`Faults::check`].
    pub fn guard<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        self.check()?;
        let outer = QUIET.replace(true);
        quiet_panics();
        let done = catch_unwind(AssertUnwindSafe(work));
        QUIET.set(outer);
        done.unwrap_or_else(|_| {
            self.record(PANIC.take(), LOST);
            Err(self.error())
        })
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Fault>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

thread_local! {
    /// Panics of this thread are caught, and told of by an error.
    static QUIET: Cell<bool> = const { Cell::new(false) };
    /// What the last of them said, and where.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Has panics that are caught here say nothing on standard error; others do as they did.
fn quiet_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |info| {
            if QUIET.get() {
                let said = info.payload().downcast_ref::<String>().map(String::as_str);
                let said = said.or(info.payload().downcast_ref::<&str>().copied()).unwrap_or("no reason given");
                let place = info.location().map_or(String::new(), |at| format!(" ({}:{})", at.file(), at.line()));
                PANIC.set(format!("{said}{place}"));
            } else {
                before(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_failure_and_the_first_failure_stays() {
        let faults = Faults::default();
        assert_eq!(faults.guard(|| Ok(1)).unwrap(), 1);
        let refused = || Error::usage("no", "ask for less");
        assert!(matches!(faults.guard(|| Err::<(), _>(refused())), Err(Error::Usage { .. })));
        assert!(!faults.any(), "a refusal is no failure");
        let failed = faults.guard::<()>(|| panic!("zombie")).unwrap_err().to_string();
        assert!(failed.contains("zombie") && failed.contains("--device"), "{failed}");
        faults.record("later".to_string(), LOST);
        assert_eq!(faults.check().unwrap_err().to_string(), failed);
        assert!(matches!(faults.guard(|| Ok(())), Err(Error::Fault { .. })), "a failed device goes on");
    }
}
