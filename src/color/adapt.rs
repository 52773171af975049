//! White balance: chromatic adaptation from one white to another (von Kries, complete adaptation).

use super::cie;
use super::convert::{Matrix, apply, multiply, regular_inverse};
use crate::spectrum::Spectrum;
use crate::spectrum::library::{self, Observer};

/// The cone-like responses that are scaled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Lam's matrix as ICC.1 gives it (annex E).
    #[default]
    Bradford,
    /// CAM16's (Li et al., "Comprehensive color solutions: CAM16, CAT16, and CAM16-UCS", Color Res. Appl. 42, 2017, equation 4).
    Cat16,
}

impl Method {
    fn responses(self) -> Matrix {
        match self {
            Method::Bradford => [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]],
            Method::Cat16 => [[0.401288, 0.650173, -0.051461], [-0.250268, 1.204414, 0.045854], [-0.002079, 0.048952, 0.953127]],
        }
    }
}

/// The matrix on XYZ that takes the white `from` to the white `to`, both XYZ with Y = 1.
pub fn matrix(from: [f64; 3], to: [f64; 3], method: Method) -> Matrix {
    let m = method.responses();
    let (from, to) = (apply(&m, from), apply(&m, to));
    let scaled = std::array::from_fn(|i| m[i].map(|v| v * to[i] / from[i]));
    multiply(&regular_inverse(&m), &scaled)
}

/// A white to balance for: the light that is to look white.
#[derive(Debug, Clone, PartialEq)]
pub enum White {
    /// The light of this spectrum.
    Light(Spectrum),
    /// Chromaticity x, y under the observer at hand.
    Chromaticity([f64; 2]),
}

impl White {
    /// A CIE illuminant; `None` if the name is not known.
    pub fn illuminant(name: &str) -> Option<White> {
        library::illuminant(name).map(White::Light)
    }

    /// A blackbody of this temperature.
    pub fn blackbody(kelvin: f64) -> White {
        White::Light(Spectrum::Blackbody { kelvin, scale: 1.0 })
    }

    /// XYZ with Y = 1.
    pub fn xyz(&self, observer: Observer) -> [f64; 3] {
        match self {
            White::Light(spectrum) => {
                let xyz = cie::xyz_of(spectrum, observer);
                xyz.map(|v| v / xyz[1])
            }
            White::Chromaticity(xy) => cie::xyz_of_xy(*xy),
        }
    }
}
