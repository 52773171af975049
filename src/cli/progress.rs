//! The progress bar on standard error; it hides where that is not a terminal.

use super::print::{duration, percent, si};
use crate::render::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Steps of the bar: it shows a share of the work, whatever ends it.
const STEPS: u64 = 1000;

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
