//! Writing to the terminal without dying of a closed pipe, and without control characters, which files may hold and terminals obey.

use std::borrow::Cow;
use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::sync::Mutex;

/// What went wrong first with standard output.
static FAILURE: Mutex<Option<io::Error>> = Mutex::new(None);

/// The text with control characters written out, line ends and tabs excepted: what comes from a file must not move the cursor or more.
fn harmless(text: &str) -> Cow<'_, str> {
    let is_harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(is_harmful) {
        return Cow::Borrowed(text);
    }
    text.chars()
        .fold(String::with_capacity(text.len()), |mut safe, c| {
            if is_harmful(c) {
                safe.extend(c.escape_default())
            } else {
                safe.push(c)
            }
            safe
        })
        .into()
}

/// Writes `text` and a line end where it lacks one. A reader that has closed the pipe has seen what it wanted; other failures are kept for
/// [`failure`].
pub fn out(text: &str) {
    let text = harmless(text);
    let end = if text.ends_with('\n') { "" } else { "\n" };
    let mut stdout = stdout().lock();
    let written = write!(stdout, "{text}{end}").and_then(|()| stdout.flush());
    if let (Err(e), Ok(mut failure)) = (written, FAILURE.lock())
        && e.kind() != ErrorKind::BrokenPipe
    {
        failure.get_or_insert(e);
    }
}

/// Why not all of the output was written, if so.
pub fn failure() -> Option<io::Error> {
    FAILURE.lock().ok()?.take()
}

/// Writes one line to standard error.
pub fn note(text: &str) {
    let _ = writeln!(stderr().lock(), "{}", harmless(text));
}

/// Writes an error as one line, whatever line ends the message holds.
pub fn error(text: &str) {
    note(&format!("error: {}", text.split_whitespace().collect::<Vec<_>>().join(" ")));
}

/// Bytes in the unit that suits them.
pub fn bytes(n: u64) -> String {
    let units = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let step = (n.max(1).ilog2() / 10).min(4);
    let value = n as f64 / f64::from(1u32 << (10 * step.min(3))) / if step == 4 { 1024.0 } else { 1.0 };
    if step == 0 { format!("{n} bytes") } else { format!("{value:.1} {}", units[step as usize]) }
}

/// `1234567` as `1.23 M`.
pub fn si(value: f64) -> String {
    let (scale, unit) = match value.abs() {
        v if v >= 1e9 => (1e-9, " G"),
        v if v >= 1e6 => (1e-6, " M"),
        v if v >= 1e3 => (1e-3, " k"),
        _ => (1.0, " "),
    };
    let digits = match (value * scale).abs() {
        v if v >= 100.0 => 0,
        v if v >= 10.0 => 1,
        _ => 2,
    };
    format!("{:.digits$}{unit}", value * scale)
}

/// Seconds as `9.3 s`, `2:07 min` or `1:02:07 h`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{seconds:.1} s"),
        60..3600 => format!("{}:{:02} min", whole / 60, whole % 60),
        _ => format!("{}:{:02}:{:02} h", whole / 3600, whole / 60 % 60, whole % 60),
    }
}

/// A relative error as `1.2 %`; `?` before it is known.
pub fn percent(relative: f64) -> String {
    if relative.is_finite() { format!("{:.2} %", 100.0 * relative) } else { "?".to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        assert_eq!(si(4_321_000.0), "4.32 M");
        assert_eq!(si(0.0), "0.00 ");
        assert_eq!(si(123_456.0), "123 k");
        assert_eq!(duration(9.26), "9.3 s");
        assert_eq!(duration(127.0), "2:07 min");
        assert_eq!(duration(3727.4), "1:02:07 h");
        assert_eq!(percent(0.0123), "1.23 %");
        assert_eq!(percent(f64::INFINITY), "?");
    }

    #[test]
    fn control_characters_are_written_out() {
        assert_eq!(harmless("a\tb\nc"), "a\tb\nc");
        let text = "red \u{1b}[31m, C1 \u{9b}1m, bell \u{7}, return \r";
        assert_eq!(harmless(text), "red \\u{1b}[31m, C1 \\u{9b}1m, bell \\u{7}, return \\r");
    }
}
