//! Sums over a tile's passes: as few times through its memory as can be, since of a large picture a batch may be one pass.

/// Adds up parts that single precision holds; in double precision, where there is more than one.
#[derive(Default)]
pub(super) struct Parts {
    first: Vec<f32>,
    total: Option<Vec<f64>>,
}

impl Parts {
    /// Adds one; all are of the same length.
    pub(super) fn add(&mut self, part: Vec<f32>) {
        if self.first.is_empty() {
            self.first = part;
            return;
        }
        let total = self.total.get_or_insert_with(|| self.first.iter().map(|&v| f64::from(v)).collect());
        total.iter_mut().zip(part).for_each(|(t, v)| *t += f64::from(v));
    }

    /// Their sum.
    pub(super) fn sum(self) -> Vec<f32> {
        self.total.map_or(self.first, |total| total.into_iter().map(|v| v as f32).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_summed_in_double_precision_and_one_is_left_as_it_is() {
        let sum = |parts: &[f32]| {
            let mut sums = Parts::default();
            parts.iter().for_each(|&v| sums.add(vec![v, 0.1]));
            sums.sum()
        };
        assert_eq!(sum(&[0.3]), [0.3, 0.1]);
        // In single precision each 1 would be lost.
        assert_eq!(sum(&[33554432.0, 1.0, 1.0, 1.0, 1.0])[0], 33554436.0);
    }
}
