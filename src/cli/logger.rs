//! Warnings and errors of the libraries beneath, wgpu's and naga's above all, on standard error.

use super::print;
use log::{Level, LevelFilter, Log, Metadata, Record};
use std::collections::BTreeSet;
use std::sync::Mutex;

/// Lines that are shown: what differs in a number only could go on without end.
const MOST: usize = 20;

/// Says each line once; which those were.
struct Once(Mutex<BTreeSet<String>>);

static LOGGER: Once = Once(Mutex::new(BTreeSet::new()));

impl Log for Once {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.level() <= Level::Warn
    }

    fn log(&self, record: &Record) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let text = record.args().to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        let line = format!("{}: {}: {text}", record.level().as_str().to_lowercase(), record.target());
        let Ok(mut said) = self.0.lock() else { return };
        if said.len() < MOST && said.insert(line.clone()) {
            print::note(&line);
        }
    }

    fn flush(&self) {}
}

/// From here on messages are shown.
pub fn install() {
    if log::set_logger(&LOGGER).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_and_errors_are_shown_once_and_nothing_less() {
        let logger = Once(Mutex::default());
        let log =
            |level, text: &str| logger.log(&Record::builder().level(level).target("wgpu").args(format_args!("{text}")).build());
        log(Level::Info, "an adapter");
        log(Level::Warn, "lost\n  twice");
        log(Level::Warn, "lost\n  twice");
        log(Level::Error, "gone");
        let said: Vec<String> = logger.0.lock().unwrap().iter().cloned().collect();
        assert_eq!(said, ["error: wgpu: gone", "warn: wgpu: lost twice"]);
        (0..100).for_each(|i| log(Level::Warn, &format!("number {i}")));
        assert_eq!(logger.0.lock().unwrap().len(), MOST);
    }
}
