//! Non-local means: weights from how alike the surroundings of two pixels are, measured against their noise (F. Rousselle, C. Knaus & M. Zwicker,
//! "Adaptive Rendering with Non-Local Means Filtering", ACM TOG 31(6), 2012, equations 3 to 5), and how alike what is seen there.
//!
//! Two halves of the samples filter each other: the weights for the one come from the other, so that they know nothing of its noise, and a pixel that is
//! bright by chance is spread like any other.

use super::planes::{Size, box_mean, plane};
use super::rows::{self, COLUMNS, LANES, RADIUS, SIDE, WIDTHS};
use super::tile::{self, HEIGHT, MARGIN, Tile, WIDTH, Window};
use rayon::prelude::*;
use std::array::from_fn;
use std::ops::RangeInclusive;

/// Variances vary from pixel to pixel as batches have them; how large they are is measured over squares of twice this and one pixels.
const SCALE_RADIUS: usize = 4;

/// Planes of both halves.
pub type Halves = [Vec<Vec<f32>>; 2];

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

/// What weights are made of; patches have `PATCH` pixels to every side, 2 at most.
#[derive(Debug)]
pub struct Kernel<'a, const PATCH: usize> {
    /// Pixels.
    pub size: Size,
    /// Where patches are compared.
    pub guides: &'a [Guide],
    /// What must be alike, too.
    pub features: &'a [&'a Feature],
    /// Differences count the less, the larger these: k of the paper, a picture for each.
    pub widths: [f32; WIDTHS],
    /// Pixels to every side that a pixel may be like, [`RADIUS`] at most.
    pub reach: usize,
}

/// Tiles of `SIDE` offsets in a row.
type Row = Vec<Tile>;
/// Sums of a tile, for each of the widths.
type Sums = [[[[f32; LANES]; WIDTHS]; WIDTH / LANES]; HEIGHT];

impl<const PATCH: usize> Kernel<'_, PATCH> {
    /// Filters both halves of `planes` relative to those of `base`, once for each of the widths; all planes by the same weights.
    pub fn filter(&self, planes: &Halves, base: [&[f32]; 2]) -> [Halves; WIDTHS] {
        let Size { width, height } = self.size;
        let mut filtered: [Halves; WIDTHS] =
            from_fn(|_| [0, 1].map(|half| planes[half].iter().map(|_| vec![0.0; self.size.pixels()]).collect()));
        let mut strips: Vec<Vec<&mut [f32]>> = (0..height.div_ceil(HEIGHT)).map(|_| Vec::new()).collect();
        for plane in filtered.iter_mut().flatten().flatten() {
            strips.iter_mut().zip(plane.chunks_mut(HEIGHT * width)).for_each(|(strip, rows)| strip.push(rows));
        }
        strips.into_par_iter().enumerate().for_each(|(i, mut strip)| {
            for x in (0..width).step_by(WIDTH) {
                let mut rows = strip.iter_mut();
                let sums = self.tile_sums(planes, base, (x, i * HEIGHT));
                for k in 0..WIDTHS {
                    for (half, base) in base.iter().enumerate() {
                        let (of_base, sums) = sums[half].split_last().expect("the last is the base");
                        for (sums, rows) in sums.iter().zip(&mut rows) {
                            for (y, row) in rows.chunks_exact_mut(width).enumerate() {
                                let base = &base[(i * HEIGHT + y) * width + x..];
                                for (at, (out, base)) in row[x..].iter_mut().zip(base).take(WIDTH).enumerate() {
                                    // The pixel itself has a weight of 1.
                                    let of = |sums: &Sums| sums[y][at / LANES][k][at % LANES];
                                    *out = of(sums) / of(of_base) * base;
                                }
                            }
                        }
                    }
                }
            }
        });
        filtered
    }

    /// Rows, and columns, that pixels are compared with; [`RADIUS`] is their own.
    fn offsets(&self) -> RangeInclusive<usize> {
        RADIUS - self.reach..=RADIUS + self.reach
    }

    /// Weighted sums over the surroundings of the pixels of the tile at `corner`, of both halves of all planes and of the base.
    fn tile_sums(&self, planes: &Halves, base: [&[f32]; 2], corner: (usize, usize)) -> [Vec<Sums>; 2] {
        let window = |plane: &[f32]| Window::new(self.size, plane, corner);
        let guides: Vec<_> =
            self.guides.iter().map(|g| ([0, 1].map(|half| window(&g.halves[half])), window(&g.variance))).collect();
        let features: Vec<_> = self.features.iter().map(|feature| (window(&feature.mean), window(&feature.variance))).collect();
        let outside = Window::outside(self.size, corner);
        let data = [0, 1].map(|half| {
            let planes = planes[half].iter().map(|plane| window(plane));
            planes.chain([window(base[half])]).collect::<Vec<Window>>()
        });
        let mut sums = [0, 1].map(|half| vec![[[[[0.0; LANES]; WIDTHS]; WIDTH / LANES]; HEIGHT]; data[half].len()]);
        let mut seen = vec![[[0.0; WIDTH]; HEIGHT]; SIDE];
        let mut distances = [seen.clone(), seen.clone()];
        for dy in self.offsets() {
            self.feature_distances(&features, &outside, dy, &mut seen);
            self.distances(&guides, dy, &mut distances);
            for (half, sums) in sums.iter_mut().enumerate() {
                self.add(&distances[1 - half], &seen, &data[half], dy, sums);
            }
        }
        sums
    }

    /// How far patches are apart from those `dy` rows and any columns away, of both halves: mean over guides, each counting from 0 on.
    fn distances(&self, guides: &[([Window; 2], Window)], dy: usize, distances: &mut [Row; 2]) {
        // Differences of many guides that are small and alike are one that is not.
        let weight = 1.0 / ((guides.len() as f32).sqrt() * (2 * PATCH + 1).pow(2) as f32);
        distances.iter_mut().flatten().flatten().for_each(|row| row.fill(0.0));
        let mut across = [[[0.0; WIDTH]; tile::ROWS]; 2];
        let (mut noise, mut share, mut apart) = ([0.0; COLUMNS], [0.0; COLUMNS], [0.0; COLUMNS]);
        for (values, variance) in guides {
            for dx in self.offsets() {
                for i in 0..HEIGHT + 2 * PATCH {
                    let (row, column) = (MARGIN - PATCH + i, MARGIN - PATCH);
                    let (other_row, other_column) = (row + dy - RADIUS, column + dx - RADIUS);
                    rows::add_noise(variance.at(row, column), variance.at(other_row, other_column), &mut noise, &mut share);
                    for (values, across) in values.iter().zip(&mut across) {
                        rows::compare(values.at(row, column), values.at(other_row, other_column), &noise, &share, &mut apart);
                        rows::sum_across::<PATCH>(&apart, &mut across[i]);
                    }
                }
                for (across, distances) in across.iter().zip(distances.iter_mut()) {
                    for (y, distances) in distances[dx].iter_mut().enumerate() {
                        rows::add_down::<PATCH>(&across[y..], weight, distances);
                    }
                }
            }
        }
    }

    /// Adds what pixels `dy` rows away contribute to weighted sums of `data`.
    fn add(&self, distances: &[Tile], seen: &[Tile], data: &[Window], dy: usize, sums: &mut [Sums]) {
        let scales = self.widths.map(|k| k.powi(-2));
        let mut weights = [[[0.0; LANES]; WIDTHS]; SIDE];
        for y in 0..HEIGHT {
            for block in 0..WIDTH / LANES {
                let x = block * LANES;
                for dx in self.offsets() {
                    rows::weigh(&distances[dx][y][x..], &seen[dx][y][x..], &scales, &mut weights[dx]);
                }
                for (data, sums) in data.iter().zip(sums.iter_mut()) {
                    rows::add_weighted(&weights, data.at(MARGIN + y + dy - RADIUS, MARGIN + x - RADIUS), &mut sums[y][block]);
                }
            }
        }
    }

    /// How much what is seen differs, likewise: the feature that differs most. Infinite for what is not in the picture.
    fn feature_distances(&self, features: &[(Window, Window)], outside: &Window, dy: usize, distances: &mut [Tile]) {
        for dx in self.offsets() {
            for (y, distances) in distances[dx].iter_mut().enumerate() {
                let (row, other_row, other_column) = (MARGIN + y, MARGIN + y + dy - RADIUS, MARGIN + dx - RADIUS);
                *distances = *outside.at(other_row, other_column);
                for (mean, variance) in features {
                    rows::compare_seen(
                        (mean.at(row, MARGIN), variance.at(row, MARGIN)),
                        (mean.at(other_row, other_column), variance.at(other_row, other_column)),
                        distances,
                    );
                }
            }
        }
    }
}
