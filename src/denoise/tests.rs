//! Noise that is known, off pictures that are known.

use super::filter::{Filtered, Noisy};
use super::planes::{Size, box_mean};

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
fn picture(bins: usize, truth: &dyn Fn(usize, usize, usize) -> f32, deviation: f32, shared: Shared) -> (Noisy, Vec<f32>) {
    let (channels, pixels) = (bins + 3, SIZE.pixels());
    let mut random = Random(3);
    let truth: Vec<f32> =
        (0..pixels * channels).map(|i| truth(i / channels % SIZE.width, i / channels / SIZE.width, i % channels)).collect();
    let noise = |random: &mut Random| -> Vec<f32> {
        let mut planes: Vec<Vec<f32>> = (0..channels).map(|_| (0..pixels).map(|_| random.normal()).collect()).collect();
        if shared == Shared::Neighbours {
            planes.iter_mut().for_each(|plane| *plane = box_mean(plane, SIZE, 1).iter().map(|v| 3.0 * v).collect());
        }
        let plane = |c: usize| if shared == Shared::Bins { 0 } else { c };
        (0..pixels * channels).map(|i| deviation * (truth[i] + 0.02) * planes[plane(i % channels)][i / channels]).collect()
    };
    let (a, b) = (noise(&mut random), noise(&mut random));
    let of = |f: &dyn Fn(usize) -> f32| (0..pixels * channels).map(f).collect::<Vec<f32>>();
    let error = of(&|i| deviation * (truth[i] + 0.02) / 2f32.sqrt());
    let bins_of = |v: &[f32]| v.chunks_exact(channels).flat_map(|v| v[..bins].to_vec()).collect::<Vec<f32>>();
    let noisy = Noisy {
        size: SIZE,
        bins,
        mean: of(&|i| truth[i] + 0.5 * (a[i] + b[i])),
        half: of(&|i| 0.5 * (a[i] - b[i])),
        error: (bins_of(&error), error.chunks_exact(channels).map(|v| v[bins + 1]).collect()),
        features: Vec::new(),
    };
    (noisy, truth)
}

/// Mean squared error of channels from `first` to `end` over that of what came.
fn gain(noisy: &Noisy, filtered: &Filtered, truth: &[f32], channels: std::ops::Range<usize>) -> f32 {
    let all = noisy.channels();
    let error = |values: &[f32]| -> f32 {
        let squares = values.iter().zip(truth).enumerate().filter(|(i, _)| channels.contains(&(i % all)));
        squares.map(|(_, (v, t))| (v - t).powi(2)).sum()
    };
    error(&filtered.mean) / error(&noisy.mean)
}

/// Share of all values that are within two errors of the truth.
fn coverage(filtered: &Filtered, truth: &[f32]) -> f32 {
    let within = filtered.mean.iter().zip(truth).zip(&filtered.error).filter(|((v, t), e)| (**v - **t).abs() <= 2.0 * **e);
    within.count() as f32 / truth.len() as f32
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
        let told: f32 = filtered.error.iter().map(|e| e * e).sum();
        let is: f32 = filtered.mean.iter().zip(&truth).map(|(v, t)| (v - t).powi(2)).sum();
        assert!(told < 4.0 * is, "errors are {} of what they claim", (is / told).sqrt());
    }
}

#[test]
fn all_bins_are_filtered_by_the_same_weights() {
    // Bins that are multiples of each other, noise included, stay so.
    let (mut noisy, _) = picture(5, &soft, 0.3, Shared::Nothing);
    for values in [&mut noisy.mean, &mut noisy.half] {
        values.chunks_exact_mut(8).for_each(|v| v[3] = 2.5 * v[1]);
    }
    noisy.error.0.chunks_exact_mut(5).for_each(|v| v[3] = 2.5 * v[1]);
    for v in noisy.filter().mean.chunks_exact(8) {
        assert!((v[3] - 2.5 * v[1]).abs() <= 1e-4 * v[3].abs(), "{v:?}");
    }
}

#[test]
fn no_colour_is_invented_where_two_lights_meet() {
    // To the left there is light in the first bin alone, to the right in the last.
    let (noisy, _) = picture(5, &|x, _, c| f32::from(c == if x < 20 { 0 } else { 4 } || c > 4), 0.0, Shared::Nothing);
    let mut with_noise = picture(5, &|_, _, _| 1.0, 0.3, Shared::Nothing).0;
    for (noise, light) in with_noise.mean.iter_mut().zip(&noisy.mean) {
        *noise *= light;
    }
    for (noise, light) in with_noise.half.iter_mut().zip(&noisy.mean) {
        *noise *= light;
    }
    let filtered = with_noise.filter();
    for (p, v) in filtered.mean.chunks_exact(8).enumerate() {
        let other = if p % SIZE.width < 20 { v[4] } else { v[0] };
        assert!(other.abs() < 0.05, "{p}: {v:?}");
        assert!(v[1..4].iter().all(|v| v.abs() < 1e-6), "{p}: {v:?}");
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
    let at = |values: &[f32], x: usize, c: usize| (4..32).map(|y| values[(y * SIZE.width + x) * 8 + c]).sum::<f32>() / 28.0;
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
        noisy.mean[pixel * 8 + c] += 10.0;
        noisy.half[pixel * 8 + c] += 10.0;
    }
    let filtered = noisy.filter();
    assert!(filtered.mean[pixel * 8] < 2.0, "{}", filtered.mean[pixel * 8]);
    let mean = |values: &[f32]| values.iter().step_by(8).sum::<f32>() / SIZE.pixels() as f32;
    let (before, after) = (mean(&noisy.mean), mean(&filtered.mean));
    assert!((after - before).abs() < 0.005 * before, "{before} became {after}");
}

#[test]
fn pictures_of_any_size_are_filtered() {
    for (width, height, bins) in [(1, 1, 1), (3, 1, 2), (1, 30, 1), (2, 2, 25), (9, 8, 3)] {
        let (size, channels) = (Size { width, height }, bins + 3);
        let mut random = Random(1);
        let mut some = |n: usize| (0..n).map(|_| random.next()).collect::<Vec<f32>>();
        let pixels = size.pixels();
        let noisy = Noisy {
            size,
            bins,
            mean: some(pixels * channels),
            half: some(pixels * channels),
            error: (some(pixels * bins), some(pixels)),
            features: vec![(some(pixels), some(pixels), true)],
        };
        let filtered = noisy.filter();
        assert!(filtered.mean.iter().chain(&filtered.error).all(|v| v.is_finite()), "{size:?}");
        // Black stays black.
        let black = Noisy { mean: vec![0.0; pixels * channels], half: vec![0.0; pixels * channels], ..noisy };
        assert!(black.filter().mean.iter().all(|v| *v == 0.0), "{size:?}");
    }
}
