//! The picture while it is rendered: the file that will have it at the end is kept up to date.

use super::checkpoint::{Interval, interval};
use super::print::note;
use crate::develop::picture::{Exposure, PictureSettings};
use crate::error::Result;
use crate::film::Film;
use crate::output::picture::Precision;
use crate::output::write_picture;
use crate::render::{Checkpointable, Progress};
use crate::spectrum::library::Observer;
use std::path::Path;
use std::time::{Duration, Instant};

/// Pictures take this part of the time at most.
const SHARE: u32 = 50;

/// When previews are asked for.
#[derive(clap::Args, Clone)]
pub struct PreviewArgs {
    /// Keep the picture up to date this often while rendering, from the first batch on, if it takes longer than that. 'off': there is one at the end only
    #[arg(long, value_name = "TIME", value_parser = interval, default_value = "10s")]
    preview: Interval,
}

/// Writes the previews of one render.
pub struct Preview<'a> {
    png: &'a Path,
    interval: Duration,
    settings: PictureSettings,
    /// When the last one was written, and how long that took.
    last: Option<(Instant, Duration)>,
}

impl<'a> Preview<'a> {
    /// Into this file, if there is to be any.
    pub fn new(png: Option<&'a Path>, args: &PreviewArgs, settings: PictureSettings) -> Option<Self> {
        match (png, args.preview) {
            (Some(png), Interval::Every(interval)) => Some(Preview { png, interval, settings, last: None }),
            _ => None,
        }
    }

    /// After every batch. False if no more can be written: it is said why.
    pub fn after_batch(&mut self, state: &mut Checkpointable<'_>, p: &Progress) -> bool {
        let is_due = match self.last {
            None => p.remaining.is_none_or(|left| left >= self.interval),
            Some((at, took)) => at.elapsed() >= self.interval.max(SHARE * took),
        };
        if !is_due {
            return true;
        }
        let begun = Instant::now();
        let written = self.write(&state.settled().0.film);
        self.last = Some((Instant::now(), begun.elapsed()));
        written.map_err(|e| note(&format!("warning: no more previews: {e}"))).is_ok()
    }

    fn write(&self, film: &Film) -> Result<()> {
        let settings = film.settings();
        let xyz = film.xyz_image();
        let exposure = settings.exposure.map(Exposure::Stops).or(self.settings.exposure).unwrap_or_default();
        let development = self.settings.development(exposure.of(&xyz, Observer::Cie1931));
        write_picture(self.png, &xyz, settings.pixel_bounds().width as usize, &development, Precision::default(), None)
    }
}
