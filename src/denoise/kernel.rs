//! Non-local means: weights from how alike the surroundings of two pixels are, measured against their noise (F. Rousselle, C. Knaus & M. Zwicker,
//! "Adaptive Rendering with Non-Local Means Filtering", ACM TOG 31(6), 2012, equations 3 to 5), and how alike what is seen there.
//!
//! Two halves of the samples filter each other: the weights for the one come from the other, so that they know nothing of its noise, and a pixel that is
//! bright by chance is spread like any other.

use super::planes::{Size, box_mean, plane};
use rayon::prelude::*;

/// Pixels to every side that a pixel may be like.
const RADIUS: usize = 9;
const SIDE: usize = 2 * RADIUS + 1;
/// Offsets of these from it.
const OFFSETS: usize = SIDE * SIDE;
/// Rows that a core takes at a time.
const ROWS: usize = 8;
/// Variances vary from pixel to pixel as batches have them; how large they are is measured over squares of twice this and one pixels.
const SCALE_RADIUS: usize = 4;
/// What a feature, whose range is 1, may differ by even where it has no noise; and noise that is a multiple of its deviation.
const FEATURE_SPREAD: f32 = 0.06;
const FEATURE_DEVIATIONS: f32 = 6.0;

/// A plane that distances are measured in.
#[derive(Debug)]
pub struct Guide {
    /// Both halves.
    pub halves: [Vec<f32>; 2],
    /// Variance of a half.
    variance: Vec<f32>,
}

impl Guide {
    /// From means, half the differences of the halves, and what variances of the means are proportional to nearby.
    pub fn new(size: Size, mean: &[f32], half: &[f32], variance: &[f32]) -> Self {
        let squares = box_mean(&plane(size, |p| half[p] * half[p]), size, SCALE_RADIUS);
        let around = box_mean(variance, size, SCALE_RADIUS);
        let scale = |p: usize| (squares[p] / around[p].max(f32::MIN_POSITIVE)).clamp(0.03, 3.0);
        Guide {
            halves: [plane(size, |p| mean[p] + half[p]), plane(size, |p| mean[p] - half[p])],
            variance: plane(size, |p| 2.0 * variance[p] * scale(p)),
        }
    }
}

/// What is seen at every pixel, in units of its range, and the variance of that.
#[derive(Debug)]
pub struct Feature {
    mean: Vec<f32>,
    variance: Vec<f32>,
}

impl Feature {
    /// From means and half the differences of two halves.
    pub fn new(size: Size, mean: &[f32], half: &[f32]) -> Self {
        let (low, high) = mean.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
        let scale = 1.0 / (high - low).max(f32::MIN_POSITIVE);
        let squares = plane(size, |p| (half[p] * scale).powi(2));
        Feature { mean: plane(size, |p| mean[p] * scale), variance: box_mean(&squares, size, 1) }
    }
}

/// What weights are made of.
#[derive(Debug)]
pub struct Kernel<'a> {
    /// Pixels.
    pub size: Size,
    /// Where patches are compared.
    pub guides: &'a [Guide],
    /// What must be alike, too.
    pub features: &'a [&'a Feature],
    /// Pixels to every side that belong to a patch.
    pub patch: usize,
    /// Differences count the less, the larger these: k of the paper, a picture for each.
    pub widths: &'a [f32],
}

/// Filtered values, of both halves.
pub type Halves = [Vec<f32>; 2];

impl Kernel<'_> {
    /// Filters both halves of `data`, `[pixel][channel]`, once for each of the widths; all channels by the same weights.
    pub fn filter(&self, data: &Halves, channels: usize) -> Vec<Halves> {
        let row = self.size.width * channels;
        let mut filtered: Vec<Halves> = self.widths.iter().map(|_| [0, 1].map(|_| vec![0.0; row * self.size.height])).collect();
        let mut strips: Vec<Vec<[&mut [f32]; 2]>> = (0..self.size.height.div_ceil(ROWS)).map(|_| Vec::new()).collect();
        for [a, b] in &mut filtered {
            for (strip, (a, b)) in strips.iter_mut().zip(a.chunks_mut(ROWS * row).zip(b.chunks_mut(ROWS * row))) {
                strip.push([a, b]);
            }
        }
        strips.into_par_iter().enumerate().for_each(|(i, mut out)| {
            let rows = ROWS.min(self.size.height - i * ROWS);
            let seen = self.feature_distances(i * ROWS, rows);
            for half in 0..2 {
                let distances = self.distances(1 - half, i * ROWS, rows);
                let mut out: Vec<&mut [f32]> = out.iter_mut().map(|halves| &mut *halves[half]).collect();
                self.apply((&distances, &seen), &data[half], channels, i * ROWS, &mut out);
            }
        });
        filtered
    }

    /// Weighted means over the surroundings of the pixels of some rows, for each of the widths.
    fn apply(
        &self,
        (distances, seen): (&[f32], &[f32]),
        data: &[f32],
        channels: usize,
        first_row: usize,
        out: &mut [&mut [f32]],
    ) {
        let Size { width, height } = self.size;
        let pixels = ROWS.min(height - first_row) * width;
        let scales: Vec<f32> = self.widths.iter().map(|width| width.powi(-2)).collect();
        let least = scales.iter().copied().fold(f32::INFINITY, f32::min);
        let mut totals = vec![0.0; scales.len()];
        for i in 0..pixels {
            let (pixel, at) = (first_row * width + i, i * channels..(i + 1) * channels);
            totals.fill(0.0);
            for offset in 0..OFFSETS {
                let (distance, seen) = (distances[offset * pixels + i], seen[offset * pixels + i]);
                // Most are like nothing, whatever the width; so are those outside the picture.
                if distance * least + seen >= FALLEN {
                    continue;
                }
                let other = pixel + offset / SIDE * width + offset % SIDE - RADIUS * (width + 1);
                let values = &data[other * channels..(other + 1) * channels];
                for ((out, total), scale) in out.iter_mut().zip(&mut totals).zip(&scales) {
                    let weight = falling(distance * scale + seen);
                    *total += weight;
                    out[at.clone()].iter_mut().zip(values).for_each(|(sum, v)| *sum += weight * v);
                }
            }
            // The pixel itself has a weight of 1.
            for (out, total) in out.iter_mut().zip(&totals) {
                out[at.clone()].iter_mut().for_each(|sum| *sum /= total);
            }
        }
    }

    /// Columns of a row, and where those lie that are `offset` away; none where that row is outside the picture.
    fn pairs(&self, y: usize, offset: usize) -> Option<(usize, usize, usize)> {
        let Size { width, height } = self.size;
        let (dy, dx) = (offset / SIDE, offset % SIDE);
        let other = (y + dy).checked_sub(RADIUS).filter(|&row| row < height)?;
        let first = RADIUS.saturating_sub(dx);
        let end = (width + RADIUS).saturating_sub(dx).min(width);
        (first < end).then(|| (first, end, other * width + first + dx - RADIUS))
    }

    /// How far patches are apart, `[offset][pixel]` of some rows, by one half: mean over guides, each counting from 0 on.
    fn distances(&self, half: usize, first_row: usize, rows: usize) -> Vec<f32> {
        let Size { width, height } = self.size;
        let (patch, pixels) = (self.patch, rows * width);
        let mut distances = vec![0.0; OFFSETS * pixels];
        let mut row = vec![0.0; width];
        let mut across = vec![0.0; (rows + 2 * patch) * width];
        let share = 1.0 / (2 * patch + 1).pow(2) as f32;
        // Differences of many guides that are small and alike are one that is not.
        let weight = 1.0 / (self.guides.len() as f32).sqrt();
        for (offset, distances) in distances.chunks_exact_mut(pixels).enumerate() {
            for guide in self.guides {
                let (values, variance) = (&guide.halves[half], &guide.variance);
                for (i, across) in across.chunks_exact_mut(width).enumerate() {
                    let y = (first_row + i).saturating_sub(patch).min(height - 1);
                    row.fill(0.0);
                    if let Some((first, end, other)) = self.pairs(y, offset) {
                        let (p, q) = (y * width + first..y * width + end, other..other + end - first);
                        let of_p = values[p.clone()].iter().zip(&variance[p]);
                        let of_q = values[q.clone()].iter().zip(&variance[q]);
                        for ((out, (u, v)), (other_u, other_v)) in row[first..end].iter_mut().zip(of_p).zip(of_q) {
                            // A dark pixel that is known to be dark is not like a noisy bright one, whatever the noise of that.
                            let noise = v + v.min(*other_v);
                            *out = ((u - other_u).powi(2) - noise) / (f32::MIN_POSITIVE + noise);
                        }
                    }
                    sum_across(&row, patch, across);
                }
                for (i, distances) in distances.chunks_exact_mut(width).enumerate() {
                    let mut rows = across[i * width..(i + 2 * patch + 1) * width].chunks_exact(width);
                    rows.next().into_iter().for_each(|first| row.copy_from_slice(first));
                    rows.for_each(|more| row.iter_mut().zip(more).for_each(|(sum, v)| *sum += v));
                    distances.iter_mut().zip(&row).for_each(|(distance, sum)| *distance += (share * sum).max(0.0) * weight);
                }
            }
        }
        distances
    }

    /// How much what is seen differs, likewise: the feature that differs most. Infinite for what is not in the picture.
    fn feature_distances(&self, first_row: usize, rows: usize) -> Vec<f32> {
        let Size { width, .. } = self.size;
        let mut distances = vec![f32::INFINITY; OFFSETS * rows * width];
        for (offset, distances) in distances.chunks_exact_mut(rows * width).enumerate() {
            for (i, distances) in distances.chunks_exact_mut(width).enumerate() {
                let y = first_row + i;
                let Some((first, end, other)) = self.pairs(y, offset) else { continue };
                let (p, q) = (y * width + first..y * width + end, other..other + end - first);
                distances[first..end].fill(0.0);
                for Feature { mean, variance } in self.features {
                    let of_p = mean[p.clone()].iter().zip(&variance[p.clone()]);
                    let of_q = mean[q.clone()].iter().zip(&variance[q.clone()]);
                    for ((out, (u, v)), (other_u, other_v)) in distances[first..end].iter_mut().zip(of_p).zip(of_q) {
                        let noise = v + v.min(*other_v);
                        let spread = (FEATURE_DEVIATIONS * FEATURE_DEVIATIONS * noise).max(FEATURE_SPREAD * FEATURE_SPREAD);
                        *out = out.max(((u - other_u).powi(2) - noise) / spread);
                    }
                }
            }
        }
        distances
    }
}

/// Sums over 2 `radius` + 1 neighbours in a row.
fn sum_across(row: &[f32], radius: usize, sums: &mut [f32]) {
    sums.copy_from_slice(row);
    let width = row.len();
    for shift in 1..=radius.min(width.saturating_sub(1)) {
        sums[shift..].iter_mut().zip(row).for_each(|(sum, v)| *sum += v);
        sums[..width - shift].iter_mut().zip(&row[shift..]).for_each(|(sum, v)| *sum += v);
    }
}

/// From here on [`falling`] is 0.
const FALLEN: f32 = 8.0;

/// exp(-x), nearly.
fn falling(x: f32) -> f32 {
    let base = (1.0 - x / FALLEN).max(0.0);
    let fourth = base * base * (base * base);
    fourth * fourth
}
