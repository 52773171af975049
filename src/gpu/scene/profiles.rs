//! Profiles of lamps as one table, each a [`Profile`] with what follows it.

use crate::gpu::layout::{Profile as Head, ProfileCell, ProfileRing, ProfileSector};
use crate::scene::Profile;
use bytemuck::cast_slice;
use glam::Vec4;
use std::sync::Arc;

/// Profiles in use.
#[derive(Default)]
pub(super) struct Profiles {
    /// All their texels.
    pub texels: Vec<[u32; 4]>,
}

impl Profiles {
    /// The first texel of a profile.
    pub(super) fn add(&mut self, profile: &Arc<Profile>) -> u32 {
        let first = self.texels.len() as u32;
        let (polar, azimuth) = (profile.polar(), profile.azimuth());
        let (rings, sectors) = (polar.len() - 1, azimuth.len() - 1);
        let cells: Vec<Vec<_>> = (0..rings).map(|i| (0..sectors).map(|j| profile.cell(i, j)).collect()).collect();
        let of_rings: Vec<f64> = cells.iter().map(|ring| ring.iter().map(|cell| cell.integral).sum()).collect();
        self.push(&[Head { rings: rings as u32, sectors: sectors as u32, ..Default::default() }]);
        for (&theta, share) in polar.iter().zip(running_shares(&of_rings)) {
            let half = (0.5 * theta).sin();
            self.push(&[ProfileRing { theta: theta as f32, one_minus_cos: (2.0 * half * half) as f32, share, pad_0: 0 }]);
        }
        azimuth.iter().for_each(|&phi| self.push(&[ProfileSector { phi: phi as f32, ..Default::default() }]));
        for ring in &cells {
            let shares = running_shares(&ring.iter().map(|cell| cell.integral).collect::<Vec<_>>());
            for (cell, share) in ring.iter().zip(shares.windows(2)) {
                let pdf = cell.integral / (cell.solid_angle * profile.solid_angle());
                let corners = Vec4::from_array(cell.corners.map(|c| c as f32));
                self.push(&[ProfileCell { corners, share_from: share[0], share_to: share[1], pdf: pdf as f32, pad_0: 0 }]);
            }
        }
        first
    }

    fn push<T: bytemuck::Pod>(&mut self, record: &[T]) {
        self.texels.extend_from_slice(cast_slice(record));
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
