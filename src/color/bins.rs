//! XYZ from bin averages by the smoothest spectrum that has them (the "histospline").
//!
//! On a grid of equal cells, a whole number per bin, the reconstruction f minimises the sum of squared second differences under the condition
//! that its mean over each bin is the bin's value (a discrete form of Boneva, Kendall & Stefanov, "Spline Transformations", JRSS B 33, 1971).
//! In terms of the running sum F of f this is interpolation: F is known at the bin edges, and its squared third differences are least. So
//! the system for the other F is positive definite and has seven diagonals. f depends linearly on the bin values, hence XYZ too.

use super::cie::{self, K_M};
use crate::scene::Bins;
use crate::spectrum::library::{self, Observer};

/// Most cells per bin; the condition of the system grows with the sixth power of this.
const CELLS_MAX: usize = 16;

/// Weights that turn bin means (W m^-2 sr^-1 nm^-1) into XYZ: `XYZ = sum over bins of weight * mean`, with `K_m`, so Y is in cd m^-2.
/// Outside the bins' range the spectrum counts as 0.
pub fn bin_weights(bins: &Bins, observer: Observer) -> Vec<[f64; 3]> {
    let n = bins.count as usize;
    // Two means leave the slope of the smoothest function open at one bin: there is nothing to reconstruct from.
    let per_bin = if n < 2 { 1 } else { (bins.width_nm().ceil() as usize).clamp(1, CELLS_MAX) };
    let cells = n * per_bin;
    let edge = |j: usize| bins.min_nm + (bins.max_nm - bins.min_nm) * j as f64 / cells as f64;
    let cmf = library::observer(observer);
    let cell_xyz: Vec<[f64; 3]> = (0..cells).map(|j| cie::integral(cmf, edge(j), edge(j + 1)).map(|v| K_M * v)).collect();

    let system = RunningSum::new(n, per_bin);
    (0..n)
        .map(|bin| {
            let f = system.reconstruct(bin);
            let mut weight = [0.0; 3];
            for (f, xyz) in f.iter().zip(&cell_xyz) {
                for i in 0..3 {
                    weight[i] += f * xyz[i];
                }
            }
            weight
        })
        .collect()
}

/// The factorised system for the running sum F at the cell edges that are no bin edges.
struct RunningSum {
    bins: usize,
    per_bin: usize,
    /// Lower Cholesky factor: row i holds columns i-3 to i. Rows of known F are those of the identity.
    factor: Vec<[f64; 4]>,
}

/// Third difference F[j] - ... + F[j+3].
const THIRD: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];

impl RunningSum {
    fn new(bins: usize, per_bin: usize) -> Self {
        let edges = bins * per_bin + 1;
        let mut a = vec![[0.0; 4]; edges];
        for j in 0..edges.saturating_sub(3) {
            for p in 0..4 {
                for q in 0..=p {
                    if (j + p) % per_bin != 0 && (j + q) % per_bin != 0 {
                        a[j + p][3 - (p - q)] += THIRD[p] * THIRD[q];
                    }
                }
            }
        }
        for i in 0..edges {
            if i % per_bin == 0 {
                a[i][3] = 1.0;
            }
            // Cholesky-Banachiewicz, in place.
            for k in i.saturating_sub(3)..=i {
                let from = i.saturating_sub(3);
                let dot: f64 = (from..k).filter(|&m| m + 3 >= k).map(|m| a[i][3 - (i - m)] * a[k][3 - (k - m)]).sum();
                let rest = a[i][3 - (i - k)] - dot;
                a[i][3 - (i - k)] = if k == i { rest.sqrt() } else { rest / a[k][3] };
            }
        }
        RunningSum { bins, per_bin, factor: a }
    }

    /// f in every cell for mean 1 in `bin` and 0 in the others.
    fn reconstruct(&self, bin: usize) -> Vec<f64> {
        let edges = self.bins * self.per_bin + 1;
        let known = |j: usize| if j > bin * self.per_bin { 1.0 } else { 0.0 };
        let mut x: Vec<f64> = (0..edges).map(|j| if j % self.per_bin == 0 { known(j) } else { 0.0 }).collect();
        // The known F moved to the right-hand side.
        for j in 0..edges.saturating_sub(3) {
            let fixed: f64 = (0..4).filter(|p| (j + p) % self.per_bin == 0).map(|p| THIRD[p] * known(j + p)).sum();
            for p in (0..4).filter(|p| (j + p) % self.per_bin != 0) {
                x[j + p] -= THIRD[p] * fixed;
            }
        }
        for i in 0..edges {
            let dot: f64 = (i.saturating_sub(3)..i).map(|m| self.factor[i][3 - (i - m)] * x[m]).sum();
            x[i] = (x[i] - dot) / self.factor[i][3];
        }
        for i in (0..edges).rev() {
            let dot: f64 = (i + 1..edges.min(i + 4)).map(|m| self.factor[m][3 - (m - i)] * x[m]).sum();
            x[i] = (x[i] - dot) / self.factor[i][3];
        }
        // F counts bins; f is a mean over a cell.
        x.windows(2).map(|w| (w[1] - w[0]) * self.per_bin as f64).collect()
    }
}
