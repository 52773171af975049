//! Spectra and indices of refraction as functions of wavelength in nm (in air), and the library of measured data they come from.

mod bins;
pub mod catalogue;
mod formula;
mod ior;
pub mod library;
pub mod measured;
mod units;

pub use bins::Bins;
pub use formula::Formula;
pub use ior::{Ior, LINE_C_NM, LINE_D_NM, LINE_F_NM};
pub use units::unit_problem;

/// A function of wavelength.
#[derive(Debug, Clone, PartialEq)]
pub enum Spectrum {
    /// The same at every wavelength.
    Constant(f64),
    /// Linear between points; the end values are held outside (`extend`), or it is 0 there.
    Table {
        /// Wavelengths, nm, strictly increasing.
        nm: Vec<f64>,
        /// Values.
        values: Vec<f64>,
        /// Hold the end values outside the table, else 0.
        extend: bool,
    },
    /// A rectangle of the given integral: a line of finite width.
    Band {
        /// Centre, nm.
        center_nm: f64,
        /// Full width, nm.
        width_nm: f64,
        /// Value inside.
        height: f64,
    },
    /// Planck's law times `scale`, in W m^-2 sr^-1 nm^-1 for `scale` 1.
    Blackbody {
        /// Temperature, K.
        kelvin: f64,
        /// Factor.
        scale: f64,
    },
    /// Smooth spectrum from RGB (Jakob & Hanika 2019): `scale * s(c0 x^2 + c1 x + c2)`, `s(t) = 1/2 + t / (2 sqrt(1 + t^2))`,
    /// `x = (nm - 360) / 470`.
    Sigmoid {
        /// c0, c1, c2.
        c: [f64; 3],
        /// Factor.
        scale: f64,
    },
    /// Product of two spectra.
    Product(Box<(Spectrum, Spectrum)>),
}

fn every_5_nm((lo, hi): (f64, f64)) -> Vec<f64> {
    let steps = ((hi - lo) / 5.0).ceil().max(1.0) as u32;
    (0..=steps).map(|i| lo + (hi - lo) * f64::from(i) / f64::from(steps)).collect()
}

impl Spectrum {
    /// Value at `nm`.
    pub fn eval(&self, nm: f64) -> f64 {
        match self {
            Spectrum::Constant(v) => *v,
            Spectrum::Table { nm: x, values, extend } => {
                let n = x.len();
                if n == 0 || (!extend && (nm < x[0] || nm > x[n - 1])) {
                    return 0.0;
                }
                let hi = x.partition_point(|&a| a <= nm);
                if hi == 0 {
                    return values[0];
                }
                if hi == n {
                    return values[n - 1];
                }
                let t = (nm - x[hi - 1]) / (x[hi] - x[hi - 1]);
                values[hi - 1] + t * (values[hi] - values[hi - 1])
            }
            Spectrum::Band { center_nm, width_nm, height } => {
                if (nm - center_nm).abs() <= 0.5 * width_nm {
                    *height
                } else {
                    0.0
                }
            }
            Spectrum::Blackbody { kelvin, scale } => scale * planck(*kelvin, nm),
            Spectrum::Sigmoid { c, scale } => scale * sigmoid(c, nm),
            Spectrum::Product(p) => p.0.eval(nm) * p.1.eval(nm),
        }
    }

    /// A table of `f` every 5 nm over `[lo, hi]` nm.
    pub fn sampled(range: (f64, f64), f: impl Fn(f64) -> f64) -> Spectrum {
        Spectrum::sampled_at(every_5_nm(range), f)
    }

    fn sampled_at(nm: Vec<f64>, f: impl Fn(f64) -> f64) -> Spectrum {
        let values = nm.iter().map(|&x| f(x)).collect();
        Spectrum::Table { nm, values, extend: true }
    }

    /// The coefficient of absorption in m^-1, over `range` in nm, by which this share of light is left after `distance` in m (Beer-Lambert); of no light
    /// a millionth is.
    pub fn attenuation(&self, distance: f64, range: (f64, f64)) -> Spectrum {
        let coefficient = |share: f64| -share.max(1e-6).ln() / distance;
        match self {
            Spectrum::Constant(share) => Spectrum::Constant(coefficient(*share)),
            share => {
                let mut nm = every_5_nm(range);
                share.breakpoints(range.0, range.1, &mut nm);
                nm.sort_by(f64::total_cmp);
                nm.dedup();
                Spectrum::sampled_at(nm, |nm| coefficient(share.eval(nm)))
            }
        }
    }

    /// The spectrum times a number.
    pub fn scaled(self, factor: f64) -> Spectrum {
        match self {
            Spectrum::Constant(v) => Spectrum::Constant(v * factor),
            Spectrum::Table { nm, values, extend } => {
                Spectrum::Table { nm, values: values.into_iter().map(|v| v * factor).collect(), extend }
            }
            Spectrum::Band { center_nm, width_nm, height } => Spectrum::Band { center_nm, width_nm, height: height * factor },
            Spectrum::Blackbody { kelvin, scale } => Spectrum::Blackbody { kelvin, scale: scale * factor },
            Spectrum::Sigmoid { c, scale } => Spectrum::Sigmoid { c, scale: scale * factor },
            Spectrum::Product(mut p) => {
                p.0 = p.0.scaled(factor);
                Spectrum::Product(p)
            }
        }
    }

    /// True if it is 0 everywhere.
    pub fn is_zero(&self) -> bool {
        match self {
            Spectrum::Constant(v) => *v == 0.0,
            Spectrum::Table { values, .. } => values.iter().all(|&v| v == 0.0),
            Spectrum::Band { height, .. } => *height == 0.0,
            Spectrum::Blackbody { scale, .. } | Spectrum::Sigmoid { scale, .. } => *scale == 0.0,
            Spectrum::Product(p) => p.0.is_zero() || p.1.is_zero(),
        }
    }

    /// Wavelengths in `(lo, hi)` where the spectrum jumps or bends: between neighbours it is smooth, so that quadrature over the pieces is exact
    /// or converges fast. Appends to `out`.
    pub fn breakpoints(&self, lo: f64, hi: f64, out: &mut Vec<f64>) {
        match self {
            Spectrum::Table { nm, .. } => out.extend(nm.iter().copied().filter(|&x| x > lo && x < hi)),
            Spectrum::Band { center_nm, width_nm, .. } => {
                let ends = [center_nm - 0.5 * width_nm, center_nm + 0.5 * width_nm];
                out.extend(ends.into_iter().filter(|&x| x > lo && x < hi));
            }
            Spectrum::Product(p) => {
                p.0.breakpoints(lo, hi, out);
                p.1.breakpoints(lo, hi, out);
            }
            Spectrum::Constant(_) | Spectrum::Blackbody { .. } | Spectrum::Sigmoid { .. } => {}
        }
    }

    /// The part of `[lo, hi]` nm in which it is known. Outside it a table has ended, and the spectrum is 0 though it did not fall to that, or with `held`
    /// its end values are taken.
    pub fn known_within(&self, lo: f64, hi: f64, held: bool) -> (f64, f64) {
        match self {
            Spectrum::Table { nm, values, extend } if *extend == held && !nm.is_empty() => {
                let ends = |i: usize| held || values[i] != 0.0;
                let last = nm.len() - 1;
                (if ends(0) { nm[0].max(lo) } else { lo }, if ends(last) { nm[last].min(hi) } else { hi })
            }
            Spectrum::Product(p) => {
                let (a, b) = (p.0.known_within(lo, hi, held), p.1.known_within(lo, hi, held));
                (a.0.max(b.0), a.1.min(b.1))
            }
            _ => (lo, hi),
        }
    }

    /// Integral over `[lo, hi]` nm, by three-point Gauss-Legendre on every piece between breakpoints, pieces at most 5 nm.
    pub fn integral(&self, lo: f64, hi: f64) -> f64 {
        let mut cuts = vec![lo, hi];
        self.breakpoints(lo, hi, &mut cuts);
        cuts.sort_by(f64::total_cmp);
        let mut sum = 0.0;
        for w in cuts.windows(2) {
            let pieces = ((w[1] - w[0]) / 5.0).ceil().max(1.0) as usize;
            let h = (w[1] - w[0]) / pieces as f64;
            for p in 0..pieces {
                let mid = w[0] + (p as f64 + 0.5) * h;
                let d = 0.5 * h * 0.6f64.sqrt();
                sum += h / 18.0 * (5.0 * self.eval(mid - d) + 8.0 * self.eval(mid) + 5.0 * self.eval(mid + d));
            }
        }
        sum
    }

    /// Mean over `[lo, hi]` nm.
    pub fn mean(&self, lo: f64, hi: f64) -> f64 {
        self.integral(lo, hi) / (hi - lo)
    }
}

/// Value of the sigmoid at `nm`: `s(c0 x^2 + c1 x + c2)`, `s(t) = 1/2 + t / (2 sqrt(1 + t^2))`, `x = (nm - 360) / 470` (Jakob & Hanika 2019, equations 4 and 5).
pub fn sigmoid(c: &[f64; 3], nm: f64) -> f64 {
    let x = (nm - 360.0) / 470.0;
    let t = (c[0] * x + c[1]) * x + c[2];
    0.5 + 0.5 * t / (1.0 + t * t).sqrt()
}

/// Planck's law per wavelength in W m^-2 sr^-1 nm^-1 in vacuum (n = 1), exact SI 2019 constants.
pub fn planck(kelvin: f64, nm: f64) -> f64 {
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    const K: f64 = 1.380_649e-23;
    let l = nm * 1e-9;
    2.0 * H * C * C / l.powi(5) / (H * C / (l * K * kelvin)).exp_m1() * 1e-9
}
