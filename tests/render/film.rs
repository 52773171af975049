//! The film's statistics against plain formulas and known distributions.

use crate::random::Random;
use abbe::film::{Film, Tile};
use abbe::scene::{Bins, FilmSettings};

fn settings(width: u32, height: u32, bins: u32) -> FilmSettings {
    FilmSettings::new(width, height, Bins { min_nm: 380.0, max_nm: 780.0, count: bins })
}

fn close(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() <= tolerance * b.abs().max(1e-300), "{what}: {a} is not {b}");
}

#[test]
fn mean_and_standard_error_are_the_textbook_ones() {
    let mut film = Film::new(&settings(3, 2, 2));
    let mut random = Random(1);
    let batches: Vec<Vec<f64>> =
        (0..20).map(|_| (0..film.pixels() * film.channels()).map(|_| 4.0 * random.next()).collect()).collect();
    for sums in &batches {
        film.add_batch_f64(sums, 4);
    }
    let n = batches.len() as f64;
    for pixel in 0..film.pixels() {
        for channel in 0..film.channels() {
            let x: Vec<f64> = batches.iter().map(|b| b[pixel * film.channels() + channel] / 4.0).collect();
            let mean = x.iter().sum::<f64>() / n;
            let s2 = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
            close(film.pixel(pixel)[channel], mean, 1e-12, "mean");
            // Kept in single precision: 20 sums, each rounded to a part in 2^24.
            close(film.standard_error(pixel, channel), (s2 / n).sqrt(), 20.0 * 0.5f64.powi(25), "standard error");
        }
    }
    assert_eq!((film.batches(), film.samples_per_pixel()), (20, 80));
}

#[test]
fn a_shorter_last_batch_counts_by_its_samples() {
    let mut film = Film::new(&settings(1, 1, 1));
    for (sum, spp) in [(8.0, 8), (24.0, 8), (14.0, 2)] {
        film.add_batch_f64(&[sum; 4], spp);
    }
    let (means, weights) = ([1.0, 3.0, 7.0], [8.0, 8.0, 2.0]);
    let mean = 46.0 / 18.0;
    let s: f64 = means.iter().zip(weights).map(|(x, w): (&f64, f64)| w * (x - mean) * (x - mean)).sum();
    close(film.bin(0, 0), mean, 1e-14, "mean");
    close(film.standard_error(0, 0), (s / (2.0 * 18.0)).sqrt(), 3.0 * 0.5f64.powi(25), "standard error");
}

#[test]
fn the_standard_error_is_the_spread_of_independent_films() {
    // Uniform samples: variance 1/12. Over many films the mean of sigma^2 is the variance of the mean, and the means scatter
    // accordingly.
    let mut film = Film::new(&settings(64, 64, 1));
    let mut random = Random(7);
    for _ in 0..16 {
        let sums: Vec<f64> = (0..film.pixels() * film.channels()).map(|_| (0..4).map(|_| random.next()).sum()).collect();
        film.add_batch_f64(&sums, 4);
    }
    let exact = 1.0 / 12.0 / 64.0;
    let n = film.pixels() as f64;
    let estimated = (0..film.pixels()).map(|p| film.standard_error(p, 0).powi(2)).sum::<f64>() / n;
    let scattered = (0..film.pixels()).map(|p| (film.bin(p, 0) - 0.5).powi(2)).sum::<f64>() / n;
    // Relative standard deviations: sqrt(2 / (15 n)) and sqrt(2 / n), each four times.
    close(estimated, exact, 4.0 * (2.0 / (15.0 * n)).sqrt(), "estimated variance of the mean");
    close(scattered, exact, 4.0 * (2.0 / n).sqrt(), "variance of the mean");
}

#[test]
fn tiles_fill_the_pixels_they_name() {
    let (mut whole, mut tiled) = (Film::new(&settings(5, 3, 1)), Film::new(&settings(5, 3, 1)));
    let values: Vec<f32> = (0..5 * 3 * 4).map(|v| v as f32).collect();
    whole.add_batch(Tile { x: 0, y: 0, width: 5, height: 3 }, &values, 2);
    for (x, width) in [(0u32, 2u32), (2, 3)] {
        for (y, height) in [(0u32, 1u32), (1, 2)] {
            let pixels = (y..y + height).flat_map(|row| (x..x + width).map(move |column| (row * 5 + column) as usize));
            let sums: Vec<f32> = pixels.flat_map(|p| values[p * 4..p * 4 + 4].to_vec()).collect();
            tiled.add_batch(Tile { x, y, width, height }, &sums, 2);
        }
    }
    for pixel in 0..whole.pixels() {
        assert_eq!(whole.pixel(pixel), tiled.pixel(pixel));
        assert_eq!(whole.bin(pixel, 0), f64::from(values[pixel * 4]) / 2.0);
        assert_eq!(whole.xyz(pixel).map(|v| 2.0 * v), [1, 2, 3].map(|c| f64::from(values[pixel * 4 + c])));
    }
}

#[test]
fn errors_are_unknown_before_the_second_batch() {
    let mut film = Film::new(&settings(2, 2, 1));
    assert_eq!(film.batches(), 0);
    film.add_batch_f64(&[1.0; 16], 1);
    assert_eq!(film.standard_error(0, 0), f64::INFINITY);
    assert_eq!(film.relative_error(), f64::INFINITY);
    film.add_batch_f64(&[1.0; 16], 1);
    assert_eq!(film.standard_error(0, 0), 0.0);
    assert_eq!(film.relative_error(), 0.0);
}

#[test]
fn a_black_film_says_nothing_about_its_error() {
    let mut film = Film::new(&settings(2, 2, 1));
    (0..3).for_each(|_| film.add_batch_f64(&[0.0; 16], 1));
    assert_eq!(film.relative_error(), f64::INFINITY);
}

#[test]
fn relative_error_follows_its_formula() {
    let mut film = Film::new(&settings(2, 1, 1));
    // Channels of a pixel: one bin, X, Y, Z. Y is 1 and 3 in the first pixel, 10 and 10 in the second.
    film.add_batch_f64(&[0.0, 9.0, 1.0, 9.0, 0.0, 9.0, 10.0, 9.0], 1);
    film.add_batch_f64(&[0.0, 5.0, 3.0, 9.0, 0.0, 9.0, 10.0, 9.0], 1);
    // The first has a variance of 1 and finds light in 2 x 4 / (4 + 1) of its two batches, so that both together, of mean 6 and variance 1/2, weigh
    let weight = 0.5 * 4.0 / (1.6 + 2.0 + 0.5);
    let shrunk = |own: f64, around: f64| (2.0 * own + weight * around) / (2.0 + weight);
    let pixel = |mean: f64, variance: f64| shrunk(variance, 0.5) / (shrunk(mean, 6.0).powi(2) + 0.01 * 36.0);
    let expected = (0.5 * (pixel(2.0, 1.0) + pixel(10.0, 0.0))).sqrt();
    close(film.relative_error(), expected, 1e-6, "relative error");
}

#[test]
fn relative_error_of_what_is_not_visible_is_that_of_its_bins() {
    let mut settings = settings(1, 1, 3);
    (settings.bins.min_nm, settings.bins.max_nm) = (900.0, 2500.0);
    let mut film = Film::new(&settings);
    // Bins of 2 +- 1, 10 +- 0 and nothing; X, Y, Z of a wild tail.
    film.add_batch_f64(&[1.0, 10.0, 0.0, 0.0, 1e-9, 0.0], 1);
    film.add_batch_f64(&[3.0, 10.0, 0.0, 0.0, 0.0, 0.0], 1);
    close(film.relative_error(), (1.0 / (4.0 + 0.01 * 4.0) / 2.0f64).sqrt(), 1e-6, "relative error");
}

#[test]
fn many_batches_do_not_stall_the_mean() {
    // In single precision the mean of 2^25 samples would stand still at 2^24.
    let mut film = Film::new(&settings(1, 1, 1));
    for _ in 0..1 << 10 {
        film.add_batch_f64(&[(1 << 15) as f64; 4], 1 << 15);
    }
    film.add_batch_f64(&[(1u64 << 26) as f64; 4], 1 << 25);
    close(film.bin(0, 0), 1.5, 1e-15, "mean");
    assert_eq!(film.samples_per_pixel(), 1 << 26);
}

#[test]
fn block_means_average_what_is_there() {
    let mut film = Film::new(&settings(5, 3, 1));
    let sums: Vec<f64> = (0..15).flat_map(|p| [f64::from(p), 1.0, 2.0, 3.0]).collect();
    film.add_batch_f64(&sums, 1);
    let blocks = film.block_means(2);
    let settings = Film::block_settings(film.settings(), 2);
    assert_eq!((settings.width, settings.height, blocks.len()), (3, 2, 3 * 2 * 4));
    let first: Vec<f64> = blocks.chunks(4).map(|b| b[0]).collect();
    assert_eq!(first, [3.0, 5.0, 6.5, 10.5, 12.5, 14.0]);
    assert!(blocks.chunks(4).all(|b| b[1..] == [1.0, 2.0, 3.0]));
}

#[test]
fn block_errors_hold_correlated_pixels() {
    /// All pixels of a batch share one random number: averaging over pixels gains nothing.
    struct Flicker(Random);
    impl abbe::render::Integrator for Flicker {
        fn render_batch(&mut self, batch: abbe::render::Batch, film: &mut Film) -> abbe::Result<abbe::stats::BatchStats> {
            let value = self.0.next() * f64::from(batch.spp);
            film.add_batch_f64(&vec![value; film.pixels() * film.channels()], batch.spp);
            Ok(Default::default())
        }
    }
    let film = abbe::render::render_blocks(&mut Flicker(Random(3)), &settings(32, 32, 1), 32, 64, 2).unwrap();
    assert_eq!((film.pixels(), film.batches(), film.samples_per_pixel()), (1, 64, 128));
    close(film.standard_error(0, 0), (1.0f64 / 12.0 / 64.0).sqrt(), 0.3, "error of the mean of flickering pixels");
}

#[test]
fn the_error_of_the_image_mean_is_that_of_the_batches_means() {
    // Four pixels in two tiles; whatever pixels have in common, the mean is a film of one pixel.
    let (mut film, mut mean, mut random) = (Film::new(&settings(4, 1, 1)), Film::new(&settings(1, 1, 1)), Random(5));
    for spp in [2, 2, 5, 1] {
        let shared = random.next();
        let values: Vec<f32> = (0..16).map(|_| ((shared + random.next()) * f64::from(spp)) as f32).collect();
        let tile = |x| Tile { x, y: 0, width: 2, height: 1 };
        film.add_batch(tile(0), &values[..8], spp);
        film.add_batch(tile(2), &values[8..], spp);
        let average = |c: usize| values.iter().skip(c).step_by(4).map(|v| f64::from(*v)).sum::<f64>() / 4.0;
        mean.add_batch_f64(&[0, 1, 2, 3].map(average), spp);
        assert_eq!(film.mean_standard_error(0).is_finite(), film.batches() > 1);
    }
    for channel in 0..4 {
        close(film.mean_standard_error(channel), mean.standard_error(0, channel), 4.0 * 0.5f64.powi(25), "error of the mean");
    }
}

#[test]
fn total_flux_is_mean_irradiance_times_area() {
    let mut film = Film::new(&settings(4, 4, 2));
    let sums: Vec<f64> = (0..16).flat_map(|p| [f64::from(p % 2), 2.0, 0.0, 5.0, 0.0]).collect();
    film.add_batch_f64(&sums, 1);
    assert_eq!(film.total_flux(3.0), [1.5, 6.0, 0.0, 15.0, 0.0]);
}

#[test]
fn a_film_beyond_all_memory_is_an_error() {
    let huge = FilmSettings { width: u32::MAX, height: u32::MAX, ..settings(1, 1, 400) };
    let error = Film::try_new(&huge).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("--size"), "{error:?}");
    assert_eq!(Film::bytes(&settings(2, 1, 20)), 2 * 288);
}

/// A film of 64 x 64 pixels in 16 batches, in which `light(random, pixel)` is what a batch finds in a pixel.
fn batches(seed: u64, light: impl Fn(&mut Random, usize) -> f64) -> Film {
    let (mut film, mut random) = (Film::new(&settings(64, 64, 1)), Random(seed));
    for _ in 0..16 {
        let sums: Vec<f64> = (0..film.pixels()).flat_map(|pixel| [light(&mut random, pixel); 4]).collect();
        film.add_batch_f64(&sums, 1);
    }
    film
}

#[test]
fn where_light_is_rare_a_pixel_takes_its_error_from_its_surroundings() {
    // Mean 1; in one batch of 50 there is all of it, so that three of four pixels have found nothing.
    let film = batches(11, |random, _| if random.next() < 0.02 { 50.0 } else { 0.0 });
    let (errors, n) = (film.errors(0), film.pixels() as f64);
    let exact = (0.02 * 2500.0 - 1.0) / 16.0;
    let dark = (0..film.pixels()).filter(|&p| film.bin(p, 0) == 0.0).collect::<Vec<_>>();
    assert!(dark.len() as f64 > 0.7 * n, "{}", dark.len());
    assert!(dark.iter().all(|&p| film.standard_error(p, 0) == 0.0), "their own batches say nothing");
    let of_dark = dark.iter().map(|&p| errors.expected(p).1).sum::<f64>() / dark.len() as f64;
    // A pixel's 16 batches against the 25 that half an event is worth, and likewise for the blocks.
    assert!((0.4 * exact..exact).contains(&of_dark), "{of_dark}, exact {exact}");
    // In the mean over all pixels the variance is not changed.
    let own = (0..film.pixels()).map(|p| film.standard_error(p, 0).powi(2)).sum::<f64>() / n;
    let all = (0..film.pixels()).map(|p| errors.expected(p).1).sum::<f64>() / n;
    close(all, own, 0.05, "mean variance");
    // And the film knows how wrong it is, if anything too pessimistic: pixels that found nothing count as dark, too.
    let ratio = film.relative_error() / (exact / 1.01f64).sqrt();
    assert!((0.9..1.5).contains(&ratio), "relative error: {ratio} of what it is");
    let blind = |p: usize| film.standard_error(p, 0).powi(2) / (film.bin(p, 0).powi(2) + 0.01);
    let blind = ((0..film.pixels()).map(blind).sum::<f64>() / n).sqrt();
    assert!(blind < 0.35 * exact.sqrt(), "from their own batches alone: {blind}");
}

#[test]
fn where_light_is_plenty_the_surroundings_change_little() {
    let film = batches(12, |random, pixel| if pixel % 64 < 32 { 1.0 + random.next() } else { 0.0 });
    let (errors, lit) = (film.errors(0), (1.0f64 / 12.0 / 16.0).sqrt());
    for pixel in 0..film.pixels() {
        let (own, expected) = (film.standard_error(pixel, 0), errors.standard_error(pixel));
        if pixel % 64 < 32 {
            close(expected, own, 0.2, "error of a lit pixel");
        } else {
            // A quarter of the film without light, 16384 batches, against one batch's worth of the whole.
            assert!(expected > 0.0 && expected < 0.01 * lit, "error of a black pixel: {expected}, of a lit one {lit}");
        }
    }
}

#[test]
fn batches_that_make_up_for_each_other_do_not_overstate_the_error_of_the_mean() {
    // Every fourth batch has all the light, as where a pass has one wavelength of four: the mean is off by next to nothing.
    let mut film = Film::new(&settings(1, 1, 1));
    for batch in 0..256 {
        let error = film.mean_standard_error(0);
        assert!(batch < 2 || error.is_finite(), "batch {batch}");
        film.add_batch_f64(&[if batch % 4 == 0 { 4.0 } else { 0.0 }; 4], 1);
    }
    assert_eq!(film.mean_groups(), 32);
    assert!(film.mean_standard_error(0) < 1e-12, "{}", film.mean_standard_error(0));
    assert!(film.standard_error(0, 0) > 0.1, "single batches do differ");
    // Where they are independent, groups say the same as batches.
    let (mut film, mut random) = (Film::new(&settings(1, 1, 1)), Random(6));
    for _ in 0..1000 {
        film.add_batch_f64(&[random.next(); 4], 1);
    }
    assert!((16..=32).contains(&film.mean_groups()), "{}", film.mean_groups());
    close(film.mean_standard_error(0), film.standard_error(0, 0), 0.5, "error of the mean");
}

#[test]
fn errors_stay_finite_whatever_the_film_holds() {
    let mut film = Film::new(&settings(2, 2, 1));
    for batch in 0..4 {
        film.add_batch_f64(&[1e30 * f64::from(batch % 2); 16], 1);
    }
    for channel in 0..4 {
        assert!((0..4).all(|pixel| film.errors(channel).standard_error(pixel).is_finite()));
    }
    assert!(film.relative_error() > 0.0 && film.relative_error().is_finite());
}

#[test]
fn half_differences_say_what_the_noise_is_and_nothing_of_the_mean() {
    let mut film = Film::new(&settings(64, 64, 1));
    film.keep_half();
    let mut random = Random(11);
    let values = film.pixels() * film.channels();
    // Halves of unequal weight: batches of growing size, an odd number of them.
    for spp in [1, 1, 1, 1, 1, 4, 4, 4, 9] {
        let sums: Vec<f64> = (0..values).map(|_| (0..spp).map(|_| random.next()).sum()).collect();
        film.add_batch_f64(&sums, spp);
    }
    let samples = f64::from(5 + 12 + 9);
    let (mut squares, mut products, mut count) = (0.0, 0.0, 0.0);
    for pixel in 0..film.pixels() {
        for channel in 0..film.channels() {
            let (off, half) = (film.pixel(pixel)[channel] - 0.5, film.half_difference(pixel, channel));
            squares += half * half;
            // Noise of the mean plus and minus it is independent.
            products += (off + half) * (off - half);
            count += 1.0;
        }
    }
    // Uniform samples have variance 1/12; 16384 squares scatter by sqrt(2/16384).
    close(squares / count, 1.0 / 12.0 / samples, 0.04, "squared half difference");
    assert!((products / count).abs() < 0.06 / 12.0 / samples, "{}", products / count);
    // Of two films it is that of all batches.
    let (mut a, mut b) = (Film::new(&settings(1, 1, 1)), Film::new(&settings(1, 1, 1)));
    [&mut a, &mut b].into_iter().for_each(Film::keep_half);
    (0..4).for_each(|_| a.add_batch_f64(&[random.next(); 4], 1));
    (0..4).for_each(|_| b.add_batch_f64(&[random.next(); 4], 1));
    let expected = 0.5 * (a.half_difference(0, 0) + b.half_difference(0, 0));
    a.add_film(&b);
    close(a.half_difference(0, 0), expected, 1e-4, "half difference of a merged film");
    assert_eq!(Film::new(&settings(1, 1, 1)).half_difference(0, 0), 0.0);
}

#[test]
fn halves_agree_where_batches_make_up_for_each_other() {
    // All the light comes with every second, third, ... batch, as where passes take turns at wavelengths: no noise is left in the mean of both.
    for period in [2, 3, 4, 5, 20] {
        let mut film = Film::new(&settings(1, 1, 1));
        film.keep_half();
        for batch in 0..256 {
            film.add_batch_f64(&[if batch % period == 0 { f64::from(period) } else { 0.0 }; 4], 1);
        }
        let half = film.half_difference(0, 0);
        assert!(half.abs() < 0.1, "every {period}: {half} of a mean of 1");
    }
}
