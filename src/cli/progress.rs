//! Progress bars on standard error; they hide where that is not a terminal.

use super::print::{duration, percent, si};
use crate::render::Progress;
use crate::stage;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
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
        let left = p.remaining.map_or("?".to_string(), |left| duration(left.as_secs_f64()));
        self.0.set_position((p.fraction * STEPS as f64) as u64);
        self.0.set_message(format!(
            "{} spp, {}rays/s, error {}, {left} left",
            p.spp,
            si(p.rays_per_second),
            percent(p.relative_error)
        ));
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}
