//! Dispersion formulas.

/// Squared wavelength of the resonance in Herzberger's formula, um^2.
const HERZBERGER_UM2: f64 = 0.028;

/// A dispersion formula. Wavelengths `l` are um in air; coefficients as printed by catalogues and refractiveindex.info ("Dispersion formulas",
/// numbered there as given).
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// No dispersion.
    Constant(f64),
    /// `n^2 = 1 + a0 + sum b l^2 / (l^2 - c)` (formulas 1 and 2).
    Sellmeier {
        /// Constant term, mostly 0.
        a0: f64,
        /// Strengths.
        b: Vec<f64>,
        /// Squared resonance wavelengths, um^2; as many as `b`.
        c_um2: Vec<f64>,
    },
    /// `n^2 = c0 + sum s l^p / (l^2 - q) + sum c l^e` (formulas 3, 4); a Schott power series has exponents 2, -2, -4, -6, -8.
    Polynomial {
        /// Constant term.
        c0: f64,
        /// Strength s, power p and squared wavelength q (um^2) of each resonance.
        resonances: Vec<[f64; 3]>,
        /// Pairs of coefficient and exponent.
        terms: Vec<[f64; 2]>,
    },
    /// `n = c0 + sum c l^e` (formula 5; Conrady's has exponents -1 and -3.5).
    Powers {
        /// Constant term.
        c0: f64,
        /// Pairs of coefficient and exponent.
        terms: Vec<[f64; 2]>,
    },
    /// `n = c0 + c1 L + c2 L^2 + c3 l^2 + c4 l^4 + c5 l^6`, `L = 1 / (l^2 - 0.028)` (formula 7).
    Herzberger([f64; 6]),
    /// `(n^2 - 1) / (n^2 + 2) = c0 + c1 l^2 / (l^2 - c2) + c3 l^2` (formula 8).
    Retro([f64; 4]),
    /// `n^2 = c0 + c1 / (l^2 - c2) + c3 (l - c4) / ((l - c4)^2 + c5)` (formula 9).
    Exotic([f64; 6]),
    /// An index relative to vacuum, over wavelengths in vacuum, over that of air.
    OverAir(Box<Formula>),
    /// `n = A + B / l^2 + C / l^4 + ...` (formula 5 with even exponents).
    Cauchy {
        /// A, B (um^2), C (um^4), ...
        coef_um: Vec<f64>,
    },
    /// `n = nd + (nd - 1) / vd (523655 nm^2 / l^2 - 1.5168)` (glTF's KHR_materials_dispersion); no dispersion for infinite `vd`.
    AbbeNumber {
        /// Index at the d line.
        nd: f64,
        /// Abbe number (nd - 1) / (nF - nC).
        vd: f64,
    },
    /// `n = 1 + a0 + sum b / (c - l^-2)` (formula 6).
    Gas {
        /// Constant term, mostly 0.
        a0: f64,
        /// Strengths, um^-2.
        b: Vec<f64>,
        /// Squared resonance wave numbers, um^-2; as many as `b`.
        c: Vec<f64>,
    },
    /// Linear between points.
    Table {
        /// Wavelengths, nm, strictly increasing.
        nm: Vec<f64>,
        /// Indices; as many as `nm`.
        n: Vec<f64>,
    },
}

impl Formula {
    /// The formula of this number of refractiveindex.info ("Dispersion formulas") with its coefficients as printed there; missing ones are 0.
    ///
    /// Errors if there is no such formula, or a number is not finite.
    pub fn numbered(number: u32, coefficients: &[f64]) -> Result<Self, String> {
        if let Some(c) = coefficients.iter().find(|c| !c.is_finite()) {
            return Err(format!("the coefficient {c} is not finite"));
        }
        let at = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
        let rest = |from: usize| coefficients.get(from..).unwrap_or_default();
        let pairs =
            |from: usize| -> Vec<[f64; 2]> { rest(from).chunks(2).map(|p| [p[0], p.get(1).copied().unwrap_or(0.0)]).collect() };
        let c0 = at(0);
        Ok(match number {
            1 | 2 => {
                let square = |c: f64| if number == 1 { c * c } else { c };
                let (b, c_um2) = pairs(1).into_iter().map(|[b, c]| (b, square(c))).unzip();
                Formula::Sellmeier { a0: c0, b, c_um2 }
            }
            3 => Formula::Polynomial { c0, resonances: Vec::new(), terms: pairs(1) },
            4 => {
                let resonance = |i: usize| [at(i), at(i + 1), at(i + 2).powf(at(i + 3))];
                let resonances = [1, 5].map(resonance).into_iter().filter(|r| r[0] != 0.0).collect();
                Formula::Polynomial { c0, resonances, terms: pairs(9) }
            }
            5 => Formula::Powers { c0, terms: pairs(1) },
            6 => {
                let (b, c) = pairs(1).into_iter().map(|[b, c]| (b, c)).unzip();
                Formula::Gas { a0: c0, b, c }
            }
            7 => Formula::Herzberger(std::array::from_fn(at)),
            8 => Formula::Retro(std::array::from_fn(at)),
            9 => Formula::Exotic(std::array::from_fn(at)),
            _ => return Err(format!("there is no dispersion formula {number}")),
        })
    }

    /// Index at `nm`; NaN or infinite where the formula has no real value.
    pub fn eval(&self, nm: f64) -> f64 {
        match self {
            Formula::Constant(n) => *n,
            Formula::Cauchy { coef_um } => {
                let inv_l2 = 1e6 / (nm * nm);
                coef_um.iter().rev().fold(0.0, |sum, c| sum * inv_l2 + c)
            }
            Formula::AbbeNumber { nd, vd } => nd + (nd - 1.0) / vd * (523_655.0 / (nm * nm) - 1.5168),
            Formula::Gas { a0, b, c } => {
                let inv_l2 = 1e6 / (nm * nm);
                1.0 + a0 + b.iter().zip(c).map(|(b, c)| b / (c - inv_l2)).sum::<f64>()
            }
            Formula::OverAir(of) => of.eval(nm * air(nm)) / air(nm),
            Formula::Table { nm: x, n } => interpolate_linear(x, n, nm),
            Formula::Powers { c0, terms } => c0 + powers(terms, nm * 1e-3),
            Formula::Herzberger(c) => {
                let l2 = (nm * 1e-3).powi(2);
                let h = 1.0 / (l2 - HERZBERGER_UM2);
                c[0] + c[1] * h + c[2] * h * h + c[3] * l2 + c[4] * l2 * l2 + c[5] * l2 * l2 * l2
            }
            Formula::Sellmeier { .. } | Formula::Polynomial { .. } | Formula::Retro(_) | Formula::Exotic(_) => {
                self.squared(nm).sqrt()
            }
        }
    }

    /// n^2 at `nm`, of the formulas that give it.
    fn squared(&self, nm: f64) -> f64 {
        let l = nm * 1e-3;
        match self {
            Formula::Sellmeier { a0, b, c_um2 } => {
                1.0 + a0 + b.iter().zip(c_um2).map(|(b, c)| b * l * l / (l * l - c)).sum::<f64>()
            }
            Formula::Polynomial { c0, resonances, terms } => {
                c0 + resonances.iter().map(|[s, p, q]| s * l.powf(*p) / (l * l - q)).sum::<f64>() + powers(terms, l)
            }
            Formula::Retro(c) => {
                let r = c[0] + c[1] * l * l / (l * l - c[2]) + c[3] * l * l;
                (1.0 + 2.0 * r) / (1.0 - r)
            }
            Formula::Exotic(c) => {
                let x = l - c[4];
                c[0] + c[1] / (l * l - c[2]) + c[3] * x / (x * x + c[5])
            }
            _ => self.eval(nm).powi(2),
        }
    }

    /// Wavelengths where the formula is infinite, nm.
    pub(super) fn poles_nm(&self) -> Vec<f64> {
        let root = |strength: f64, um2: f64| (strength != 0.0 && um2 > 0.0).then(|| um2.sqrt() * 1e3);
        match self {
            Formula::Sellmeier { b, c_um2, .. } => b.iter().zip(c_um2).filter_map(|(b, c)| root(*b, *c)).collect(),
            Formula::Polynomial { resonances, .. } => resonances.iter().filter_map(|[s, _, q]| root(*s, *q)).collect(),
            Formula::Gas { b, c, .. } => b.iter().zip(c).filter_map(|(b, c)| root(*b, 1.0 / *c)).collect(),
            Formula::Herzberger(c) => root(c[1].abs() + c[2].abs(), HERZBERGER_UM2).into_iter().collect(),
            Formula::Retro(c) => root(c[1], c[2]).into_iter().collect(),
            Formula::Exotic(c) => {
                root(c[1], c[2]).into_iter().chain(root(c[3], if c[5] == 0.0 { c[4] * c[4] } else { 0.0 })).collect()
            }
            Formula::OverAir(of) => of.poles_nm(),
            _ => Vec::new(),
        }
    }

    /// True if and only if it is the same number at every wavelength of `[lo, hi]` nm.
    pub(super) fn is_constant_over(&self, lo: f64, hi: f64) -> bool {
        let zero = |v: &[f64]| v.iter().all(|&x| x == 0.0);
        let flat = |terms: &[[f64; 2]]| terms.iter().all(|&[c, e]| c == 0.0 || e == 0.0);
        match self {
            Formula::Constant(_) => true,
            Formula::OverAir(_) => false,
            // A term with c = 0 is b l^2 / l^2.
            Formula::Sellmeier { b, c_um2, .. } => b.iter().zip(c_um2).all(|(&b, &c)| b == 0.0 || c == 0.0),
            Formula::Polynomial { resonances, terms, .. } => resonances.iter().all(|r| r[0] == 0.0) && flat(terms),
            Formula::Powers { terms, .. } => flat(terms),
            Formula::Cauchy { coef_um } => zero(coef_um.get(1..).unwrap_or_default()),
            Formula::AbbeNumber { nd, vd } => *nd == 1.0 || vd.is_infinite(),
            Formula::Gas { b, .. } => zero(b),
            Formula::Herzberger(c) => zero(&c[1..]),
            Formula::Retro(c) => c[1] == 0.0 && c[3] == 0.0,
            Formula::Exotic(c) => c[1] == 0.0 && c[3] == 0.0,
            Formula::Table { nm, n } => {
                // Every segment that overlaps the interval must be flat.
                nm.windows(2).zip(n.windows(2)).all(|(x, y)| y[0] == y[1] || x[1] <= lo || x[0] >= hi)
            }
        }
    }
}

/// Index of air at 15 C, 101325 Pa, 450 ppm CO2, relative to vacuum (P. E. Ciddor, "Refractive index of air", Appl. Opt. 35, 1996, eq. 1), at `nm` of
/// vacuum or, as near as 1e-10, of air.
fn air(nm: f64) -> f64 {
    let inv_l2 = 1e6 / (nm * nm);
    1.0 + 0.057_921_05 / (238.0185 - inv_l2) + 0.001_679_17 / (57.362 - inv_l2)
}

/// `sum c l^e`.
fn powers(terms: &[[f64; 2]], l: f64) -> f64 {
    terms.iter().map(|[c, e]| c * l.powf(*e)).sum::<f64>()
}

/// Linear between points, the end values (not slopes) held outside; a formula's `extrapolate` makes no sense for measured points.
fn interpolate_linear(x: &[f64], y: &[f64], at: f64) -> f64 {
    let hi = x.partition_point(|&a| a <= at);
    match (hi, x.len().min(y.len())) {
        (_, 0) => f64::NAN,
        (0, _) => y[0],
        (hi, n) if hi >= n => y[n - 1],
        (hi, _) => y[hi - 1] + (at - x[hi - 1]) / (x[hi] - x[hi - 1]) * (y[hi] - y[hi - 1]),
    }
}
