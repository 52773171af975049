//! Heights of surfaces of revolution over their vertex.

/// Least and greatest heights are sought at so many radii.
const RADII: u32 = 256;

/// Height where the squared distance from the axis is `r2` and `root` = sqrt(1 - (1 + k) c^2 r^2).
pub(crate) fn sag(curvature: f64, root: f64, aspheric: &[f64], r2: f64) -> f64 {
    let terms = aspheric.iter().rev().fold(0.0, |sum, a| sum * r2 + a);
    r2 * (curvature / (1.0 + root) + terms)
}

/// dz/dr over r there.
pub(crate) fn slope_over_r(curvature: f64, root: f64, aspheric: &[f64], r2: f64) -> f64 {
    let terms = aspheric.iter().enumerate().rev().fold(0.0, |sum, (i, a)| sum * r2 + 2.0 * (i + 1) as f64 * a);
    curvature / root + terms
}

/// `z(r) = c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) + a_0 r^2 + a_1 r^4 + ...` (ISO 10110-12).
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// c, m^-1.
    pub curvature: f64,
    /// k.
    pub conic: f64,
    /// a_0, a_1, ..., in m^-1, m^-3, ...; empty for a conic.
    pub aspheric: Vec<f64>,
}

impl Profile {
    /// A plane.
    pub const FLAT: Profile = Profile { curvature: 0.0, conic: 0.0, aspheric: Vec::new() };

    fn root(&self, r2: f64) -> f64 {
        (1.0 - (1.0 + self.conic) * self.curvature * self.curvature * r2).max(0.0).sqrt()
    }

    /// Height over the vertex where the squared distance from the axis is `r2`, m.
    pub fn sag(&self, r2: f64) -> f64 {
        sag(self.curvature, self.root(r2), &self.aspheric, r2)
    }

    /// dz/dr over r there, m^-1.
    pub fn slope_over_r(&self, r2: f64) -> f64 {
        slope_over_r(self.curvature, self.root(r2).max(1e-30), &self.aspheric, r2)
    }

    /// The same, all lengths times `scale`.
    pub fn scaled(&self, scale: f64) -> Self {
        let aspheric = self.aspheric.iter().enumerate().map(|(i, a)| a / scale.powi(2 * i as i32 + 1)).collect();
        Profile { curvature: self.curvature / scale, conic: self.conic, aspheric }
    }

    /// Least and greatest height out to `radius`.
    pub(crate) fn range(&self, radius: f64) -> (f64, f64) {
        let heights = (0..=RADII).map(|i| self.sag((radius * f64::from(i) / f64::from(RADII)).powi(2)));
        let (lo, hi) = heights.fold((0.0f64, 0.0f64), |(lo, hi), z| (lo.min(z), hi.max(z)));
        // Between two radii an asphere may go a little further.
        let slack = if self.aspheric.is_empty() { 0.0 } else { 1e-3 * (hi - lo) };
        (lo - slack, hi + slack)
    }
}
