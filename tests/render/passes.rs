//! The render loop: when it stops, and in what batches.

use abbe::film::Film;
use abbe::render::{Batch, Ended, Integrator, Progress, Rendering, Share, Stop};
use abbe::scene::{Bins, FilmSettings};
use abbe::stats::BatchStats;
use abbe::{Error, Result};
use std::ops::ControlFlow;
use std::time::Duration;

fn film(width: u32) -> Film {
    Film::new(&FilmSettings::new(width, width, Bins { min_nm: 380.0, max_nm: 780.0, count: 1 }))
}

/// Notes what it is asked for; odd batches are `noise` brighter than even ones; fails at batch `fails_at`.
#[derive(Default)]
struct Fake {
    batches: Vec<(u32, u32)>,
    noise: f64,
    pause: Duration,
    fails_at: Option<u32>,
    interrupted: bool,
}

impl Integrator for Fake {
    fn render_batch(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
        let Batch { index, spp, .. } = batch;
        if self.fails_at == Some(index) {
            return Err(if self.interrupted { Error::Interrupted } else { Error::device("the device is gone", "start again") });
        }
        self.batches.push((index, spp));
        std::thread::sleep(self.pause);
        let value = f64::from(spp) * (1.0 + self.noise * f64::from(index % 2));
        film.add_batch_f64(&vec![value; film.pixels() * film.channels()], spp);
        Ok(BatchStats { paths: u64::from(spp), rays: 3 * u64::from(spp), ..BatchStats::default() })
    }
}

fn render(fake: &mut Fake, film: &mut Film, stop: &Stop) -> Result<abbe::render::Summary> {
    let mut rendering = Rendering::new(film.clone());
    let summary = rendering.render(fake, stop, &mut |_, _| ControlFlow::Continue(()));
    *film = rendering.film;
    summary
}

fn run(fake: &mut Fake, film: &mut Film, stop: Stop) -> abbe::render::Summary {
    render(fake, film, &stop).unwrap()
}

#[test]
fn samples_come_out_exactly_in_sixteen_batches_or_more() {
    for spp in [1, 2, 15, 16, 17, 31, 64, 100, 1000] {
        let (mut fake, mut film) = (Fake::default(), film(4));
        let summary = run(&mut fake, &mut film, Stop { spp: Some(spp), ..Stop::default() });
        assert_eq!(film.samples_per_pixel(), u64::from(spp));
        assert_eq!(summary.progress.spp, u64::from(spp));
        assert_eq!(summary.ended, Ended::Samples);
        assert!(film.batches() >= spp.min(16), "{spp} samples in {} batches", film.batches());
        let sizes: Vec<u32> = fake.batches.iter().map(|b| b.1).collect();
        let longer: Vec<u32> = (0..film.batches()).map(|i| Batch::nth(i, 16).spp).collect();
        assert_eq!(sizes[..sizes.len() - 1], longer[..sizes.len() - 1], "the sequence depends on what is asked for");
        let indices: Vec<u32> = fake.batches.iter().map(|b| b.0).collect();
        assert_eq!(indices, (0..film.batches()).collect::<Vec<_>>());
        assert_eq!(summary.progress.stats.rays, 3 * u64::from(spp));
        assert_eq!(summary.progress.fraction, 1.0);
    }
}

#[test]
fn without_a_wish_there_are_64_samples() {
    let mut film = film(4);
    run(&mut Fake::default(), &mut film, Stop::default());
    assert_eq!(film.samples_per_pixel(), 64);
}

#[test]
fn the_clock_stops_the_render() {
    let mut fake = Fake { pause: Duration::from_millis(5), ..Fake::default() };
    let mut film = film(4);
    let summary = run(&mut fake, &mut film, Stop { time: Some(Duration::from_millis(60)), ..Stop::default() });
    assert_eq!(summary.ended, Ended::Time);
    assert!(summary.batches >= 1 && summary.progress.elapsed < Duration::from_secs(10));
}

#[test]
fn the_error_stops_the_render_but_never_before_sixteen_batches() {
    let mut film1 = film(4);
    let summary = run(&mut Fake::default(), &mut film1, Stop { error: Some(0.5), ..Stop::default() });
    assert_eq!((summary.ended, summary.batches), (Ended::Error, 16));

    // Batches of 1 and 1.2: s^2 is near 0.01, so sigma / mean falls below 1 % at n near (0.1 / 0.011)^2 = 83.
    let mut film2 = film(4);
    let mut fake = Fake { noise: 0.2, ..Fake::default() };
    let summary = run(&mut fake, &mut film2, Stop { error: Some(0.01), ..Stop::default() });
    assert_eq!(summary.ended, Ended::Error);
    assert!((75..95).contains(&summary.batches), "{} batches", summary.batches);
    assert!(summary.progress.relative_error <= 0.01);
}

/// The error is looked at after every fourth batch of so many.
#[test]
fn a_render_that_is_gone_on_with_ends_by_its_error_where_it_would_have() {
    let stop = Stop { error: Some(0.01), ..Stop::default() };
    let noisy = || Fake { noise: 0.2, ..Fake::default() };
    let whole = run(&mut noisy(), &mut film(4), stop).batches;
    assert!(whole.is_multiple_of(4), "{whole} batches");
    for pause in [whole - 5, whole - 1] {
        let (mut fake, mut rendering) = (noisy(), Rendering::new(film(4)));
        let observe = &mut |_: &Progress, _: &mut abbe::render::Checkpointable<'_>| ControlFlow::Break(());
        while rendering.batches < pause {
            rendering.render(&mut fake, &stop, observe).unwrap();
        }
        let summary = rendering.render(&mut fake, &stop, &mut |_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!((summary.ended, summary.batches), (Ended::Error, whole), "gone on with from {pause}");
    }
}

#[test]
fn the_observer_sees_every_batch_and_can_stop() {
    let (mut rendering, mut fractions) = (Rendering::new(film(4)), Vec::new());
    let observe = &mut |p: &Progress, _: &mut abbe::render::Checkpointable<'_>| {
        fractions.push(p.fraction);
        if fractions.len() == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let summary = rendering.render(&mut Fake::default(), &Stop { spp: Some(160), ..Stop::default() }, observe).unwrap();
    assert_eq!((summary.ended, rendering.film.batches(), rendering.film.samples_per_pixel()), (Ended::Interrupted, 4, 4));
    assert_eq!(fractions, [1.0, 2.0, 3.0, 4.0].map(|b| b / 160.0));
}

#[test]
fn shares_have_every_batch_once_and_are_as_long() {
    let stop = Stop { spp: Some(100), ..Stop::default() };
    let mut whole = Fake::default();
    run(&mut whole, &mut film(4), stop);
    for of in [1, 2, 3, 8, 100] {
        let mut batches = Vec::new();
        for number in 0..of {
            let (mut fake, mut share) = (Fake::default(), Rendering::of_share(film(4), Share { number, of }));
            let summary = share.render(&mut fake, &stop, &mut |_, _| ControlFlow::Continue(())).unwrap();
            assert_eq!((summary.ended, summary.progress.fraction), (Ended::Samples, 1.0));
            assert_eq!(share.spp, fake.batches.iter().map(|b| u64::from(b.1)).sum::<u64>());
            batches.extend(fake.batches);
        }
        batches.sort();
        assert_eq!(batches, whole.batches, "{of} shares");
    }
}

#[test]
fn a_render_goes_on_after_its_end_without_a_batch_twice() {
    let (mut fake, mut rendering) = (Fake::default(), Rendering::new(film(4)));
    for spp in [16, 16, 64, 208] {
        rendering.render(&mut fake, &Stop { spp: Some(spp), ..Stop::default() }, &mut |_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(rendering.film.samples_per_pixel(), u64::from(spp));
    }
    let (mut whole, mut all) = (Fake::default(), film(4));
    run(&mut whole, &mut all, Stop { spp: Some(208), ..Stop::default() });
    assert_eq!(fake.batches, whole.batches);
    assert_eq!(rendering.film.pixel(3), all.pixel(3));
}

#[test]
fn a_failing_device_leaves_the_batches_before() {
    let mut film = film(4);
    let mut fake = Fake { fails_at: Some(3), ..Fake::default() };
    let failed = render(&mut fake, &mut film, &Stop::default());
    assert!(failed.is_err_and(|e| e.to_string().contains("the device is gone")));
    assert_eq!(film.batches(), 3);
}

#[test]
fn an_interrupted_render_is_what_was_done_before_and_nothing_is_an_error() {
    let (mut fake, mut done) = (Fake { fails_at: Some(3), interrupted: true, ..Fake::default() }, film(4));
    let summary = run(&mut fake, &mut done, Stop::default());
    assert_eq!((summary.ended, summary.batches, summary.progress.spp), (Ended::Interrupted, 3, 3));
    assert_eq!((done.batches(), summary.progress.stats.paths), (3, 3));
    let (mut fake, mut none) = (Fake { fails_at: Some(0), interrupted: true, ..Fake::default() }, film(4));
    let ended = render(&mut fake, &mut none, &Stop::default());
    assert!(matches!(ended, Err(Error::Interrupted)), "{ended:?}");
}
