//! Noise that is known, off pictures that are known.

use super::filter::{Filtered, Noisy};
use super::planes::{Size, box_mean, mean};

const SIZE: Size = Size { width: 40, height: 32 };

/// SplitMix64 (Steele, Lea & Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Mean 0 and deviation 1, nearly normal.
    fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.next()).sum::<f32>() - 6.0
    }
}

/// How noise hangs together.
#[derive(Clone, Copy, PartialEq)]
enum Shared {
    Nothing,
    /// All bins have the same.
    Bins,
    /// Neighbours have nearly the same, as where photons are gathered.
    Neighbours,
}

/// A picture whose bins and X, Y, Z are `truth` of column, row and channel, with noise of `deviation` (of a half, relative to the truth and to 0.02 more).
fn picture(bins: usize, truth: &dyn Fn(usize, usize, usize) -> f32, deviation: f32, shared: Shared) -> (Noisy, Vec<Vec<f32>>) {
    let (channels, pixels) = (bins + 3, SIZE.pixels());
    let mut random = Random(3);
    let truth: Vec<Vec<f32>> =
        (0..channels).map(|c| (0..pixels).map(|p| truth(p % SIZE.width, p / SIZE.width, c)).collect()).collect();
    let of = |value: &dyn Fn(usize, usize) -> f32| -> Vec<Vec<f32>> {
        (0..channels).map(|c| (0..pixels).map(|p| value(c, p)).collect()).collect()
    };
    let noise = |random: &mut Random| {
        let mut planes = of(&|_, _| 0.0);
        planes.iter_mut().flatten().for_each(|v| *v = random.normal());
        if shared == Shared::Neighbours {
            planes.iter_mut().for_each(|plane| *plane = box_mean(plane, SIZE, 1).iter().map(|v| 3.0 * v).collect());
        }
        let plane = |c: usize| if shared == Shared::Bins { 0 } else { c };
        of(&|c, p| deviation * (truth[c][p] + 0.02) * planes[plane(c)][p])
    };
    let (a, b) = (noise(&mut random), noise(&mut random));
    let error = of(&|c, p| deviation * (truth[c][p] + 0.02) / 2f32.sqrt());
    let noisy = Noisy {
        size: SIZE,
        mean: of(&|c, p| truth[c][p] + 0.5 * (a[c][p] + b[c][p])),
        half: of(&|c, p| 0.5 * (a[c][p] - b[c][p])),
        error: error[..bins].iter().chain([&error[bins + 1]]).cloned().collect(),
        features: Vec::new(),
    };
    (noisy, truth)
}

/// Mean squared error of `channels` over that of what came.
fn gain(noisy: &Noisy, filtered: &Filtered, truth: &[Vec<f32>], channels: std::ops::Range<usize>) -> f32 {
    let error = |planes: &[Vec<f32>]| squares(&planes[channels.clone()], &truth[channels.clone()]);
    error(&filtered.mean) / error(&noisy.mean)
}

/// Sum of squared differences.
fn squares(a: &[Vec<f32>], b: &[Vec<f32>]) -> f32 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum()
}

/// Share of all values that are within two errors of the truth.
fn coverage(filtered: &Filtered, truth: &[Vec<f32>]) -> f32 {
    let values = filtered.mean.iter().flatten().zip(truth.iter().flatten()).zip(filtered.error.iter().flatten());
    let within = values.filter(|((v, t), e)| (**v - **t).abs() <= 2.0 * **e);
    within.count() as f32 / truth.iter().flatten().count() as f32
}

/// Soft shapes in two colours.
fn soft(x: usize, y: usize, c: usize) -> f32 {
    let (x, y) = (x as f32 / 40.0, y as f32 / 32.0);
    (0.3 + x + 0.3 * (5.0 * y).sin()) * if c.is_multiple_of(2) { 1.0 } else { 0.4 + 0.3 * x }
}

#[test]
fn noise_goes_and_errors_cover_what_is_left_however_noise_hangs_together() {
    for (shared, most) in [(Shared::Nothing, 0.25), (Shared::Bins, 0.25), (Shared::Neighbours, 0.5)] {
        let (noisy, truth) = picture(12, &soft, 0.3, shared);
        let filtered = noisy.filter();
        let left = gain(&noisy, &filtered, &truth, 0..12);
        let covered = coverage(&filtered, &truth);
        assert!(left < most, "{left} of the error is left");
        assert!(covered > 0.9, "two errors cover {covered}");
        // And they are not just large.
        let told: f32 = filtered.error.iter().flatten().map(|e| e * e).sum();
        let is = squares(&filtered.mean, &truth);
        assert!(told < 4.0 * is, "errors are {} of what they claim", (is / told).sqrt());
    }
}

#[test]
fn all_bins_are_filtered_by_the_same_weights() {
    // Bins that are multiples of each other, noise included, stay so.
    let (mut noisy, _) = picture(5, &soft, 0.3, Shared::Nothing);
    for planes in [&mut noisy.mean, &mut noisy.half, &mut noisy.error] {
        planes[3] = planes[1].iter().map(|v| 2.5 * v).collect();
    }
    let filtered = noisy.filter().mean;
    for (a, b) in filtered[1].iter().zip(&filtered[3]) {
        assert!((b - 2.5 * a).abs() <= 1e-4 * b.abs(), "{a} and {b}");
    }
}

#[test]
fn no_colour_is_invented_where_two_lights_meet() {
    // To the left there is light in the first bin alone, to the right in the last.
    let (noisy, _) = picture(5, &|x, _, c| f32::from(c == if x < 20 { 0 } else { 4 } || c > 4), 0.0, Shared::Nothing);
    let mut with_noise = picture(5, &|_, _, _| 1.0, 0.3, Shared::Nothing).0;
    for planes in [&mut with_noise.mean, &mut with_noise.half] {
        planes.iter_mut().flatten().zip(noisy.mean.iter().flatten()).for_each(|(noise, light)| *noise *= light);
    }
    let filtered = with_noise.filter().mean;
    for p in 0..SIZE.pixels() {
        let other = filtered[if p % SIZE.width < 20 { 4 } else { 0 }][p];
        assert!(other.abs() < 0.05, "{p}: {other}");
        assert!(filtered[1..4].iter().all(|plane| plane[p].abs() < 1e-6), "{p}");
    }
}

#[test]
fn thin_caustics_and_rainbows_stay() {
    // A bright line of one pixel, and a thin rainbow whose every column has one bin.
    let caustic = |x: usize, y: usize, c: usize| match (x, y) {
        (10, _) => 8.0,
        (22..=26, 4..) => {
            if c == x - 22 || c > 4 {
                3.0
            } else {
                0.1
            }
        }
        _ => 0.5,
    };
    let (noisy, truth) = picture(5, &caustic, 0.2, Shared::Nothing);
    let filtered = noisy.filter();
    let at = |planes: &[Vec<f32>], x: usize, c: usize| (4..32).map(|y| planes[c][y * SIZE.width + x]).sum::<f32>() / 28.0;
    for (x, c) in [(10, 0), (9, 0), (11, 3), (22, 0), (23, 1), (24, 2), (25, 3), (26, 4), (24, 1), (23, 2)] {
        let (is, should) = (at(&filtered.mean, x, c), at(&truth, x, c));
        assert!((is - should).abs() < 0.06 * should + 0.02, "column {x}, bin {c}: {is} in place of {should}");
    }
    assert!(gain(&noisy, &filtered, &truth, 0..5) < 0.5, "{}", gain(&noisy, &filtered, &truth, 0..5));
}

#[test]
fn a_bright_sample_is_spread_and_its_light_is_kept() {
    let (mut noisy, _) = picture(5, &|_, _, _| 1.0, 0.1, Shared::Nothing);
    // One half of one pixel has met something bright.
    let pixel = 16 * SIZE.width + 20;
    for c in 0..8 {
        noisy.mean[c][pixel] += 10.0;
        noisy.half[c][pixel] += 10.0;
    }
    let filtered = noisy.filter();
    assert!(filtered.mean[0][pixel] < 2.0, "{}", filtered.mean[0][pixel]);
    let (before, after) = (mean(&noisy.mean[0]), mean(&filtered.mean[0]));
    assert!((after - before).abs() < 0.005 * before, "{before} became {after}");
}

#[test]
fn pictures_of_any_size_are_filtered() {
    for (width, height, bins) in [(1, 1, 1), (3, 1, 2), (1, 30, 1), (2, 2, 25), (9, 8, 3), (9, 8, 0)] {
        let (size, channels) = (Size { width, height }, bins + 3);
        let mut random = Random(1);
        let mut some = |planes: usize| -> Vec<Vec<f32>> {
            (0..planes).map(|_| (0..size.pixels()).map(|_| random.next()).collect()).collect()
        };
        let (mean, half, error) = (some(channels), some(channels), some(bins.max(3) + 1));
        let noisy = Noisy { size, mean, half, error, features: vec![(some(1).remove(0), some(1).remove(0), true)] };
        let filtered = noisy.filter();
        assert!(filtered.mean.iter().chain(&filtered.error).flatten().all(|v| v.is_finite()), "{size:?}");
        // Black stays black.
        let black = || vec![vec![0.0; size.pixels()]; channels];
        let black = Noisy { mean: black(), half: black(), ..noisy };
        assert!(black.filter().mean.iter().flatten().all(|v| *v == 0.0), "{size:?}");
    }
}

#[test]
fn colours_stay_apart_where_one_half_alone_has_them() {
    // Bands of one colour each; all pixels share whether it is the one half or the other that has met it, as passes share wavelengths.
    let (mut noisy, truth) = picture(5, &|x, _, c| f32::from(c == x / 8 || c > 4), 0.3, Shared::Nothing);
    for c in 0..5 {
        for (half, mean) in noisy.half[c].iter_mut().zip(&noisy.mean[c]) {
            *half += if c % 2 == 0 { 0.95 } else { -0.95 } * mean;
        }
        noisy.error[c].iter_mut().zip(&truth[c]).for_each(|(error, truth)| *error += truth);
    }
    let filtered = noisy.filter();
    for (filtered, truth) in filtered.mean.iter().zip(&truth) {
        let astray: f32 = filtered.iter().zip(truth).filter(|(_, truth)| **truth == 0.0).map(|(v, _)| v.abs()).sum();
        assert!(astray < 0.02 * truth.iter().sum::<f32>(), "{astray} of {}", truth.iter().sum::<f32>());
    }
}
