//! Profiles of lamps as one table (its layout: shaders/light/profile.wgsl).

use crate::scene::Profile;
use glam::Vec4;
use std::sync::Arc;

/// Profiles in use.
#[derive(Default)]
pub(super) struct Profiles {
    /// All their texels.
    pub texels: Vec<Vec4>,
}

impl Profiles {
    /// The first texel of a profile.
    pub(super) fn add(&mut self, profile: &Arc<Profile>) -> u32 {
        let first = self.texels.len() as u32;
        let (polar, azimuth) = (profile.polar(), profile.azimuth());
        let (rings, sectors) = (polar.len() - 1, azimuth.len() - 1);
        let number = |n: usize| f32::from_bits(n as u32);
        let cells: Vec<Vec<_>> = (0..rings).map(|i| (0..sectors).map(|j| profile.cell(i, j)).collect()).collect();
        let of_rings: Vec<f64> = cells.iter().map(|ring| ring.iter().map(|cell| cell.integral).sum()).collect();
        self.texels.push(Vec4::new(number(rings), number(sectors), 0.0, 0.0));
        let before = running_shares(&of_rings);
        self.texels.extend(polar.iter().zip(before).map(|(&theta, share)| {
            let half = (0.5 * theta).sin();
            Vec4::new(theta as f32, (2.0 * half * half) as f32, share, 0.0)
        }));
        self.texels.extend(azimuth.iter().map(|&phi| Vec4::new(phi as f32, 0.0, 0.0, 0.0)));
        for ring in &cells {
            let shares = running_shares(&ring.iter().map(|cell| cell.integral).collect::<Vec<_>>());
            for (cell, share) in ring.iter().zip(shares.windows(2)) {
                let pdf = cell.integral / (cell.solid_angle * profile.solid_angle());
                self.texels.push(Vec4::from_array(cell.corners.map(|c| c as f32)));
                self.texels.push(Vec4::new(share[0], share[1], pdf as f32, 0.0));
            }
        }
        first
    }
}

/// Running sums over the whole, from 0 to 1.
fn running_shares(values: &[f64]) -> Vec<f32> {
    let total: f64 = values.iter().sum();
    let mut sum = 0.0;
    let shares = values.iter().map(|v| {
        sum += v;
        if total > 0.0 { (sum / total) as f32 } else { 0.0 }
    });
    std::iter::once(0.0).chain(shares).collect()
}
