//! Arithmetic on rows of a tile. These functions are not inlined: only of what they are handed does the compiler know that it does not overlap, and makes
//! vectors of it.

use super::tile::WIDTH;

/// Pixels to every side that a pixel may be like.
pub const RADIUS: usize = 9;
/// Offsets of these in a row.
pub const SIDE: usize = 2 * RADIUS + 1;
/// Columns whose differences are worked out: those of a tile and of a patch to both sides, in whole vectors.
pub const COLUMNS: usize = WIDTH + 8;
/// Pixels that are added up at once.
pub const LANES: usize = 8;
/// Pictures that a kernel makes.
pub const WIDTHS: usize = 3;
/// What a feature, whose range is 1, may differ by even where it has no noise; and noise that is a multiple of its deviation.
const FEATURE_SPREAD: f32 = 0.06;
const FEATURE_DEVIATIONS: f32 = 6.0;

/// The noise of differences of the one row's values to the other's, and one over it.
#[inline(never)]
pub fn add_noise(v: &[f32; COLUMNS], other: &[f32; COLUMNS], noise: &mut [f32; COLUMNS], share: &mut [f32; COLUMNS]) {
    for x in 0..COLUMNS {
        // A dark pixel that is known to be dark is not like a noisy bright one, whatever the noise of that.
        noise[x] = v[x] + if other[x] < v[x] { other[x] } else { v[x] };
        share[x] = 1.0 / (f32::MIN_POSITIVE + noise[x]);
    }
}

/// Squared differences less noise, by it.
#[inline(never)]
pub fn compare(
    u: &[f32; COLUMNS],
    other: &[f32; COLUMNS],
    noise: &[f32; COLUMNS],
    share: &[f32; COLUMNS],
    apart: &mut [f32; COLUMNS],
) {
    for x in 0..COLUMNS {
        apart[x] = ((u[x] - other[x]) * (u[x] - other[x]) - noise[x]) * share[x];
    }
}

/// Sums over the columns of patches.
#[inline(never)]
pub fn sum_across<const PATCH: usize>(values: &[f32; COLUMNS], sums: &mut [f32; WIDTH]) {
    sums.copy_from_slice(&values[..WIDTH]);
    for i in 1..=2 * PATCH {
        let values = &values[i..i + WIDTH];
        for x in 0..WIDTH {
            sums[x] += values[x];
        }
    }
}

/// Adds sums over the rows of patches, of which those less than 0 count as 0.
#[inline(never)]
pub fn add_down<const PATCH: usize>(rows: &[[f32; WIDTH]], weight: f32, distances: &mut [f32; WIDTH]) {
    let mut sums = rows[0];
    for row in &rows[1..=2 * PATCH] {
        for x in 0..WIDTH {
            sums[x] += row[x];
        }
    }
    for x in 0..WIDTH {
        distances[x] += weight * if sums[x] > 0.0 { sums[x] } else { 0.0 };
    }
}

/// Weights, for each of the widths, from distances and how much what is seen differs.
#[inline(never)]
pub fn weigh(distances: &[f32], seen: &[f32], scales: &[f32; WIDTHS], weights: &mut [[f32; LANES]; WIDTHS]) {
    let (distances, seen) = (&distances[..LANES], &seen[..LANES]);
    for width in 0..WIDTHS {
        for i in 0..LANES {
            weights[width][i] = falling(distances[i] * scales[width] + seen[i]);
        }
    }
}

/// Adds values from some columns on, each of `weights` belonging to the next.
#[inline(never)]
pub fn add_weighted(
    weights: &[[[f32; LANES]; WIDTHS]; SIDE],
    values: &[f32; SIDE + LANES - 1],
    sums: &mut [[f32; LANES]; WIDTHS],
) {
    let mut added = *sums;
    for dx in 0..SIDE {
        for width in 0..WIDTHS {
            for i in 0..LANES {
                added[width][i] += weights[dx][width][i] * values[dx + i];
            }
        }
    }
    *sums = added;
}

/// Means and variances.
type Seen<'a> = (&'a [f32; WIDTH], &'a [f32; WIDTH]);

/// The greater of `distances` and how much a feature differs.
#[inline(never)]
pub fn compare_seen((u, v): Seen<'_>, (other_u, other_v): Seen<'_>, distances: &mut [f32; WIDTH]) {
    for x in 0..WIDTH {
        let noise = v[x] + if other_v[x] < v[x] { other_v[x] } else { v[x] };
        let (spread, least) = (FEATURE_DEVIATIONS * FEATURE_DEVIATIONS * noise, FEATURE_SPREAD * FEATURE_SPREAD);
        let apart = ((u[x] - other_u[x]) * (u[x] - other_u[x]) - noise) / if spread > least { spread } else { least };
        distances[x] = if apart > distances[x] { apart } else { distances[x] };
    }
}

/// exp(-x), nearly.
#[inline(always)]
fn falling(x: f32) -> f32 {
    let base = 1.0 - x / 8.0;
    let square = if base > 0.0 { base * base } else { 0.0 };
    let fourth = square * square;
    fourth * fourth
}
