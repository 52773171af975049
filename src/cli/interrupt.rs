//! Signals that end a process: INT (Ctrl-C), TERM and HUP. The first ends a render early, so that what is done is written; the next ends the process
//! at once, as does the first while there is nothing to write. A HUP that was ignored at the start stays ignored: that is how `nohup` asks to go on.

use super::print::note;
use crate::error::{Error, Result};
use crate::output::remove_temporaries;
use crate::render::Halt;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// A render is under way that looks at [`halt`].
static HEEDED: AtomicBool = AtomicBool::new(false);
static HALT: LazyLock<Halt> = LazyLock::new(Halt::default);
/// Number of the signal that came, or 0.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// Installs the handlers.
pub fn install() -> Result<()> {
    watch().map_err(|e| Error::usage(format!("cannot watch for signals: {e}"), "this system refuses signal handlers; report it"))
}

#[cfg(unix)]
fn watch() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let hup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM].into_iter().chain(hup))?;
    // A thread, and no handler: here everything may be done.
    std::thread::Builder::new().name("signals".to_string()).spawn(move || {
        // Their numbers are 1 to 15.
        signals.forever().for_each(|signal| received(signal as u8));
    })?;
    Ok(())
}

#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    // SAFETY: all zeros is a valid sigaction; with no new one given, the call only fills it in.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &mut action) == 0 && action.sa_sigaction == libc::SIG_IGN
    }
}

#[cfg(not(unix))]
fn watch() -> std::result::Result<(), ctrlc::Error> {
    // The number of SIGINT: Ctrl-C has the same exit code everywhere.
    ctrlc::set_handler(|| received(2))
}

fn received(signal: u8) {
    let again = SIGNAL.swap(signal, Ordering::SeqCst) != 0;
    if again || !HEEDED.load(Ordering::SeqCst) {
        remove_temporaries();
        end(exit_code());
    }
    HALT.request();
    note("stopping: what is done will be written; a second signal quits at once and writes nothing");
}

/// Ends the process without the clean-up of libraries, whose threads still work.
#[cfg(unix)]
fn end(code: u8) -> ! {
    signal_hook::low_level::exit(i32::from(code))
}

#[cfg(not(unix))]
fn end(code: u8) -> ! {
    std::process::exit(i32::from(code))
}

/// From here on a signal requests the [`halt`] instead of ending the process.
pub fn heed() {
    HEEDED.store(true, Ordering::SeqCst);
}

/// Requested when a signal comes.
pub fn halt() -> &'static Halt {
    &HALT
}

/// Whether a signal has come.
pub fn requested() -> bool {
    HALT.is_requested()
}

/// Exit code after a signal, as shells have it: 128 and its number.
pub fn exit_code() -> u8 {
    128 + SIGNAL.load(Ordering::SeqCst)
}
