//! How much light single scattering off rough surfaces loses, tabulated, and so what the compensating lobe must give back.
//!
//! With `E(mu)` the single-scatter albedo, the tables hold `m(mu) = 1 - E(mu)` and `M = 2 int m mu dmu`. A lobe proportional to
//! `m(mu_i) m(mu_o) / M` (Kulla & Conty 2017, sec. "Multiple scattering") gives back exactly what is missing, and is reciprocal.

use super::fresnel;
use super::ggx::{self, Width};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Nodes in the cosine, at `(j + 0.5) / MU_NODES`.
pub const MU_NODES: usize = 32;
/// Nodes in the relative index, log-spaced over `[1 / ETA_MAX, ETA_MAX]`, ends included.
pub const ETA_NODES: usize = 64;
/// Nodes in the cosine of the azimuth of rough metal with a grain, even from 0 (along y) to 1 (along x).
pub const GRAIN_NODES: usize = 16;
/// Greatest relative index of the tables; beyond it they are clamped.
pub const ETA_MAX: f64 = 3.0;
/// Below this mean loss there is no compensating lobe.
pub const MIN_MEAN: f64 = 1e-7;

/// Loss of one GGX roughness: of a dielectric over cosine and relative index, or of a perfect mirror over the cosine and, where that matters, azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyTable {
    /// `m = 1 - E`, each the mean over the cell of cosines around its node, `[eta][mu]` with `MU_NODES` to a row; one row for a mirror,
    /// or with a grain `[azimuth][mu]`.
    pub missing: Vec<f64>,
    /// `M = 2 int m mu dmu` of the interpolated row, per row; of a mirror with a grain the mean over all azimuths.
    pub mean: Vec<f64>,
}

/// What has a table: facets of one GGX width, as light meets them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Facets {
    /// Of glass, perhaps with an ideal anti-reflection coating.
    Glass {
        /// Width.
        alpha: f64,
        /// Whether it has that.
        coated: bool,
    },
    /// Of a coat, 0 if it is smooth.
    Coat {
        /// Width.
        alpha: f64,
    },
    /// Of metal, or of a pane, whose table is that of a mirror.
    Mirror {
        /// Width.
        alpha: f64,
    },
    /// Likewise with a grain.
    Brushed {
        /// Widths along it and across.
        width: Width,
    },
}

impl Facets {
    /// Of metal or of a pane of width `alpha`, with this width if it has a grain.
    pub fn of_mirror(alpha: f64, brushed: Option<Width>) -> Self {
        brushed.map_or(Facets::Mirror { alpha }, |width| Facets::Brushed { width })
    }
}

/// Facets per side of the quadrature grid, and cosines per node.
const AZIMUTHS: usize = 10;
const HEIGHTS: usize = 16;
const COSINES: usize = 8;
const FACETS: f64 = (AZIMUTHS * HEIGHTS * COSINES) as f64;

impl EnergyTable {
    /// The table of these facets.
    pub fn new(facets: Facets) -> Self {
        match facets {
            Facets::Glass { alpha, coated: false } => Self::dielectric(alpha),
            Facets::Glass { alpha, coated: true } => Self::antireflective(alpha),
            Facets::Coat { alpha } => Self::coat(alpha),
            Facets::Mirror { alpha } => Self::conductor(alpha),
            Facets::Brushed { width } => Self::brushed(width),
        }
    }

    /// The table of a dielectric interface with GGX width `alpha`: rows are far index over near index.
    pub fn dielectric(alpha: f64) -> Self {
        Self::with_means(interface(alpha, true, fresnel::dielectric))
    }

    /// Likewise with an ideal anti-reflection coating.
    pub fn antireflective(alpha: f64) -> Self {
        Self::with_means(interface(alpha, true, fresnel::antireflective))
    }

    /// What a coat with GGX width `alpha` lets in ([`super::coat`]): all that single scattering does not reflect. Of a smooth one (0) the means alone.
    pub fn coat(alpha: f64) -> Self {
        if alpha > 0.0 {
            return Self::with_means(interface(alpha, false, fresnel::dielectric));
        }
        let mean = (0..ETA_NODES).map(|e| 1.0 - fresnel::average_dielectric(node_eta(e))).collect();
        Self { missing: vec![0.0; ETA_NODES * MU_NODES], mean }
    }

    /// The table of a mirror (Fresnel reflectance 1) with GGX width `alpha`.
    pub fn conductor(alpha: f64) -> Self {
        let reflected = |j| mean_over_facets(alpha.into(), DVec2::X, j, |wo, m| reflected_share(alpha, wo, m));
        Self::with_means((0..MU_NODES).map(|j| 1.0 - reflected(j)).collect())
    }

    /// Likewise with widths that differ along x and y. Losses grow with the cosine of the azimuth, which is what makes facets look wide.
    pub fn brushed(width: Width) -> Self {
        let row = |a: usize| {
            let x = a as f64 / (GRAIN_NODES - 1) as f64;
            let y = ((1.0 - x) * (1.0 + x)).sqrt();
            // Facets on one side of the plane of incidence are those on the other, mirrored.
            let reflected = |y, j| mean_over_facets(width, DVec2::new(x, y), j, |wo, m| reflected_share(width, wo, m));
            Self::with_means((0..MU_NODES).map(|j| 1.0 - 0.5 * (reflected(y, j) + reflected(-y, j))).collect())
        };
        let rows: Vec<Self> = (0..GRAIN_NODES).into_par_iter().map(row).collect();
        let mean = rows.iter().enumerate().map(|(a, row)| share_of_azimuth(a) * row.mean[0]).sum();
        Self { missing: rows.into_iter().flat_map(|row| row.missing).collect(), mean: vec![mean] }
    }

    fn with_means(mut missing: Vec<f64>) -> Self {
        missing.iter_mut().for_each(|m| *m = m.clamp(0.0, 1.0));
        let mean = missing.chunks(MU_NODES).map(mean_of_row).collect();
        Self { missing, mean }
    }

    /// `m(mu)` at relative index `eta` (any number for a mirror): bilinear, clamped at the ends.
    pub fn missing_at(&self, mu: f64, eta: f64) -> f64 {
        let (e0, e1, te) = self.row(eta);
        let at = |e: usize| in_row(&self.missing[e * MU_NODES..][..MU_NODES], mu);
        at(e0) * (1.0 - te) + at(e1) * te
    }

    /// `m` of a mirror, with or without a grain, for light along `w`.
    pub fn missing_towards(&self, w: DVec3) -> f64 {
        let rows: Vec<&[f64]> = self.missing.chunks(MU_NODES).collect();
        let x = w.x.abs() / w.x.hypot(w.y).max(f64::MIN_POSITIVE) * (rows.len() - 1) as f64;
        let a = (x as usize).min(rows.len().saturating_sub(2));
        let here = in_row(rows[a], w.z);
        rows.get(a + 1).map_or(here, |next| here + (in_row(next, w.z) - here) * (x - a as f64))
    }

    /// `M` at relative index `eta`: the integral of [`missing_at`](Self::missing_at), exactly.
    pub fn mean_at(&self, eta: f64) -> f64 {
        let (e0, e1, t) = self.row(eta);
        self.mean[e0] * (1.0 - t) + self.mean[e1] * t
    }

    /// Rows on either side of `eta` and the weight of the second.
    fn row(&self, eta: f64) -> (usize, usize, f64) {
        if self.mean.len() == 1 {
            return (0, 0, 0.0);
        }
        let x = (0.5 * (eta.ln() / ETA_MAX.ln() + 1.0)).clamp(0.0, 1.0) * (ETA_NODES - 1) as f64;
        let e = (x as usize).min(ETA_NODES - 2);
        (e, e + 1, x - e as f64)
    }
}

/// A row at cosine `mu`: linear, clamped at the ends.
fn in_row(row: &[f64], mu: f64) -> f64 {
    let x = (mu * MU_NODES as f64 - 0.5).clamp(0.0, (MU_NODES - 1) as f64);
    let j = (x as usize).min(MU_NODES - 2);
    let t = x - j as f64;
    row[j] * (1.0 - t) + row[j + 1] * t
}

/// The mean over all azimuths of what is 1 at node `a` of their cosine and falls linearly to 0 at its neighbours.
fn share_of_azimuth(a: usize) -> f64 {
    let steps = (GRAIN_NODES - 1) as f64;
    // int (x - b) / (end - b) dphi with x = cos phi, between a neighbour b and the node.
    let towards = |b: f64, end: f64| {
        let (from, to) = (b.min(end).acos(), b.max(end).acos());
        ((from.sin() - to.sin()) - b * (from - to)) / (end - b)
    };
    let at = |i: usize| i as f64 / steps;
    let below = if a > 0 { towards(at(a - 1), at(a)) } else { 0.0 };
    let above = if a + 1 < GRAIN_NODES { towards(at(a + 1), at(a)) } else { 0.0 };
    (below + above) / (0.5 * PI)
}

/// The cosine of node `j`.
pub fn node_mu(j: usize) -> f64 {
    (j as f64 + 0.5) / MU_NODES as f64
}

/// The relative index of node `e`.
pub fn node_eta(e: usize) -> f64 {
    ETA_MAX.powf(2.0 * e as f64 / (ETA_NODES - 1) as f64 - 1.0)
}

fn direction(mu: f64, azimuth: DVec2) -> DVec3 {
    (azimuth * ((1.0 - mu) * (1.0 + mu)).sqrt()).extend(mu)
}

/// The mean of `f(wo, m)` over the cell of cosines around node `j`, by projected solid angle, and over the facets `m` seen from each: the
/// midpoint rule in one half of the sampling square, symmetric about the plane of x and z. Near the critical angle the loss has a peak narrower than
/// a cell; its mean over the cell keeps its energy, where its value at the node would not.
fn mean_over_facets(width: Width, azimuth: DVec2, j: usize, mut f: impl FnMut(DVec3, DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for c in 0..COSINES {
        // Equal steps of mu^2 are equal projected solid angles.
        let (lo, hi) = ((j * j) as f64, ((j + 1) * (j + 1)) as f64);
        let mu = (lo + (hi - lo) * (c as f64 + 0.5) / COSINES as f64).sqrt() / MU_NODES as f64;
        let wo = direction(mu, azimuth);
        // Each cosine has its own displacement of the grid, so that together they make a finer one.
        let shift = (c as f64 + 0.5) / COSINES as f64;
        for a in 0..AZIMUTHS {
            for h in 0..HEIGHTS {
                let across = (shift * 3.0).fract();
                let u = [0.5 * (a as f64 + across) / AZIMUTHS as f64, (h as f64 + shift) / HEIGHTS as f64];
                sum += f(wo, ggx::sample_vndf(width, wo, u));
            }
        }
    }
    sum / FACETS
}

/// `G2 / G1` of the reflection at `m`, 0 if it goes below the surface.
fn reflected_share(alpha: impl Into<Width>, wo: DVec3, m: DVec3) -> f64 {
    let alpha = alpha.into();
    let wi = fresnel::reflect(wo, m);
    if wi.z > 0.0 { ggx::g2(alpha, wo, wi) / ggx::g1(alpha, wo) } else { 0.0 }
}

/// `1 - E`, `[eta][mu]`, of what single scattering reflects and, if `transmits`, refracts.
fn interface(alpha: f64, transmits: bool, reflectance: fn(f64, f64) -> f64) -> Vec<f64> {
    let columns: Vec<Vec<f64>> =
        (0..MU_NODES).into_par_iter().map(|j| interface_column(alpha, transmits, reflectance, j)).collect();
    (0..ETA_NODES).flat_map(|e| columns.iter().map(move |c| c[e])).collect()
}

/// The same over all eta nodes around cosine node `j`: the facets are the same for all.
fn interface_column(alpha: f64, transmits: bool, reflectance: fn(f64, f64) -> f64, j: usize) -> Vec<f64> {
    let etas: [f64; ETA_NODES] = std::array::from_fn(node_eta);
    let mut albedo = [0.0; ETA_NODES];
    mean_over_facets(alpha.into(), DVec2::X, j, |wo, m| {
        let inv_g1 = 1.0 / ggx::g1(alpha, wo);
        let reflected = reflected_share(alpha, wo, m);
        for (sum, eta) in albedo.iter_mut().zip(etas) {
            let f = reflectance(wo.dot(m), eta);
            *sum += f * reflected;
            if transmits && let Some(wi) = fresnel::refract(wo, m, eta).filter(|wi| wi.z < 0.0) {
                *sum += (1.0 - f) * ggx::g2(alpha, wo, wi) * inv_g1;
            }
        }
        0.0
    });
    albedo.iter().map(|sum| 1.0 - sum / FACETS).collect()
}

/// `2 int m mu dmu` of the piecewise linear row, constant beyond its first and last node.
fn mean_of_row(row: &[f64]) -> f64 {
    let h = 1.0 / MU_NODES as f64;
    let (first, last) = (node_mu(0), node_mu(MU_NODES - 1));
    let mut sum = row[0] * first * first + row[MU_NODES - 1] * (1.0 - last * last);
    for (j, pair) in row.windows(2).enumerate() {
        let (x0, x1) = (node_mu(j), node_mu(j + 1));
        // The integrand is a parabola: Simpson's rule is exact.
        sum += 2.0 * h / 6.0 * (pair[0] * x0 + (pair[0] + pair[1]) * (x0 + x1) + pair[1] * x1);
    }
    sum
}
