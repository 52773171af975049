//! The render loop: batches of samples from an integrator into the film until told to stop. One loop for the GPU and the
//! reference.

mod batch;

pub use batch::Batch;

use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{Albedo, AovBuffers};
use crate::scene::FilmSettings;
use crate::state::{Persistent, State, invalid};
use crate::stats::{BatchStats, persist_time};
use std::io;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Something that fills a film, batch by batch.
pub trait Integrator {
    /// Renders a batch and adds it to `film`; returns what was counted. Passes of different sequences use independent random numbers; the same seed and the
    /// same batches since the beginning give the same bits. A batch that was begun before and not done is gone on with.
    ///
    /// # Errors
    /// [`Error::Fault`] or [`Error::OutOfMemory`] if the device fails, [`Error::Interrupted`] if it was asked to stop. The film then holds the batch for those tiles that were done,
    /// whole, and for no others; no more batches can be rendered by this integrator, but by one that takes over its state.
    fn render_batch(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats>;

    /// Likewise, but what the batch came to may be in `film` only with the next one, or with [`Integrator::settle`]: the device need not wait for the host. It
    /// is in safety all the same: what fails later does not take it along.
    ///
    /// # Errors
    /// As [`Integrator::render_batch`].
    fn render_ahead(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
        self.render_batch(batch, film)
    }

    /// Brings what batches rendered ahead came to into `film`; returns what was counted only now.
    fn settle(&mut self, _film: &mut Film) -> BatchStats {
        BatchStats::default()
    }

    /// Saves or restores all that the batches so far have left behind in it, so that those to come give the same bits.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    fn persist(&mut self, _state: &mut State<'_>) -> io::Result<()> {
        Ok(())
    }

    /// Has batches end early when `halt` is requested. One that pays no attention finishes its batch.
    fn heed(&mut self, _halt: &Halt) {}

    /// Likewise at `time`, if one is given.
    fn end_by(&mut self, _time: Option<Instant>) {}
}

/// Asks an integrator to stop, from any thread and for good.
#[derive(Debug, Clone, Default)]
pub struct Halt {
    requested: Arc<AtomicBool>,
    /// Stop then, too: known to this copy alone.
    time: Option<Instant>,
}

impl Halt {
    /// Stop as soon as may be.
    pub fn request(&self) {
        self.requested.store(true, Ordering::SeqCst);
    }

    /// Has whoever looks at this copy stop at `time`, too.
    pub fn end_by(&mut self, time: Option<Instant>) {
        self.time = time;
    }

    /// Whether to stop.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::SeqCst) || self.time.is_some_and(|time| Instant::now() >= time)
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

    /// How often the tiles that it renders in were halved, for want of memory.
    fn halvings(&self) -> u32 {
        0
    }

    /// What `samples` rays of every pixel meet first, and behind smooth glass and in mirrors, `albedos` being those of the scene's materials; `index` as in
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
    /// [`Film::relative_error`], once there are [`Stop::MIN_BATCHES`] batches to estimate it from; looked at after every batch at first, and later after
    /// every sixteenth of them, since the device waits for that.
    pub error: Option<f64>,
}

impl Stop {
    /// Samples per pixel where nothing else is asked for.
    pub const DEFAULT_SPP: u32 = 64;
    /// Batches that a standard error is trusted from.
    pub const MIN_BATCHES: u32 = batch::PER_SIZE;

    /// Whether the error is looked at after so many batches. It is up to them alone, so that a render that is gone on with ends as any other.
    fn looks_at_error(&self, batches: u32) -> bool {
        self.error.is_some() && batches >= Self::MIN_BATCHES && batches.is_multiple_of(1 << (batches / Self::MIN_BATCHES).ilog2())
    }

    /// How long rendering may take at most, if its time is limited: a batch that turns out to take longer is cut then, between tiles.
    fn latest(&self) -> Option<Duration> {
        self.time.map(|time| time.saturating_add(time / 8).saturating_add(Duration::from_millis(250)))
    }

    /// The samples per pixel to stop at, if any.
    pub fn total_spp(&self) -> Option<u32> {
        match self {
            Stop { spp: None, time: None, error: None } => Some(Self::DEFAULT_SPP),
            _ => self.spp,
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
    /// [`Film::relative_error`], as last looked at: at the end, where it may end the render, and else as often as takes little time. Infinite before the
    /// second batch.
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

/// A part of the batches: each machine of several takes its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Share {
    /// Its number, from 0.
    pub number: u32,
    /// How many there are.
    pub of: u32,
}

impl Share {
    /// All batches.
    pub const WHOLE: Share = Share { number: 0, of: 1 };
    /// Most shares of a render: more machines than batches have nothing to do.
    pub const MOST: u32 = 4096;

    /// Share `number`, from 0, of so many; `None` if there is no such share.
    pub fn new(number: u32, of: u32) -> Option<Self> {
        (number < of && of <= Self::MOST).then_some(Share { number, of })
    }
}

/// All that the batches so far have left behind, but for what the integrator has learned.
#[derive(Debug, Clone)]
pub struct Rendering {
    /// Their mean.
    pub film: Film,
    /// Which batches are rendered.
    pub share: Share,
    /// Number of the next batch.
    pub next: u32,
    /// Batches done.
    pub batches: u32,
    /// Samples per pixel done.
    pub spp: u64,
    /// What was counted.
    pub stats: BatchStats,
    /// Time spent in the loop.
    pub elapsed: Duration,
}

impl Rendering {
    /// Before the first batch.
    pub fn new(film: Film) -> Self {
        Self::of_share(film, Share::WHOLE)
    }

    /// Likewise, of a part of the batches.
    pub fn of_share(film: Film, share: Share) -> Self {
        let (batches, spp, stats, elapsed) = (0, 0, BatchStats::default(), Duration::ZERO);
        Rendering { film, share, next: share.number, batches, spp, stats, elapsed }
    }

    /// Renders batch after batch until `stop` says so or `observe`, called after every batch, breaks. At least one batch
    /// is rendered, unless `stop` is met from the beginning. When the integrator fails its error is returned, and the film holds the batches before; so it
    /// does when the integrator is interrupted, which is an error only before the first batch is done.
    ///
    /// # Errors
    /// Those of [`Integrator::render_batch`].
    pub fn render(
        &mut self,
        integrator: &mut dyn Integrator,
        stop: &Stop,
        observe: &mut dyn FnMut(&Progress, &mut Checkpointable<'_>) -> ControlFlow<()>,
    ) -> Result<Summary> {
        let (begun, before) = (Instant::now(), self.elapsed);
        let mut error = Estimate::of(&self.film);
        if let Some(ended) = self.ended(stop, error.value)
            && (self.batches > 0 || ended == Ended::Samples)
        {
            return Ok(Summary { progress: self.progress(stop, error.value, Some(ended)), batches: self.batches, ended });
        }
        let latest = stop.latest().and_then(|latest| begun.checked_add(latest.saturating_sub(before)));
        loop {
            // One sample, however long it takes.
            integrator.end_by(latest.filter(|_| self.batches > 0));
            let batch = self.next_batch(stop);
            let rendered = integrator.render_ahead(batch, &mut self.film);
            self.elapsed = before + begun.elapsed();
            match rendered {
                Ok(stats) => self.stats += stats,
                Err(failure) => {
                    self.settle(integrator);
                    return match failure {
                        Error::Interrupted if self.batches > 0 => {
                            let error = self.film.relative_error();
                            let is_late = stop.latest().is_some_and(|latest| self.elapsed >= latest);
                            let ended = if is_late { Ended::Time } else { Ended::Interrupted };
                            Ok(Summary { progress: self.progress(stop, error, None), batches: self.batches, ended })
                        }
                        failure => Err(failure),
                    };
                }
            }
            self.next += self.share.of;
            self.batches += 1;
            self.spp += u64::from(batch.spp);
            if stop.looks_at_error(self.batches) || error.is_due() || self.ended(stop, error.value).is_some() {
                self.settle(integrator);
                error = Estimate::of(&self.film);
                self.elapsed = before + begun.elapsed();
            }
            let mut ended = self.ended(stop, error.value);
            let mut progress = self.progress(stop, error.value, ended);
            let broken = observe(&progress, &mut Checkpointable { rendering: self, integrator }).is_break();
            if broken && ended.is_none() {
                ended = Some(Ended::Interrupted);
                self.settle(integrator);
                (progress.stats, progress.relative_error) = (self.stats, self.film.relative_error());
            }
            if let Some(ended) = ended {
                return Ok(Summary { progress, batches: self.batches, ended });
            }
        }
    }

    /// Has all batches in the film.
    fn settle(&mut self, integrator: &mut dyn Integrator) {
        self.stats += integrator.settle(&mut self.film);
    }

    /// The next batch; the last one takes what remains.
    fn next_batch(&self, stop: &Stop) -> Batch {
        let batch = Batch::nth(self.next, self.film.settings().pixels());
        let left = stop.total_spp().map_or(u64::MAX, |total| u64::from(total).saturating_sub(batch.first_pass));
        batch.up_to(left.max(1))
    }

    /// Samples per pixel of all batches before the next, whoever rendered them.
    fn passes(&self) -> u64 {
        Batch::nth(self.next, self.film.settings().pixels()).first_pass
    }

    fn ended(&self, stop: &Stop, relative_error: f64) -> Option<Ended> {
        // One sequence of batches never outgrows u32: the random numbers' keys end there, and the last ones are for other uses.
        let is_last = self.next > u32::MAX - (1 << 16);
        if is_last || stop.total_spp().is_some_and(|total| self.passes() >= u64::from(total.max(1))) {
            return Some(Ended::Samples);
        }
        let error_is_reached = stop.error.is_some_and(|target| relative_error <= target);
        if stop.looks_at_error(self.batches) && error_is_reached {
            return Some(Ended::Error);
        }
        // Half a batch of foresight: the mean overrun of a time limit is then nil.
        let next = f64::from(self.next_batch(stop).spp) / self.spp.max(1) as f64;
        let after = |share: f64| self.elapsed + self.elapsed.mul_f64(share * next);
        let is_late = stop.time.is_some_and(|time| after(0.5) >= time) || stop.latest().is_some_and(|latest| after(1.0) > latest);
        is_late.then_some(Ended::Time)
    }

    fn progress(&self, stop: &Stop, relative_error: f64, ended: Option<Ended>) -> Progress {
        let seconds = self.elapsed.as_secs_f64();
        let by_samples = stop.total_spp().map_or(0.0, |total| self.passes() as f64 / f64::from(total.max(1)));
        let by_time = stop.time.map_or(0.0, |time| seconds / time.as_secs_f64().max(1e-9));
        let by_error = stop.error.map_or(0.0, |target| {
            // Errors fall as the root of the samples.
            (target / relative_error).powi(2).min(f64::from(self.batches) / f64::from(Stop::MIN_BATCHES))
        });
        let fraction = if ended.is_some() { 1.0 } else { by_samples.max(by_time).max(by_error).clamp(0.0, 1.0) };
        Progress {
            spp: self.spp,
            fraction,
            stats: self.stats,
            rays_per_second: self.stats.rays as f64 / seconds.max(1e-9),
            relative_error,
            elapsed: self.elapsed,
            remaining: (fraction > 0.0).then(|| Duration::try_from_secs_f64(seconds * (1.0 / fraction - 1.0)).ok()).flatten(),
        }
    }
}

impl Persistent for Rendering {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let Rendering { film, share, next, batches, spp, stats, elapsed } = self;
        film.persist(state)?;
        state.value(&mut share.number)?;
        state.value(&mut share.of)?;
        state.value(next)?;
        state.value(batches)?;
        state.value(spp)?;
        stats.persist(state)?;
        persist_time(elapsed, state)?;
        // A file that was tampered with must not make sums overflow, or be gone on with for ever.
        let sums = [u64::from(*next), u64::from(*batches), *spp];
        if Share::new(share.number, share.of).is_none() || sums.into_iter().any(|n| n > u64::from(u32::MAX)) {
            return Err(invalid(format!("share {} of {}, {next} batches, {spp} samples", share.number, share.of)));
        }
        Ok(())
    }
}

/// [`Film::relative_error`] for who watches a render, which need not be of the last batch.
struct Estimate {
    value: f64,
    at: Instant,
    cost: Duration,
}

impl Estimate {
    fn of(film: &Film) -> Self {
        let begun = Instant::now();
        let (value, at) = (film.relative_error(), Instant::now());
        Estimate { value, at, cost: at - begun }
    }

    /// Whether a new one would take a fiftieth of the time since then, or less.
    fn is_due(&self) -> bool {
        self.at.elapsed() >= 50 * self.cost
    }
}

/// A render between two batches, or where it was interrupted: all that a checkpoint holds.
pub struct Checkpointable<'a> {
    rendering: &'a mut Rendering,
    integrator: &'a mut dyn Integrator,
}

impl<'a> Checkpointable<'a> {
    /// What it has come to, and what renders it.
    pub fn new(rendering: &'a mut Rendering, integrator: &'a mut dyn Integrator) -> Self {
        Checkpointable { rendering, integrator }
    }

    /// Both, all batches being in the film. While the render goes on, the device waits for that.
    pub fn settled(&mut self) -> (&mut Rendering, &mut dyn Integrator) {
        self.rendering.settle(self.integrator);
        (self.rendering, self.integrator)
    }
}

impl Persistent for Checkpointable<'_> {
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        let (rendering, integrator) = self.settled();
        rendering.persist(state)?;
        integrator.persist(state)
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
        integrator.render_batch(Batch::even(index, spp), &mut batch)?;
        let sums: Vec<f64> = batch.block_means(size).iter().map(|mean| mean * f64::from(spp)).collect();
        blocks.add_batch_f64(&sums, spp);
    }
    Ok(blocks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Bins;

    /// Its first batches are done at once, and one takes for ever.
    struct Endless {
        quick: u32,
        halt: Halt,
    }

    impl Integrator for Endless {
        fn render_batch(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
            if batch.index >= self.quick {
                loop {
                    self.halt.check()?;
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            film.add_batch_f64(&vec![1.0; film.pixels() * film.channels()], batch.spp);
            Ok(BatchStats::default())
        }

        fn end_by(&mut self, time: Option<Instant>) {
            self.halt.end_by(time);
        }
    }

    #[test]
    fn a_batch_that_takes_longer_than_there_is_time_is_cut() {
        let bins = Bins { count: 1, min_nm: 400.0, max_nm: 700.0 };
        let settings = FilmSettings::new(1, 1, bins);
        let mut rendering = Rendering::new(Film::new(&settings));
        let mut endless = Endless { quick: 3, halt: Halt::default() };
        let stop = Stop { time: Some(Duration::from_millis(200)), ..Stop::default() };
        let summary = rendering.render(&mut endless, &stop, &mut |_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!((summary.ended, summary.batches, summary.progress.spp), (Ended::Time, 3, 3));
        assert!(summary.progress.elapsed >= Duration::from_millis(200), "{:?}", summary.progress.elapsed);
        // A request ends it for another reason, and the first batch has no end but that.
        endless.halt.request();
        let mut rendering = Rendering::new(Film::new(&settings));
        let nothing = rendering.render(&mut Endless { quick: 0, ..endless }, &stop, &mut |_, _| ControlFlow::Continue(()));
        assert!(matches!(nothing, Err(Error::Interrupted)));
    }

    #[test]
    fn a_state_that_no_render_can_reach_is_an_error() {
        let bins = Bins { count: 1, min_nm: 400.0, max_nm: 700.0 };
        let settings = FilmSettings::new(1, 1, bins);
        let restored = |change: &dyn Fn(&mut Rendering)| {
            let mut rendering = Rendering::new(Film::new(&settings));
            change(&mut rendering);
            // As it may be written by a stranger: a save of ours refuses it in the same way.
            rendering.persist(&mut State::saving(&mut Vec::new()))
        };
        assert!(restored(&|_| {}).is_ok());
        let changes: [&dyn Fn(&mut Rendering); 6] = [
            &|r| r.share.of = 0,
            &|r| r.share = Share { number: u32::MAX, of: u32::MAX },
            &|r| r.share = Share { number: 3, of: 3 },
            &|r| r.spp = u64::MAX,
            &|r| r.stats.rays = u64::MAX,
            &|r| r.elapsed = Duration::MAX,
        ];
        for (i, change) in changes.into_iter().enumerate() {
            assert!(restored(change).is_err(), "change {i}");
        }
    }
}
