//! The render loop: when it stops, and in what batches.

use abbe::film::Film;
use abbe::render::{Ended, Integrator, Progress, Stop, render};
use abbe::scene::{Bins, FilmSettings, Filter, WavelengthSampling};
use abbe::stats::BatchStats;
use abbe::{Error, Result};
use std::ops::ControlFlow;
use std::time::Duration;

fn film(width: u32) -> Film {
    let bins = Bins { min_nm: 380.0, max_nm: 780.0, count: 1 };
    Film::new(&FilmSettings {
        width,
        height: width,
        bins,
        filter: Filter::Box,
        sampling: WavelengthSampling::Continuous,
        exposure: None,
    })
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
    fn render_batch(&mut self, index: u32, spp: u32, film: &mut Film) -> Result<BatchStats> {
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

fn run(fake: &mut Fake, film: &mut Film, stop: Stop) -> abbe::render::Summary {
    render(fake, film, &stop, &mut |_, _| ControlFlow::Continue(())).unwrap()
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
fn batches_of_large_films_stay_short() {
    let stop = Stop { spp: Some(1 << 16), ..Stop::default() };
    assert_eq!(stop.batch_spp(512 * 512), 16);
    assert_eq!(stop.batch_spp(1 << 30), 1);
    let stop = Stop { time: Some(Duration::from_secs(1)), ..Stop::default() };
    assert_eq!([1, 1 << 19, 1 << 30].map(|pixels| stop.batch_spp(pixels)), [16, 8, 1]);
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

#[test]
fn the_observer_sees_every_batch_and_can_stop() {
    let (mut film, mut fractions) = (film(4), Vec::new());
    let summary = render(&mut Fake::default(), &mut film, &Stop { spp: Some(160), ..Stop::default() }, &mut |p: &Progress, _| {
        fractions.push(p.fraction);
        if fractions.len() == 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
    .unwrap();
    assert_eq!((summary.ended, film.batches(), film.samples_per_pixel()), (Ended::Interrupted, 4, 40));
    assert_eq!(fractions, [1.0, 2.0, 3.0, 4.0].map(|b| b / 16.0));
}

#[test]
fn a_failing_device_leaves_the_batches_before() {
    let mut film = film(4);
    let mut fake = Fake { fails_at: Some(3), ..Fake::default() };
    let failed = render(&mut fake, &mut film, &Stop::default(), &mut |_, _| ControlFlow::Continue(()));
    assert!(failed.is_err_and(|e| e.to_string().contains("the device is gone")));
    assert_eq!(film.batches(), 3);
}

#[test]
fn an_interrupted_render_is_what_was_done_before_and_nothing_is_an_error() {
    let (mut fake, mut done) = (Fake { fails_at: Some(3), interrupted: true, ..Fake::default() }, film(4));
    let summary = run(&mut fake, &mut done, Stop::default());
    assert_eq!((summary.ended, summary.batches, summary.progress.spp), (Ended::Interrupted, 3, 12));
    assert_eq!((done.batches(), summary.progress.stats.paths), (3, 12));
    let (mut fake, mut none) = (Fake { fails_at: Some(0), interrupted: true, ..Fake::default() }, film(4));
    let ended = render(&mut fake, &mut none, &Stop::default(), &mut |_, _| ControlFlow::Continue(()));
    assert!(matches!(ended, Err(Error::Interrupted)), "{ended:?}");
}
