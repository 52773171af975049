//! Errors are what they claim: renders with different seeds scatter as each of them says that it may be wrong.

use super::support::*;
use crate::adapter;
use abbe::film::Film;
use abbe::integrator::{GpuIntegrator, Techniques};
use abbe::render::{Batch, Integrator, Rendering, Stop, render_blocks};
use abbe::scene::{LoadOptions, Scene, load};
use serde_json::json;
use std::ops::ControlFlow;

const RUNS: u64 = 12;
/// Batches of a run, and Student's t with 15 degrees of freedom at 95 %.
const BATCHES: u32 = 16;
const T_95: f64 = 2.1314;
const SIZE: u32 = 40;
const FALSE_ALARMS: f64 = 1e-3;

fn diffuse() -> Scene {
    scene_of(json!({
        "film": {"width": SIZE, "height": SIZE},
        "shapes": [{"disc": {"center": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.4}, "emission": {"radiance": 5}}],
    }))
}

/// Light that a mirrored ring throws on the floor: almost all of it is found by light paths.
fn caustic() -> Scene {
    let options = LoadOptions { width: Some(SIZE), height: Some(SIZE), ..LoadOptions::default() };
    load(&project().join("scenes/compare/nephroid.json"), &options).unwrap()
}

fn integrator(scene: &Scene, run: u64) -> GpuIntegrator {
    adapter::integrator(scene, 100 + run).unwrap()
}

/// Least and greatest count of `trials` of this probability that occur but for [`FALSE_ALARMS`].
fn bounds(trials: u32, probability: f64) -> (u32, u32) {
    let (mut term, mut below) = ((1.0 - probability).powi(trials as i32), 0.0);
    let (mut least, mut greatest) = (0, trials);
    for k in 0..=trials {
        below += term;
        if below < 0.5 * FALSE_ALARMS {
            least = k + 1;
        }
        if below > 1.0 - 0.5 * FALSE_ALARMS {
            greatest = k;
            break;
        }
        term *= f64::from(trials - k) / f64::from(k + 1) * probability / (1.0 - probability);
    }
    (least, greatest)
}

/// Of all runs and places, how many values lie outside their interval of 95 % around the mean of the other runs, whose own error widens it.
/// `at` gives a place's value and standard error in a run.
fn outside(places: usize, at: impl Fn(usize, usize) -> (f64, f64)) -> (u32, u32) {
    let runs = RUNS as usize;
    let mut outside = 0;
    for place in 0..places {
        let sum: f64 = (0..runs).map(|run| at(run, place).0).sum();
        for run in 0..runs {
            let (value, error) = at(run, place);
            let others = (sum - value) / (runs as f64 - 1.0);
            outside += u32::from((value - others).abs() > T_95 * error * (1.0 + 1.0 / (runs as f64 - 1.0)).sqrt());
        }
    }
    (outside, (places * runs) as u32)
}

/// Luminance of blocks of 8 x 8 pixels: enough samples for normal errors, so that the interval must hold exactly as often as it says.
fn blocks_keep_their_intervals(scene: &Scene, spp: u32) {
    let run = |run| render_blocks(&mut integrator(scene, run), &scene.film, 8, BATCHES, spp).unwrap();
    let films: Vec<Film> = (0..RUNS).map(run).collect();
    let y = films[0].bins() + 1;
    let (outside, trials) =
        outside(films[0].pixels(), |run, block| (films[run].pixel(block)[y], films[run].standard_error(block, y)));
    let (least, greatest) = bounds(trials, 0.05);
    println!("{}: {outside} of {trials} outside, {least} to {greatest} expected", scene.name);
    assert!((least..=greatest).contains(&outside), "{outside} of {trials} outside an interval of 95 %");
}

#[test]
fn intervals_of_diffuse_light_hold_as_often_as_they_claim() {
    blocks_keep_their_intervals(&diffuse(), 2);
}

#[test]
#[ignore = "long: in tools/soak"]
fn intervals_of_a_caustic_hold_as_often_as_they_claim() {
    blocks_keep_their_intervals(&caustic(), 4);
}

#[test]
fn a_young_caustic_knows_its_error() {
    let scene = caustic();
    let run = |run, spp| {
        let mut rendering = Rendering::new(Film::new(&scene.film));
        let stop = Stop { spp: Some(spp), ..Stop::default() };
        rendering.render(&mut integrator(&scene, run), &stop, &mut |_, _| ControlFlow::Continue(())).unwrap();
        rendering.film
    };
    let films: Vec<Film> = (0..RUNS).map(|i| run(i, BATCHES)).collect();
    let reference = run(RUNS, 24 * BATCHES);
    let (pixels, y) = (reference.pixels(), reference.bins() + 1);
    let errors: Vec<_> = films.iter().map(|film| film.errors(y)).collect();

    let floor = 0.01 * reference.mean_of(y).powi(2);
    let (mut truth, mut own) = (0.0, 0.0);
    for p in 0..pixels {
        let (exact, error) = (reference.pixel(p)[y], reference.standard_error(p, y));
        for film in &films {
            truth += ((film.pixel(p)[y] - exact).powi(2) - error.powi(2)) / (exact.powi(2) + floor);
            own += film.standard_error(p, y).powi(2) / (film.pixel(p)[y].powi(2) + floor);
        }
    }
    let [truth, own] = [truth, own].map(|sum| (sum / (RUNS as usize * pixels) as f64).sqrt());
    let estimated = films.iter().map(Film::relative_error).sum::<f64>() / RUNS as f64;
    let (outside, trials) = outside(pixels, |run, p| (films[run].pixel(p)[y], errors[run].standard_error(p)));
    let share = f64::from(outside) / f64::from(trials);
    println!("error {truth:.4}, estimated {estimated:.4}, by pixels alone {own:.4}; {share:.3} outside 95 %");
    // A few bright dots rule the error of such renders, so that it is known to about a sixth.
    assert!((estimated / truth - 1.0).abs() < 0.3, "estimated {estimated}, true {truth}");
    assert!((estimated - truth).abs() < (own - truth).abs(), "estimated {estimated}, by pixels alone {own}, true {truth}");
    // Of single pixels with 16 samples the errors are not normal; from their own batches alone it is 0.10.
    assert!(share < 0.085, "{share} outside an interval of 95 %");
}

#[test]
fn batches_of_a_render_make_up_for_each_other() {
    let scene = diffuse();
    let even = Techniques { adaptive_sampling: false, ..Techniques::default() };
    // Luminances, and what the film says of their squared errors.
    let run = |seed: u64, batch: fn(u32) -> Batch| -> (Vec<f64>, Vec<f64>) {
        let mut integrator = adapter::with(&scene, seed, even).unwrap();
        let mut film = Film::new(&scene.film);
        for i in 0..BATCHES {
            integrator.render_batch(batch(i), &mut film).unwrap();
        }
        let y = film.bins() + 1;
        (0..film.pixels()).map(|p| (film.pixel(p)[y], film.standard_error(p, y).powi(2))).unzip()
    };
    // Sums over pixels of the variance over runs, and of what films say.
    let variances = |batch: fn(u32) -> Batch| -> (f64, f64) {
        let runs: Vec<_> = (0..RUNS).map(|seed| run(seed, batch)).collect();
        let n = RUNS as f64;
        let of_pixel = |p: usize| {
            let mean = runs.iter().map(|(y, _)| y[p]).sum::<f64>() / n;
            runs.iter().map(|(y, _)| (y[p] - mean).powi(2)).sum::<f64>() / (n - 1.0)
        };
        let said = runs.iter().map(|(_, said)| said.iter().sum::<f64>()).sum::<f64>() / n;
        ((0..runs[0].0.len()).map(of_pixel).sum(), said)
    };
    let (together, said) = variances(|i| Batch::nth(i, (SIZE * SIZE) as usize));
    let (apart, said_apart) = variances(|i| Batch::even(i, 1));
    println!("variance {together:.3e}, said to be {said:.3e}; of independent batches {apart:.3e}, said to be {said_apart:.3e}");
    assert!(together < 0.7 * apart, "{together:.3e} against {apart:.3e}");
    // Errors are overstated, and never understated.
    assert!((said_apart / apart - 1.0).abs() < 0.1, "{said_apart:.3e} for {apart:.3e}");
    assert!(said > together, "{said:.3e} for {together:.3e}");
}
