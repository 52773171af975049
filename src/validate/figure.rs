//! Means with their errors.

/// A mean with its standard error and the degrees of freedom of that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// The mean.
    pub mean: f64,
    /// Its standard error; 0 for a single value, which is then taken to be exact.
    pub error: f64,
    /// Degrees of freedom of the error.
    pub dof: f64,
}

impl Figure {
    /// Of independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        if values.len() < 2 || values.iter().all(|v| *v == values[0]) {
            return Figure { mean: values[0], error: 0.0, dof: f64::INFINITY };
        }
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Figure { mean, error: (variance / n).sqrt(), dof: n - 1.0 }
    }
}
