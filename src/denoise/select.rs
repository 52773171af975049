//! Which of several pictures is best where, and how good it is: estimates of mean squared errors, bias included.
//!
//! Of halves A and B of the samples with independent noise and what filters make of them, F_A and F_B, each by weights from the other half,
//! ```text
//! ((F_A + F_B) / 2 - I)^2 = ((F_A - F_B) / 2)^2 + (F_A - I) (F_B - I)
//! ```
//! and the expectation of the last product is that of (F_A - A) (F_B - B): what these have of the noise is independent. So nothing need be known of
//! variances, nor of how much pixels share their noise. A single pixel's estimate says little; means over squares of pixels do.

use super::kernel::Halves;
use super::planes::{Size, add, box_mean, mean, plane};

/// Pixels to every side over which estimates of bias and of noise are averaged for the errors that are told. Smaller squares leave more pixels uncovered:
/// an estimate of bias varies as the noise of what is not filtered.
const ERROR_RADIUS: usize = 8;
/// The weights for one half know the noise of the other, so that what is filtered of the two is more alike than chance would have it, and the best of
/// several looks better than it is: squared errors are larger than the halves say by this factor, so that two errors cover nine tenths of the pixels, of
/// noise that is known as of renders.
const WEIGHTS_KNOW: f32 = 3.0;

/// Where one half of the samples alone has wavelengths of a bin, all pixels around share that, and the product of the halves says that there is no light. What
/// errors are relative to is not less than this part of the square of what is seen around: a hundred times too heavy, not a hundred thousand.
const LEAST_SQUARE: f32 = 0.01;

/// Where candidates are compared, and what it takes not to be filtered: estimates vary, and the least of several is the least by chance where all are noisy.
#[derive(Debug, Clone, Copy)]
pub struct Comparison {
    /// Pixels to every side over which estimates are averaged.
    pub radius: usize,
    /// Pixels to every side over which what is not filtered must be the best, too: where light is found rarely, a patch that found none looks dark for sure.
    pub wide: usize,
    /// What is not filtered must be better by more than this factor.
    pub factor: f32,
}

/// Planes: means of both halves and half their difference.
#[derive(Debug, Clone, Copy)]
pub struct Raw<'a> {
    /// Means.
    pub mean: &'a [Vec<f32>],
    /// Half the difference of the halves.
    pub half: &'a [Vec<f32>],
}

impl Raw<'_> {
    /// What both halves have of a plane.
    pub fn halves(&self, plane: usize, pixel: usize) -> [f32; 2] {
        let (mean, half) = (self.mean[plane][pixel], self.half[plane][pixel]);
        [mean + half, mean - half]
    }
}

fn noise([a, b]: [f32; 2]) -> f32 {
    (0.5 * (a - b)).powi(2)
}

fn product([fa, fb]: [f32; 2], [a, b]: [f32; 2]) -> f32 {
    (fa - a) * (fb - b)
}

/// For each of the `candidates`, the raw halves being the first, shares of pixels that blend them: those with the least mean squared errors of the first
/// `compared` planes relative to their square (and to a hundredth of the mean's), compared as `comparison` has it.
pub fn shares(size: Size, raw: Raw<'_>, candidates: &[Halves], compared: usize, comparison: Comparison) -> Vec<Vec<f32>> {
    let mut errors = vec![vec![0.0; size.pixels()]; candidates.len() + 1];
    for c in 0..compared {
        let floor = 0.01 * mean(&raw.mean[c]).powi(2);
        let squares = |p: usize| (raw.mean[c][p].powi(2), raw.half[c][p].powi(2));
        // Unbiased of the surroundings, but where nothing was found nothing is.
        let around = box_mean(&plane(size, |p| squares(p).0 - squares(p).1), size, 1);
        let near = box_mean(&raw.mean[c], size, 1);
        let square = |p: usize| around[p].max(LEAST_SQUARE * near[p].powi(2)).clamp(0.0, squares(p).0 + squares(p).1);
        let scale = plane(size, |p| 1.0 / (square(p) + floor).max(f32::MIN_POSITIVE));
        let (first, others) = errors.split_first_mut().expect("raw halves are the first");
        add(first, |p| comparison.factor * scale[p] * noise(raw.halves(c, p)));
        for (errors, [a, b]) in others.iter_mut().zip(candidates) {
            let (a, b) = (&a[c], &b[c]);
            add(errors, |p| scale[p] * (noise([a[p], b[p]]) + product([a[p], b[p]], raw.halves(c, p))));
        }
    }
    let around = |radius: usize| errors.iter().map(|errors| box_mean(errors, size, radius)).collect::<Vec<Vec<f32>>>();
    let (near, wide) = (around(comparison.radius), around(comparison.wide));
    let least =
        |errors: &[Vec<f32>], p: usize, from: usize| (from..errors.len()).min_by(|&a, &b| errors[a][p].total_cmp(&errors[b][p]));
    let best = |p: usize| match (least(&near, p, 0), least(&wide, p, 0)) {
        (Some(0), Some(0)) => Some(0),
        _ => least(&near, p, 1),
    };
    // Without edges between them.
    (0..errors.len()).map(|i| box_mean(&plane(size, |p| f32::from(u8::from(best(p) == Some(i)))), size, 1)).collect()
}

/// The raw halves and `candidates`, blended.
pub fn blend(size: Size, raw: Raw<'_>, candidates: &[Halves], shares: &[Vec<f32>]) -> Halves {
    let blended = |half: usize, c: usize| {
        plane(size, |p| {
            let filtered = candidates.iter().zip(&shares[1..]).map(|(candidate, share)| share[p] * candidate[half][c][p]);
            shares[0][p] * raw.halves(c, p)[half] + filtered.sum::<f32>()
        })
    };
    [0, 1].map(|half| (0..raw.mean.len()).map(|c| blended(half, c)).collect())
}

/// Root mean square errors of the mean of two `filtered` halves, plane by plane.
pub fn errors(size: Size, raw: Raw<'_>, [a, b]: &Halves) -> Vec<Vec<f32>> {
    let error = |c: usize| {
        let of = |p: usize| [a[c][p], b[c][p]];
        let noise = box_mean(&plane(size, |p| noise(of(p))), size, ERROR_RADIUS);
        let bias = box_mean(&plane(size, |p| product(of(p), raw.halves(c, p))), size, ERROR_RADIUS);
        plane(size, |p| (WEIGHTS_KNOW * (noise[p] + bias[p].max(0.0))).sqrt())
    };
    (0..raw.mean.len()).map(error).collect()
}
