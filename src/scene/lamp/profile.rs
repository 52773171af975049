//! The measured distribution of a lamp's light: intensity by direction, bilinear in polar angle and azimuth.

use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// A lamp's distribution, in the lamp's own frame: polar angles from its axis `+Z` (straight down as it hangs), azimuths from `+X` towards `+Y`.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Polar angles, rad, rising within 0 to pi; nothing shines outside them.
    polar: Vec<f64>,
    /// Azimuths, rad, rising from 0 to 2 pi.
    azimuth: Vec<f64>,
    /// Intensities over the greatest, azimuth by azimuth; the last azimuth repeats the first.
    relative: Vec<f64>,
    /// Greatest intensity, cd.
    peak_cd: f64,
}

/// Directions between two polar angles and two azimuths.
#[derive(Debug, Clone, Copy)]
pub struct ProfileCell {
    /// Relative intensities: (polar, azimuth) lower lower, upper lower, lower upper, upper upper.
    pub corners: [f64; 4],
    /// Integral of the relative intensity over its solid angle, sr.
    pub integral: f64,
    /// Its solid angle, sr.
    pub solid_angle: f64,
}

impl Profile {
    /// From angles in rad that rise and intensities in cd, azimuth by azimuth; `None` if all is dark.
    pub(in crate::scene) fn new(polar: Vec<f64>, azimuth: Vec<f64>, candela: &[f64]) -> Option<Self> {
        let peak_cd = candela.iter().copied().fold(0.0, f64::max);
        let relative = candela.iter().map(|c| c / peak_cd).collect();
        let profile = Self { polar, azimuth, relative, peak_cd };
        (peak_cd > 0.0 && profile.solid_angle() > 0.0).then_some(profile)
    }

    /// Polar angles between which intensities are interpolated, rad.
    pub fn polar(&self) -> &[f64] {
        &self.polar
    }

    /// Azimuths between which intensities are interpolated, rad.
    pub fn azimuth(&self) -> &[f64] {
        &self.azimuth
    }

    /// Greatest intensity in the file, cd.
    pub fn peak_cd(&self) -> f64 {
        self.peak_cd
    }

    /// Flux over the greatest intensity: the integral of the relative intensity, sr; exact for what [`Profile::eval`] interpolates.
    pub fn solid_angle(&self) -> f64 {
        (0..self.polar.len() - 1)
            .flat_map(|i| (0..self.azimuth.len() - 1).map(move |j| (i, j)))
            .map(|(i, j)| self.cell(i, j).integral)
            .sum()
    }

    /// The directions between polar angles `i`, `i + 1` and azimuths `j`, `j + 1`.
    pub fn cell(&self, i: usize, j: usize) -> ProfileCell {
        let n = self.polar.len();
        let corners = [j * n + i, j * n + i + 1, (j + 1) * n + i, (j + 1) * n + i + 1].map(|at| self.relative[at]);
        let (t0, t1) = (self.polar[i], self.polar[i + 1]);
        // Integrals of sin t, and of (t - t0) / (t1 - t0) sin t.
        let whole = 2.0 * (0.5 * (t0 + t1)).sin() * (0.5 * (t1 - t0)).sin();
        let upper = (t1.sin() - t0.sin()) / (t1 - t0) - t1.cos();
        let across = self.azimuth[j + 1] - self.azimuth[j];
        let [a, b, c, d] = corners;
        let integral = 0.5 * across * ((a + c) * (whole - upper) + (b + d) * upper);
        ProfileCell { corners, integral, solid_angle: across * whole }
    }

    /// Relative intensity, at most 1, along `d` (unit, lamp's frame).
    pub fn eval(&self, d: DVec3) -> f64 {
        let theta = d.x.hypot(d.y).atan2(d.z);
        let phi = d.y.atan2(d.x).rem_euclid(2.0 * PI);
        if theta < self.polar[0] || theta > self.polar[self.polar.len() - 1] {
            return 0.0;
        }
        let find = |angles: &[f64], x: f64| {
            let i = (angles.partition_point(|&a| a <= x)).clamp(1, angles.len() - 1) - 1;
            (i, ((x - angles[i]) / (angles[i + 1] - angles[i])).clamp(0.0, 1.0))
        };
        let ((i, s), (j, t)) = (find(&self.polar, theta), find(&self.azimuth, phi));
        let [a, b, c, d] = self.cell(i, j).corners;
        (1.0 - t) * (a + s * (b - a)) + t * (c + s * (d - c))
    }

    /// Greatest polar angle at which anything shines, rad.
    pub fn reach(&self) -> f64 {
        let n = self.polar.len();
        let lit = |i: usize| self.relative.iter().skip(i).step_by(n).any(|&r| r > 0.0);
        let last = (0..n).rev().find(|&i| lit(i)).unwrap_or(0);
        self.polar[(last + 1).min(n - 1)]
    }
}

/// World directions of a lamp's axes (columns X, Y, Z), whose `Z` is `direction`: hung straight down its `X` is the world's, turned by `rotation`
/// (rad, anticlockwise seen from above) about the lamp's axis; other directions are reached from there by the shortest turn.
pub(in crate::scene) fn lamp_axes(direction: DVec3, rotation: f64) -> glam::DMat3 {
    let hung = dvec3(0.0, -1.0, 0.0);
    let x = dvec3(rotation.cos(), 0.0, -rotation.sin());
    let turn = glam::DQuat::from_rotation_arc(hung, direction);
    let x = turn * x;
    glam::DMat3::from_cols(x, x.cross(direction), direction)
}
