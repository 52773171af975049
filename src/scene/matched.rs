//! Indices that match.

use super::{Interior, Material, Scene};
use crate::spectrum::Ior;
use std::collections::HashMap;

/// Volumes of indices that differ, by their value at the film's shortest wavelength.
#[derive(Default)]
pub(super) struct Indices(HashMap<i64, Vec<usize>>);

impl Indices {
    /// Gives volume `new` the very same index as the first that matches ([`Ior::matches`]), however each was written, and returns that first, or itself.
    /// From here on indices are equal or they differ, and a boundary between equal ones is not there.
    pub fn add(&mut self, interiors: &mut [Interior], new: usize, (lo, hi): (f64, f64)) -> usize {
        // What matches is at most one cell apart.
        let cell = (interiors[new].ior.eval(lo) / 1e-5).round() as i64;
        let near = (cell - 1..=cell + 1).filter_map(|cell| self.0.get(&cell)).flatten().copied();
        let Some(first) = near.filter(|&i| interiors[i].ior.matches(&interiors[new].ior, lo, hi)).min() else {
            self.0.entry(cell).or_default().push(new);
            return new;
        };
        interiors[new].ior = interiors[first].ior.clone();
        first
    }
}

impl Scene {
    /// A clear pane of the index around it is nothing.
    pub(super) fn match_panes(&mut self) {
        let (lo, hi) = (self.film.bins.min_nm, self.film.bins.max_nm);
        for (i, material) in self.materials.iter_mut().enumerate() {
            if let Material::ThinDielectric { ior, tint: None, depth, .. } = material
                && depth.is_zero()
                && !self.thin_films.contains_key(&i)
                && Ior::constant(1.0).matches(ior, lo, hi)
            {
                *material = Material::NOTHING;
            }
        }
    }
}
