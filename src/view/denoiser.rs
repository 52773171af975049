//! Pictures without noise, for pages that want them: made one after the other, beside the render, and as often as takes a fifth of the time at most.

use super::live::Published;
use super::picture::{Content, Picture};
use crate::denoise::denoised_xyz;
use crate::film::{Earlier, Film};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;
use tokio::sync::watch;
use tokio::time::Instant;

/// After a picture it rests for so many times what that took, unless another render has begun.
const REST: u32 = 4;

/// What a film was before, with at least a quarter and at most half of the samples that it has: one half of them for the denoiser.
#[derive(Debug, Default)]
pub struct Halves {
    half: Option<Arc<Earlier>>,
    next: Option<(u64, Arc<Earlier>)>,
}

impl Halves {
    /// Whether the film is to be kept as it is now, at `spp` samples per pixel: whenever they have doubled.
    pub fn is_due(&self, spp: u64) -> bool {
        self.next.as_ref().is_none_or(|(before, _)| spp >= 2 * before)
    }

    /// Keeps it.
    pub fn keep(&mut self, film: &Film, spp: u64) {
        let kept = Arc::new(film.keep_earlier());
        self.half = self.next.replace((spp, kept)).map(|(_, half)| half);
    }

    /// One half of the samples of the film as it is now; `None` before the second batch.
    pub fn half(&self) -> Option<Arc<Earlier>> {
        self.half.clone()
    }
}

/// Takes pictures that pages want without noise.
#[derive(Debug, Clone)]
pub struct Denoiser {
    wanted: Arc<watch::Sender<Option<Arc<Picture>>>>,
}

impl Denoiser {
    /// Begins to work, on `runtime`, for what is `published`.
    pub fn start(runtime: &Runtime, published: Arc<Published>) -> Self {
        let wanted = Arc::new(watch::Sender::new(None));
        runtime.spawn(denoise(wanted.subscribe(), published));
        Denoiser { wanted }
    }

    /// Takes a picture, in the place of one that it has not begun.
    pub fn want(&self, picture: &Arc<Picture>) {
        self.wanted.send_if_modified(|wanted| {
            let is_new = picture.can_be_denoised() && wanted.as_ref().is_none_or(|wanted| !Arc::ptr_eq(wanted, picture));
            if is_new {
                *wanted = Some(picture.clone());
            }
            is_new
        });
    }
}

/// One picture after the other, and of each render the first at once.
async fn denoise(mut wanted: watch::Receiver<Option<Arc<Picture>>>, published: Arc<Published>) {
    let Some(pool) = pool() else { return };
    let mut last: Option<Arc<Picture>> = None;
    let mut pace = Pace::default();
    loop {
        let next = wanted.borrow_and_update().clone().filter(|next| last.as_ref().is_none_or(|last| !Arc::ptr_eq(last, next)));
        let wait = next.as_ref().map(|next| pace.wait(next.render, Instant::now()));
        match (next, wait) {
            (Some(picture), Some(Duration::ZERO)) => {
                let (begun, pool) = (Instant::now(), pool.clone());
                last = Some(picture.clone());
                let work = tokio::task::spawn_blocking(move || pool.install(|| picture.denoise()));
                // What has failed once is not tried again.
                if work.await.is_err() {
                    return;
                }
                pace.rest(last.as_ref().map_or(0, |last| last.render), begun, Instant::now());
                if let Some(done) = last.clone().filter(|last| last.denoised.get().is_some()) {
                    published.denoised.send_replace(Some(done));
                }
            }
            (_, wait) => tokio::select! {
                () = tokio::time::sleep(wait.unwrap_or_default()), if wait.is_some() => {}
                changed = wanted.changed() => if changed.is_err() { return },
            },
        }
    }
}

/// When there may be a next one.
#[derive(Debug, Default)]
struct Pace(Option<(u64, Instant)>);

impl Pace {
    /// How long a picture of this render has to wait.
    fn wait(&self, render: u64, now: Instant) -> Duration {
        self.0.filter(|(last, _)| *last == render).map_or(Duration::ZERO, |(_, rested)| rested.saturating_duration_since(now))
    }

    /// One of this render was worked on, so long.
    fn rest(&mut self, render: u64, begun: Instant, now: Instant) {
        self.0 = Some((render, now + REST * (now - begun)));
    }
}

/// Its own threads: those that all share would be busy with it when the render and what is to be seen of it need them, and half of the cores are left.
fn pool() -> Option<Arc<ThreadPool>> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let pool = ThreadPoolBuilder::new().num_threads((cores / 2).max(1)).thread_name(|_| "denoiser".into()).build();
    pool.ok().map(Arc::new)
}

impl Picture {
    /// Whether it has what that takes.
    fn can_be_denoised(&self) -> bool {
        !self.is_preview && self.earlier.is_some() && self.aovs.is_some()
    }

    /// Works out what it is without noise.
    pub fn denoise(&self) {
        if let (Content::Film(film), Some(earlier), Some(aovs)) = (&self.content, &self.earlier, &self.aovs)
            && let Some(xyz) = denoised_xyz(film, earlier, aovs)
        {
            // Whoever was sooner has found the same.
            let _ = self.denoised.set(xyz);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bins, FilmSettings};

    #[test]
    fn a_fifth_of_the_time_is_spent_on_a_render_and_none_is_lost_to_the_next() {
        let (mut pace, begun) = (Pace::default(), Instant::now());
        let at = |ms: u64| begun + Duration::from_millis(ms);
        assert_eq!(pace.wait(7, at(0)), Duration::ZERO);
        pace.rest(7, at(0), at(100));
        assert_eq!(pace.wait(7, at(100)), Duration::from_millis(400));
        assert_eq!(pace.wait(7, at(500)), Duration::ZERO);
        assert_eq!(pace.wait(8, at(100)), Duration::ZERO);
    }

    #[test]
    fn a_half_has_between_a_quarter_and_half_of_the_samples() {
        let settings = FilmSettings::new(1, 1, Bins { count: 1, min_nm: 400.0, max_nm: 700.0 });
        let (mut film, mut halves) = (Film::new(&settings), Halves::default());
        for spp in 1..100_u32 {
            film.add_batch_f64(&[f64::from(spp); 4], 1);
            if halves.is_due(spp.into()) {
                halves.keep(&film, spp.into());
            }
            let half = halves.half();
            assert_eq!(half.is_some(), spp > 1);
            // The mean of 1, 2, ... to n is (n + 1) / 2, half the difference is -sqrt(w (W - w)) / 2.
            let Some(half) = half else { continue };
            let difference = film.half_difference_since(&half, 0)[1];
            let w = (1..spp).map(f64::from).find(|w| (difference + 0.5 * (w * (f64::from(spp) - w)).sqrt()).abs() < 1e-4);
            assert!(w.is_some_and(|w| (0.25..=0.5).contains(&(w / f64::from(spp)))), "{spp} {difference} {w:?}");
        }
    }
}
