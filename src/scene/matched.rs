//! Volumes of matched index.

use super::{Material, Scene};
use crate::spectrum::Ior;
use std::collections::HashMap;

impl Scene {
    /// Gives volumes of matched index ([`Ior::matches`]) the very same one, however each was written: that of the first. From here on indices are equal or
    /// they differ, and a boundary between equal ones is not there. Nor is a pane of the index around it.
    pub(super) fn match_indices(&mut self) {
        let (lo, hi) = (self.film.bins.min_nm, self.film.bins.max_nm);
        // What matches is at most one cell apart.
        let cell = |n: f64| (n / 1e-5).round() as i64;
        let mut firsts: HashMap<i64, Vec<usize>> = HashMap::new();
        for i in 0..self.interiors.len() {
            let at = cell(self.interiors[i].ior.eval(lo));
            let known = (at - 1..=at + 1).filter_map(|cell| firsts.get(&cell)).flatten().copied();
            match known.filter(|&j| self.interiors[j].ior.matches(&self.interiors[i].ior, lo, hi)).min() {
                Some(first) => self.interiors[i].ior = self.interiors[first].ior.clone(),
                None => firsts.entry(at).or_default().push(i),
            }
        }
        for (i, material) in self.materials.iter_mut().enumerate() {
            if let Some(ior) = material.pane()
                && !self.thin_films.contains_key(&i)
                && Ior::constant(1.0).matches(ior, lo, hi)
            {
                *material = Material::NOTHING;
            }
        }
    }
}
