//! What tells whether two estimates of a film agree.

use abbe::compare::difference::threshold;
use abbe::film::Film;
use abbe::reference::ReferenceIntegrator;
use abbe::render::Integrator;
use abbe::scene::{Estimator, Scene};

/// Values of independent batches, one after another.
pub fn batches(scene: &Scene, estimator: Estimator, count: u32, spp: u32) -> Vec<Vec<f64>> {
    let mut integrator = ReferenceIntegrator::new(scene, estimator, 7).expect("a scene this estimator can see");
    let render = |i| {
        let mut film = Film::new(&scene.film);
        let stats = integrator.render_batch(abbe::render::Batch::even(i, spp), &mut film).expect("a batch");
        assert_eq!((stats.dropped_not_finite, stats.dropped_negative), (0, 0), "dropped samples");
        (0..film.pixels()).flat_map(|p| film.pixel(p).to_vec()).collect()
    };
    (0..count).map(render).collect()
}

/// Mean and standard error over batches of `value`.
pub fn estimate(batches: &[Vec<f64>], value: impl Fn(&[f64]) -> f64) -> (f64, f64) {
    let values: Vec<f64> = batches.iter().map(|b| value(b)).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Mean over the pixels of one channel.
pub fn image_mean(scene: &Scene, channel: usize) -> impl Fn(&[f64]) -> f64 {
    let channels = scene.film.bins.count as usize + 3;
    move |b| b.chunks(channels).map(|p| p[channel]).sum::<f64>() / (b.len() / channels) as f64
}

/// Both estimators agree in every channel of the whole film and of each of its quarters, and their errors are small enough for that to
/// mean something.
pub fn agree(name: &str, scene: &Scene, backward_spp: u32, forward_spp: u32) {
    const BATCHES: u32 = 24;
    let a = batches(scene, Estimator::Backward, BATCHES, backward_spp);
    let b = batches(scene, Estimator::Forward, BATCHES, forward_spp);
    let (width, height) = (scene.film.width as usize, scene.film.height as usize);
    let channels = scene.film.bins.count as usize + 3;
    let limit = threshold(5 * channels, f64::from(BATCHES - 1));
    for block in 0..5 {
        let inside = |p: &usize| block == 4 || (p % width * 2 / width, p / width * 2 / height) == (block % 2, block / 2);
        let pixels: Vec<usize> = (0..width * height).filter(inside).collect();
        for channel in 0..channels {
            let value = |film: &[f64]| pixels.iter().map(|p| film[p * channels + channel]).sum::<f64>() / pixels.len() as f64;
            let ((ma, sa), (mb, sb)) = (estimate(&a, value), estimate(&b, value));
            let error = sa.hypot(sb);
            let what = format!("{name}: block {block} channel {channel}: backward {ma} +- {sa}, forward {mb} +- {sb}");
            println!("{what}, z = {:.1}, error {:.2} %", (ma - mb).abs() / error, 100.0 * error / ma);
            assert!((ma - mb).abs() < limit * error, "{what}, limit {limit} standard errors");
            assert!(
                error < if block == 4 { 0.012 } else { 0.04 } * ma,
                "{what}: an error of {error} is too large to tell anything"
            );
        }
    }
}

/// The mean of every bin equals `exact`.
pub fn equals(name: &str, scene: &Scene, estimator: Estimator, spp: u32, exact: f64, floor: f64) {
    let films = batches(scene, estimator, 16, spp);
    let bins = scene.film.bins.count as usize;
    for bin in 0..bins {
        let (mean, error) = estimate(&films, image_mean(scene, bin));
        let off = (mean - exact).abs();
        println!("{name}: bin {bin}: {mean} +- {error}, exact {exact}");
        assert!(off <= floor * exact + threshold(bins, 15.0) * error, "{name}: bin {bin}: {mean} +- {error}, exact {exact}");
        assert!(error < 3e-3 * exact, "{name}: an error of {error} is too large to tell anything");
    }
}
