//! Signals that end a process: INT (Ctrl-C), TERM and HUP. The first ends a render early, so that what is done is written; the next ends the process
//! at once, as does the first while there is nothing to write. A HUP that was ignored at the start stays ignored: that is how `nohup` asks to go on.

use super::print::note;
use crate::error::{Error, Result};
use crate::output::remove_temporaries;
use crate::render::Halt;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{LazyLock, OnceLock};
use std::time::{Duration, Instant};

/// A render is under way that looks at [`halt`].
static HEEDED: AtomicBool = AtomicBool::new(false);
static HALT: LazyLock<Halt> = LazyLock::new(Halt::default);
/// Number of the signal that came, or 0.
static SIGNAL: AtomicU8 = AtomicU8::new(0);
/// When the first one came.
static FIRST: OnceLock<Instant> = OnceLock::new();

/// Signals that come so soon after the first are the same request: `timeout` sends its own twice, to the process and to its group.
const SAME: Duration = Duration::from_millis(500);

/// Whether a signal that comes `now` is a second request.
fn is_second(first: Option<&Instant>, now: Instant) -> bool {
    first.is_some_and(|first| now.saturating_duration_since(*first) >= SAME)
}

/// Installs the handlers.
pub fn install() -> Result<()> {
    watch().map_err(|e| Error::usage(format!("cannot watch for signals: {e}"), "this system refuses signal handlers; report it"))
}

#[cfg(unix)]
fn watch() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let hup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    // A file that outgrows its limit is an error of that write.
    // SAFETY: no handler is installed, and none was.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
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
    let now = Instant::now();
    let is_first = FIRST.set(now).is_ok();
    if is_first {
        SIGNAL.store(signal, Ordering::SeqCst);
    }
    if is_second(FIRST.get(), now) || !HEEDED.load(Ordering::SeqCst) {
        remove_temporaries();
        end(exit_code());
    }
    if !is_first {
        return;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_at_once_after_the_first_signal_is_no_second_request() {
        let first = Instant::now();
        assert!(!is_second(None, first));
        assert!(!is_second(Some(&first), first) && !is_second(Some(&first), first + SAME / 2));
        assert!(is_second(Some(&first), first + SAME));
    }
}
