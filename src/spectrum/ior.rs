//! Index of refraction as a function of wavelength: a dispersion formula, its range, and what can go wrong with it.

use super::formula::Formula;

use super::Spectrum;

/// Fraunhofer's d line (He), nm in air.
pub const LINE_D_NM: f64 = 587.5618;
/// Fraunhofer's F line (H), nm in air.
pub const LINE_F_NM: f64 = 486.1327;
/// Fraunhofer's C line (H), nm in air.
pub const LINE_C_NM: f64 = 656.2725;

/// Wavelengths at which a range is looked at. Away from poles the formulas are smooth, so a dip between samples this dense is shallower than any real glass.
const SAMPLES: u32 = 2000;

/// Index of refraction relative to air, over wavelengths in nm in air.
///
/// Catalogues of glass give the index relative to air at the wavelength in air, so the exterior has index 1 and both conventions meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Ior {
    /// The dispersion formula.
    pub formula: Formula,
    /// Wavelengths for which it was fitted, nm; `(0, infinity)` where nothing is known against any.
    pub range_nm: (f64, f64),
    /// Use the formula outside its range, instead of holding the end values.
    pub extrapolate: bool,
}

impl Ior {
    /// The formula, valid everywhere.
    pub fn new(formula: Formula) -> Self {
        Ior { formula, range_nm: (0.0, f64::INFINITY), extrapolate: false }
    }

    /// The same index at every wavelength.
    pub fn constant(n: f64) -> Self {
        Ior::new(Formula::Constant(n))
    }

    /// `n^2 = 1 + sum b l^2 / (l^2 - c)`, l in um; valid wherever it has no pole. Surplus entries of the longer list are ignored.
    pub fn sellmeier(b: &[f64], c_um2: &[f64]) -> Self {
        Ior::new(Formula::Sellmeier { a0: 0.0, b: b.to_vec(), c_um2: c_um2.to_vec() })
    }

    /// `n = A + B / l^2 + C / l^4`, l in um.
    pub fn cauchy(coef_um: &[f64]) -> Self {
        Ior::new(Formula::Cauchy { coef_um: coef_um.to_vec() })
    }

    /// From the index at the d line and the Abbe number; `vd` of 0 or infinity means no dispersion, as in KHR_materials_dispersion.
    pub fn from_abbe_number(nd: f64, vd: f64) -> Self {
        if vd == 0.0 || vd.is_infinite() { Ior::constant(nd) } else { Ior::new(Formula::AbbeNumber { nd, vd }) }
    }

    /// Linear between points, known from the first to the last.
    ///
    /// Errors if there are no points, or wavelengths are not finite, positive and strictly increasing, or an index is not finite and positive.
    pub fn table(points: &[(f64, f64)]) -> Result<Self, String> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Err("a table of indices needs at least one point; give [[nm, n], ...]".into());
        };
        if let Some(p) = points.iter().find(|p| !(p.0.is_finite() && p.0 > 0.0 && p.1.is_finite() && p.1 > 0.0)) {
            return Err(format!(
                "the point [{}, {}] is not a wavelength and an index; both must be finite and positive",
                p.0, p.1
            ));
        }
        if let Some(w) = points.windows(2).find(|w| w[0].0 >= w[1].0) {
            return Err(format!("{} nm is followed by {} nm; sort the table by wavelength, each once", w[0].0, w[1].0));
        }
        let (nm, n) = points.iter().copied().unzip();
        Ok(Ior { formula: Formula::Table { nm, n }, range_nm: (first.0, last.0), extrapolate: false })
    }

    /// The index that this spectrum is, every 5 nm over `range` in nm.
    pub fn of_spectrum(index: &Spectrum, range: (f64, f64)) -> Self {
        match Spectrum::sampled(range, |nm| index.eval(nm)) {
            Spectrum::Table { nm, values: n, .. } if !matches!(index, Spectrum::Constant(_)) => {
                Ior { formula: Formula::Table { nm, n }, range_nm: range, extrapolate: false }
            }
            _ => Ior::constant(index.eval(range.0)),
        }
    }

    /// Index at `nm`. Outside its range the end value is held unless `extrapolate`. NaN where the formula has no real value:
    /// [`Ior::check_range`] finds such wavelengths first.
    pub fn eval(&self, nm: f64) -> f64 {
        let nm = if self.extrapolate { nm } else { nm.max(self.range_nm.0).min(self.range_nm.1) };
        self.formula.eval(nm)
    }

    /// Whether the index can be used over all of `[lo, hi]` nm: inside the range (unless `extrapolate`), without a pole, real, finite, positive.
    ///
    /// The error reads `problem; remedy`.
    pub fn check_range(&self, lo: f64, hi: f64) -> Result<(), String> {
        let (min, max) = self.range_nm;
        if !self.extrapolate && (lo < min || hi > max) {
            return Err(format!(
                "the index is known from {min} to {max} nm, and {lo} to {hi} nm is asked for; narrow the film's range or say \"extrapolate\": true"
            ));
        }
        let remedy = "correct the coefficients (wavelengths in um) or narrow the film's range";
        if let Some(pole) = self.formula.poles_nm().into_iter().find(|p| (lo..=hi).contains(p)) {
            return Err(format!("the dispersion formula has a pole at {pole:.2} nm, between {lo} and {hi} nm; {remedy}"));
        }
        for i in 0..=SAMPLES {
            let nm = lo + (hi - lo) * f64::from(i) / f64::from(SAMPLES);
            let n = self.eval(nm);
            if !(n.is_finite() && n > 0.0) {
                return Err(format!("the dispersion formula gives no positive index at {nm:.1} nm; {remedy}"));
            }
        }
        Ok(())
    }

    /// Whether a surface between the two does nothing to light of `[lo, hi]` nm: they differ by at most 1e-6 of their value, some roundings of single
    /// precision, so that it reflects less than 1e-12 and bends by less than 1e-6 rad but within 0.002 rad of grazing.
    pub fn matches(&self, other: &Ior, lo: f64, hi: f64) -> bool {
        let nm = |i: u32| lo + (hi - lo) * f64::from(i) / f64::from(SAMPLES);
        let alike = |nm: f64| (self.eval(nm) - other.eval(nm)).abs() <= 1e-6 * self.eval(nm);
        self == other || (0..=SAMPLES).all(|i| alike(nm(i)))
    }

    /// True if and only if the index is the same number at every wavelength of `[lo, hi]` nm, so that refraction does not disperse.
    pub fn is_constant_over(&self, lo: f64, hi: f64) -> bool {
        let (min, max) = self.range_nm;
        if lo == hi || (!self.extrapolate && (hi <= min || lo >= max)) {
            return true;
        }
        self.formula.is_constant_over(lo, hi)
    }

    /// Index at the d line, 587.5618 nm.
    pub fn nd(&self) -> f64 {
        self.eval(LINE_D_NM)
    }

    /// Abbe number `(nd - 1) / (nF - nC)`; infinite without dispersion.
    pub fn vd(&self) -> f64 {
        let spread = self.eval(LINE_F_NM) - self.eval(LINE_C_NM);
        if spread == 0.0 { f64::INFINITY } else { (self.nd() - 1.0) / spread }
    }

    /// Least-squares Cauchy formula of `terms` terms (1 to 6) over `[lo, hi]` nm on a 1 nm grid: A, B (um^2), C (um^4), ..., and its
    /// greatest absolute error on that grid.
    pub fn cauchy_fit(&self, terms: usize, lo: f64, hi: f64) -> (Vec<f64>, f64) {
        let terms = terms.clamp(1, 6);
        let steps = (hi - lo).ceil().max(terms as f64) as usize;
        let grid: Vec<f64> = (0..=steps).map(|i| lo + (hi - lo) * i as f64 / steps as f64).collect();
        // Columns scaled to 1 at lo keep the normal equations well conditioned.
        let row = |nm: f64| -> Vec<f64> { (0..terms).map(|k| (lo / nm).powi(2 * k as i32)).collect() };
        let mut a = vec![vec![0.0; terms + 1]; terms];
        for &nm in &grid {
            let r = row(nm);
            for i in 0..terms {
                for j in 0..terms {
                    a[i][j] += r[i] * r[j];
                }
                a[i][terms] += r[i] * self.eval(nm);
            }
        }
        let x = solve_dense(a);
        let coefs: Vec<f64> = x.iter().enumerate().map(|(k, v)| v * (lo * 1e-3).powi(2 * k as i32)).collect();
        let fit = Ior::cauchy(&coefs);
        let max_err = grid.iter().map(|&nm| (fit.eval(nm) - self.eval(nm)).abs()).fold(0.0, f64::max);
        (coefs, max_err)
    }
}

/// Gaussian elimination with partial pivoting of the augmented system `[A | b]`.
fn solve_dense(mut a: Vec<Vec<f64>>) -> Vec<f64> {
    let n = a.len();
    for col in 0..n {
        let pivot = (col..n).max_by(|&i, &j| a[i][col].abs().total_cmp(&a[j][col].abs())).unwrap_or(col);
        a.swap(col, pivot);
        let pivot_row = a[col].clone();
        for row in a.iter_mut().skip(col + 1) {
            let f = row[col] / pivot_row[col];
            for (v, p) in row.iter_mut().zip(&pivot_row).skip(col) {
                *v -= f * p;
            }
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| a[i][j] * x[j]).sum();
        x[i] = (a[i][n] - known) / a[i][i];
    }
    x
}
