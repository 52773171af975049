//! Progress on standard error: bars on a terminal, lines elsewhere.

use super::print::{duration, note, percent, si};
use crate::render::Progress;
use crate::stage;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::cell::Cell;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Steps of the bar: it shows a share of the work, whatever ends it.
const STEPS: u64 = 1000;

/// Set-up that takes no longer than this shows nothing, and how often what it shows is looked at.
const PATIENCE: Duration = Duration::from_secs(1);
const GLANCE: Duration = Duration::from_millis(100);

/// The bar of loading and set-up, stage by stage; gone when this is dropped.
pub struct Stages {
    bar: ProgressBar,
    watch: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Stages {
    /// A bar, once there was something to wait for, or none at all if `hidden`.
    pub fn show(hidden: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(stage::NAMES.len() as u64), ProgressDrawTarget::hidden());
        if hidden {
            return Stages { bar, watch: None };
        }
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}, {elapsed}") {
            bar.set_style(style.progress_chars("=> "));
        }
        let (stop, stopped) = channel();
        let shown = bar.clone();
        let watch = std::thread::spawn(move || {
            let goes_on = |wait| stopped.recv_timeout(wait) == Err(RecvTimeoutError::Timeout);
            if !goes_on(PATIENCE) {
                return;
            }
            shown.set_draw_target(ProgressDrawTarget::stderr());
            loop {
                shown.set_position(stage::now() as u64);
                shown.set_message(stage::NAMES[stage::now()]);
                shown.tick();
                if !goes_on(GLANCE) {
                    return;
                }
            }
        });
        Stages { bar, watch: Some((stop, watch)) }
    }

    /// Has something else written to the terminal.
    pub fn aside(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        if let Some((stop, watch)) = self.watch.take() {
            drop(stop);
            // It only draws.
            let _ = watch.join();
            self.bar.finish_and_clear();
        }
    }
}

fn line(p: &Progress) -> String {
    let left = p.remaining.map_or("?".to_string(), |left| duration(left.as_secs_f64()));
    format!("{} spp, {}rays/s, error {}, {left} left", p.spp, si(p.rays_per_second), percent(p.relative_error))
}

/// The bar of one render.
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar, or none at all if `hidden`.
    pub fn new(hidden: bool) -> Self {
        let target = if hidden { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message("first batch");
        Bar(bar)
    }

    /// Shows the state.
    pub fn update(&self, p: &Progress) {
        self.0.set_position((p.fraction * STEPS as f64) as u64);
        self.0.set_message(line(p));
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// How long a log says nothing new.
const PERIOD: Duration = Duration::from_secs(10);

/// Lines about one render, for where no bar can be drawn: what is planned, then the state after the first batch and every ten seconds.
pub struct Log {
    state: Arc<Mutex<String>>,
    write: Box<dyn Fn(&str)>,
    begun: Cell<bool>,
    writer: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Log {
    /// Says what is planned.
    pub fn start(plan: &str) -> Self {
        Self::every(PERIOD, note, plan)
    }

    fn every(period: Duration, write: impl Fn(&str) + Clone + Send + 'static, plan: &str) -> Self {
        write(plan.trim_end());
        let state = Arc::new(Mutex::new("first batch".to_string()));
        let (stop, stopped) = channel();
        let (said, timed) = (Arc::clone(&state), write.clone());
        // A thread, since a batch may take longer than that.
        let writer = std::thread::spawn(move || {
            while stopped.recv_timeout(period) == Err(RecvTimeoutError::Timeout) {
                timed(&said.lock().unwrap_or_else(PoisonError::into_inner));
            }
        });
        Log { state, write: Box::new(write), begun: Cell::new(false), writer: Some((stop, writer)) }
    }

    /// Takes note of the state.
    pub fn update(&self, p: &Progress) {
        let line = line(p);
        if !self.begun.replace(true) {
            (self.write)(&line);
        }
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = line;
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        if let Some((stop, writer)) = self.writer.take() {
            drop(stop);
            // It only writes lines.
            let _ = writer.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::BatchStats;
    use std::sync::mpsc::Receiver;

    fn next(lines: &Receiver<String>) -> String {
        lines.recv_timeout(Duration::from_secs(60)).expect("a line")
    }

    #[test]
    fn a_log_has_the_plan_then_the_first_batch_then_a_line_again_and_again() {
        let (sender, lines) = channel();
        let write = move |line: &str| sender.send(line.to_string()).unwrap();
        let log = Log::every(Duration::from_millis(20), write, "plan: a\n  b\n");
        assert_eq!(next(&lines), "plan: a\n  b");
        assert_eq!(next(&lines), "first batch", "a batch that takes long says nothing");
        let second = Duration::from_secs(1);
        let p = Progress {
            spp: 4,
            fraction: 0.25,
            stats: BatchStats::default(),
            rays_per_second: 2e6,
            relative_error: 0.5,
            elapsed: second,
            remaining: Some(3 * second),
        };
        log.update(&p);
        let state = "4 spp, 2.00 Mrays/s, error 50.00 %, 3.0 s left";
        let mut said: Vec<String> = (0..3).map(|_| next(&lines)).collect();
        said.retain(|line| line != "first batch");
        assert!(!said.is_empty() && said.iter().all(|line| line == state), "{said:?}");
        log.update(&Progress { spp: 8, ..p });
        while next(&lines) == state {}
        drop(log);
        assert!(lines.iter().all(|line| line.starts_with("8 spp")), "goes on with what it had");
    }
}
