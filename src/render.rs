//! The render loop: batches of samples from an integrator into the film until told to stop. One loop for the GPU and the
//! reference.

use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{Albedo, AovBuffers};
use crate::scene::FilmSettings;
use crate::stats::BatchStats;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Something that fills a film, batch by batch.
pub trait Integrator {
    /// Renders batch `index` with `spp` samples per pixel, in the mean over pixels, and adds it to `film` as one batch. Batches of different `index` use
    /// independent random numbers; the same seed and the same batches since the beginning give the same bits.
    ///
    /// # Errors
    /// [`Error::Fault`] if the device fails, [`Error::Interrupted`] if it was asked to stop. The film then holds the batch for those tiles that were done,
    /// whole, and for no others; no more batches can be rendered.
    fn render_batch(&mut self, index: u32, spp: u32, film: &mut Film) -> Result<BatchStats>;

    /// Has batches end early when `halt` is requested. One that pays no attention finishes its batch.
    fn heed(&mut self, _halt: &Halt) {}
}

/// Asks an integrator to stop, from any thread and for good.
#[derive(Debug, Clone, Default)]
pub struct Halt(Arc<AtomicBool>);

impl Halt {
    /// Stop as soon as may be.
    pub fn request(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether to stop.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// For a place where work can end.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if it is to stop.
    pub fn check(&self) -> Result<()> {
        if self.is_requested() { Err(Error::Interrupted) } else { Ok(()) }
    }
}

/// An integrator that also says what is seen first.
pub trait Renderer: Integrator {
    /// What the scene needed and what was found out about it, of several lines; all of it after the first batch.
    fn describe(&self) -> String;

    /// What `samples` rays of every pixel meet first, `albedos` being those of the scene's materials; `index` as in
    /// [`Integrator::render_batch`].
    fn aovs(&mut self, albedos: &[Albedo], index: u32, samples: u32) -> Result<AovBuffers>;
}

/// When to stop; whichever comes first. With nothing set: after [`Stop::DEFAULT_SPP`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stop {
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Time spent in the loop. It decides only when to stop, never what is computed.
    pub time: Option<Duration>,
    /// [`Film::relative_error`], once there are [`Stop::MIN_BATCHES`] batches to estimate it from.
    pub error: Option<f64>,
}

impl Stop {
    /// Samples per pixel where nothing else is asked for.
    pub const DEFAULT_SPP: u32 = 64;
    /// Batches that a standard error is trusted from.
    pub const MIN_BATCHES: u32 = 16;
    /// Samples of all pixels together in one batch, at most: a batch is what `time` and `error` wait for.
    const MAX_BATCH_SAMPLES: u64 = 1 << 22;

    /// The samples per pixel to stop at, if any.
    pub fn total_spp(&self) -> Option<u32> {
        match self {
            Stop { spp: None, time: None, error: None } => Some(Self::DEFAULT_SPP),
            _ => self.spp,
        }
    }

    /// Samples per pixel of one batch on a film of `pixels`; the last batch takes what remains of `spp`. It follows from the
    /// request and the resolution alone, never from the clock, so that the same command gives the same bits: a sixteenth of
    /// `spp`, or without `spp` a power of two up to 16.
    pub fn batch_spp(&self, pixels: usize) -> u32 {
        let most = Self::MAX_BATCH_SAMPLES / (pixels as u64).max(1);
        match self.total_spp() {
            Some(spp) => u64::from(spp / Self::MIN_BATCHES).min(most).max(1) as u32,
            None => 1 << most.clamp(1, 16).ilog2(),
        }
    }
}

/// How far a render is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Samples per pixel so far.
    pub spp: u64,
    /// Share of the work done, 0 to 1, as far as it can be told.
    pub fraction: f64,
    /// Counts so far.
    pub stats: BatchStats,
    /// Rays per second over the whole render.
    pub rays_per_second: f64,
    /// [`Film::relative_error`]; infinite before the second batch.
    pub relative_error: f64,
    /// Time since the start.
    pub elapsed: Duration,
    /// Time left, estimated; `None` before there is anything to estimate from.
    pub remaining: Option<Duration>,
}

/// Why a render ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// The samples asked for are done.
    Samples,
    /// The time is up.
    Time,
    /// The error asked for is reached.
    Error,
    /// The observer asked to stop, or a [`Halt`] did.
    Interrupted,
}

/// What a render came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// The state after the last batch.
    pub progress: Progress,
    /// Batches in the film.
    pub batches: u32,
    /// Why it ended.
    pub ended: Ended,
}

/// Renders batch after batch into `film` until `stop` says so or `observe`, called after every batch, breaks. At least one batch
/// is rendered. When the integrator fails its error is returned, and the film holds the batches before; so it does when the integrator is interrupted, which
/// is an error only before the first batch is done.
pub fn render(
    integrator: &mut dyn Integrator,
    film: &mut Film,
    stop: &Stop,
    observe: &mut dyn FnMut(&Progress, &Film) -> ControlFlow<()>,
) -> Result<Summary> {
    let start = Instant::now();
    let batch_spp = stop.batch_spp(film.pixels());
    let total = stop.total_spp().map(|spp| spp.max(1));
    let (mut spp, mut batches, mut stats) = (0u32, 0u32, BatchStats::default());
    let mut last = None;
    loop {
        // One sequence of batches never outgrows u32: the film's counts and the random numbers' keys end there.
        let now = batch_spp.min(total.unwrap_or(u32::MAX) - spp);
        stats += match (integrator.render_batch(batches, now, film), last) {
            (Err(Error::Interrupted), Some(progress)) => return Ok(Summary { progress, batches, ended: Ended::Interrupted }),
            (rendered, _) => rendered?,
        };
        spp += now;
        batches += 1;

        let elapsed = start.elapsed();
        let relative_error = film.relative_error();
        let by_samples = total.map_or(0.0, |total| f64::from(spp) / f64::from(total));
        let by_time = stop.time.map_or(0.0, |time| elapsed.as_secs_f64() / time.as_secs_f64().max(1e-9));
        let by_error = stop.error.map_or(0.0, |target| {
            // Errors fall as the root of the samples.
            (target / relative_error).powi(2).min(f64::from(batches) / f64::from(Stop::MIN_BATCHES))
        });
        // Half a batch of foresight: the mean overrun of a time limit is then nil.
        let time_is_up = stop.time.is_some_and(|time| elapsed + elapsed / (2 * batches) >= time);
        let error_is_reached = batches >= Stop::MIN_BATCHES && stop.error.is_some_and(|target| relative_error <= target);
        let mut ended = if by_samples >= 1.0 || spp == u32::MAX {
            Some(Ended::Samples)
        } else if error_is_reached {
            Some(Ended::Error)
        } else if time_is_up {
            Some(Ended::Time)
        } else {
            None
        };
        let fraction = if ended.is_some() { 1.0 } else { by_samples.max(by_time).max(by_error).clamp(0.0, 1.0) };
        let seconds = elapsed.as_secs_f64();
        let progress = Progress {
            spp: u64::from(spp),
            fraction,
            stats,
            rays_per_second: stats.rays as f64 / seconds.max(1e-9),
            relative_error,
            elapsed,
            remaining: (fraction > 0.0).then(|| Duration::try_from_secs_f64(seconds * (1.0 / fraction - 1.0)).ok()).flatten(),
        };
        last = Some(progress);
        if observe(&progress, film).is_break() && ended.is_none() {
            ended = Some(Ended::Interrupted);
        }
        if let Some(ended) = ended {
            return Ok(Summary { progress, batches, ended });
        }
    }
}

/// Renders `batches` batches of `spp` samples and returns a film whose pixels are the means over blocks of `size` x `size`
/// pixels. Its standard errors are those of the block means, correlations between the pixels of a batch included; `size` of the
/// whole film gives the error of its mean.
pub fn render_blocks(
    integrator: &mut dyn Integrator,
    settings: &FilmSettings,
    size: u32,
    batches: u32,
    spp: u32,
) -> Result<Film> {
    let mut blocks = Film::new(&Film::block_settings(settings, size));
    for index in 0..batches {
        let mut batch = Film::new(settings);
        integrator.render_batch(index, spp, &mut batch)?;
        let sums: Vec<f64> = batch.block_means(size).iter().map(|mean| mean * f64::from(spp)).collect();
        blocks.add_batch_f64(&sums, spp);
    }
    Ok(blocks)
}
