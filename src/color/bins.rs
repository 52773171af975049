//! XYZ from bin averages by the smoothest spectrum that has them (the "histospline").
//!
//! On a grid of cells, a whole number per bin, the reconstruction f minimises its squared second derivative, in differences, under the
//! condition that its mean over each bin is the bin's value (a discrete form of Boneva, Kendall & Stefanov, "Spline Transformations", JRSS B 33,
//! 1971). In terms of the running integral F of f this is interpolation: F is known at the bin edges, and its squared third derivative is least. So
//! the system for the other F is positive definite and has seven diagonals. f depends linearly on the bin values, hence XYZ too.

use super::cie::{self, K_M};
use crate::spectrum::Bins;
use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Observer};
use rayon::prelude::*;

/// Most cells per bin; the condition of the system grows with the sixth power of this.
const CELLS_MAX: usize = 16;

/// Weights that turn bin means (W m^-2 sr^-1 nm^-1) into XYZ: `XYZ = sum over bins of weight * mean`, with `K_m`, so Y is in cd m^-2.
/// Outside the bins' range the spectrum counts as 0.
pub fn bin_weights(bins: &Bins, observer: Observer) -> Vec<[f64; 3]> {
    let edges: Vec<f64> = (0..=bins.count).map(|i| bins.edge_nm(i)).collect();
    emission_weights(&edges, observer)
}

/// As [`bin_weights`], for one or more bins of any widths that join at `edges_nm` (increasing, one more than bins).
pub fn emission_weights(edges_nm: &[f64], observer: Observer) -> Vec<[f64; 3]> {
    weights(edges_nm, observer, &Spectrum::Constant(1.0))
}

/// Weights that turn bin means of a reflectance into the XYZ that `light` (W m^-2 sr^-1 nm^-1) reflected by it has. Outside the bins' range
/// the reflectance is that of the nearest bin.
pub fn reflection_weights(edges_nm: &[f64], observer: Observer, light: &Spectrum) -> Vec<[f64; 3]> {
    let mut all = weights(edges_nm, observer, light);
    let cmf = library::observer(observer);
    for (bin, from, to) in [(0, 0.0, edges_nm[0]), (all.len() - 1, edges_nm[edges_nm.len() - 1], f64::INFINITY)] {
        let beyond = cie::integral(cmf, light, from, to);
        all[bin] = std::array::from_fn(|i| all[bin][i] + K_M * beyond[i]);
    }
    all
}

/// XYZ of every pixel of `data`, `[pixel][bin]`, by these weights.
pub fn xyz_image(data: &[f32], weights: &[[f64; 3]]) -> Vec<[f32; 3]> {
    let pixel = |values: &[f32]| {
        let mut xyz = [0.0; 3];
        for (&value, weight) in values.iter().zip(weights) {
            for i in 0..3 {
                xyz[i] += f64::from(value) * weight[i];
            }
        }
        xyz.map(|v| v as f32)
    };
    data.par_chunks_exact(weights.len()).with_min_len(1024).map(pixel).collect()
}

fn weights(edges_nm: &[f64], observer: Observer, light: &Spectrum) -> Vec<[f64; 3]> {
    let system = RunningIntegral::new(edges_nm);
    let cmf = library::observer(observer);
    let cell_xyz: Vec<[f64; 3]> = system.x.windows(2).map(|w| cie::integral(cmf, light, w[0], w[1]).map(|v| K_M * v)).collect();
    (0..edges_nm.len().saturating_sub(1))
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

/// The factorised system for the running integral F at the cell edges that are no bin edges.
struct RunningIntegral {
    /// Cell edges, nm.
    x: Vec<f64>,
    /// The bin that begins at a cell edge, or the number of bins at the last; F is known there.
    bin_at: Vec<Option<usize>>,
    /// F[j] to F[j+3] times these are the third derivative of F, times the root of a cell's width.
    third: Vec<[f64; 4]>,
    /// Lower Cholesky factor: row i holds columns i-3 to i. Rows of known F are those of the identity.
    factor: Vec<[f64; 4]>,
}

impl RunningIntegral {
    fn new(edges_nm: &[f64]) -> Self {
        // Two means leave the slope of the smoothest function open at one bin: there is nothing to reconstruct from.
        let most = if edges_nm.len() < 3 { 1 } else { CELLS_MAX };
        let (mut x, mut bin_at) = (Vec::new(), Vec::new());
        for (bin, edge) in edges_nm.windows(2).enumerate() {
            let cells = ((edge[1] - edge[0]).ceil() as usize).clamp(1, most);
            for cell in 0..cells {
                x.push(edge[0] + (edge[1] - edge[0]) * cell as f64 / cells as f64);
                bin_at.push((cell == 0).then_some(bin));
            }
        }
        x.extend(edges_nm.last());
        bin_at.push(Some(edges_nm.len().saturating_sub(1)));

        // In units of a mean cell, the system's numbers are near 1.
        let unit = (x[x.len() - 1] - x[0]) / (x.len() - 1) as f64;
        let third: Vec<[f64; 4]> = x
            .windows(4)
            .map(|w| {
                let width = (w[3] - w[0]) / (3.0 * unit);
                let divisor = |p: usize| (0..4).filter(|&q| q != p).map(|q| (w[p] - w[q]) / unit).product::<f64>();
                std::array::from_fn(|p| 6.0 * width.sqrt() / divisor(p))
            })
            .collect();
        let mut a = vec![[0.0; 4]; x.len()];
        for (j, third) in third.iter().enumerate() {
            for p in 0..4 {
                for q in 0..=p {
                    if bin_at[j + p].is_none() && bin_at[j + q].is_none() {
                        a[j + p][3 - (p - q)] += third[p] * third[q];
                    }
                }
            }
        }
        for i in 0..x.len() {
            if bin_at[i].is_some() {
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
        RunningIntegral { x, bin_at, third, factor: a }
    }

    /// f in every cell for mean 1 in `bin` and 0 in the others.
    fn reconstruct(&self, bin: usize) -> Vec<f64> {
        // F in units of the bin's width.
        let known = |j: usize| self.bin_at[j].map(|at| if at > bin { 1.0 } else { 0.0 });
        let n = self.x.len();
        let mut f: Vec<f64> = (0..n).map(|j| known(j).unwrap_or(0.0)).collect();
        // The known F moved to the right-hand side.
        for (j, third) in self.third.iter().enumerate() {
            let fixed: f64 = (0..4).filter_map(|p| Some(third[p] * known(j + p)?)).sum();
            for p in (0..4).filter(|p| self.bin_at[j + p].is_none()) {
                f[j + p] -= third[p] * fixed;
            }
        }
        for i in 0..n {
            let dot: f64 = (i.saturating_sub(3)..i).map(|m| self.factor[i][3 - (i - m)] * f[m]).sum();
            f[i] = (f[i] - dot) / self.factor[i][3];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n.min(i + 4)).map(|m| self.factor[m][3 - (m - i)] * f[m]).sum();
            f[i] = (f[i] - dot) / self.factor[i][3];
        }
        let at = |bin: usize| self.bin_at.iter().position(|b| *b == Some(bin));
        let width = match (at(bin), at(bin + 1)) {
            (Some(lo), Some(hi)) => self.x[hi] - self.x[lo],
            _ => 0.0,
        };
        f.windows(2).zip(self.x.windows(2)).map(|(f, x)| width * (f[1] - f[0]) / (x[1] - x[0])).collect()
    }
}
