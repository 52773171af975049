//! The colour spaces that pictures are written in: primaries, white and encoding.

use super::adapt::{self, Method};
use super::cie::xyz_of_xy;
use super::convert::{Matrix, multiply, primaries_to_xyz, regular_inverse};

/// Chromaticity of D65 as the standards of the three display spaces round it.
pub const D65: [f64; 2] = [0.3127, 0.3290];

/// An RGB space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// IEC 61966-2-1, with the primaries of ITU-R BT.709.
    Srgb,
    /// SMPTE EG 432-1 primaries with D65 and the encoding of sRGB.
    DisplayP3,
    /// ITU-R BT.2020-2.
    Rec2020,
    /// Academy S-2014-004: AP1 primaries, linear.
    AcesCg,
}

impl Space {
    /// Chromaticities x, y of R, G and B.
    pub fn primaries(self) -> [[f64; 2]; 3] {
        match self {
            Space::Srgb => [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]],
            Space::DisplayP3 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]],
            Space::Rec2020 => [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]],
            Space::AcesCg => [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]],
        }
    }

    /// Chromaticity x, y of its white, RGB (1, 1, 1).
    pub fn white(self) -> [f64; 2] {
        match self {
            Space::Srgb | Space::DisplayP3 | Space::Rec2020 => D65,
            Space::AcesCg => [0.32168, 0.33767],
        }
    }

    /// Linear RGB to XYZ; RGB (1, 1, 1) has Y = 1.
    pub fn to_xyz(self) -> Matrix {
        primaries_to_xyz(self.primaries(), self.white())
    }

    /// XYZ to linear RGB, the inverse of [`Space::to_xyz`].
    pub fn from_xyz(self) -> Matrix {
        regular_inverse(&self.to_xyz())
    }

    /// Linear RGB of this space to that of `other`, white to white (Bradford).
    pub fn to(self, other: Space) -> Matrix {
        let whites = adapt::matrix(xyz_of_xy(self.white()), xyz_of_xy(other.white()), Method::Bradford);
        multiply(&other.from_xyz(), &multiply(&whites, &self.to_xyz()))
    }

    /// How it is encoded.
    pub fn transfer(self) -> Transfer {
        match self {
            Space::Srgb | Space::DisplayP3 => Transfer { gamma: 2.4, alpha: 1.055, slope: 12.92, from: 0.040_45 },
            // Table 4: the factor and the end of the straight piece that make the two meet smoothly.
            Space::Rec2020 => {
                Transfer { gamma: 1.0 / 0.45, alpha: 1.099_296_826_809_442, slope: 4.5, from: 4.5 * 0.018_053_968_510_807 }
            }
            Space::AcesCg => Transfer { gamma: 1.0, alpha: 1.0, slope: 1.0, from: 0.0 },
        }
    }
}

/// A transfer function of two pieces: an encoded component is decoded as `((v + alpha - 1) / alpha)^gamma`, below `from` as `v / slope`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    /// Exponent of decoding.
    pub gamma: f64,
    /// One more than the offset.
    pub alpha: f64,
    /// Slope of encoding near black.
    pub slope: f64,
    /// Encoded value where the pieces meet.
    pub from: f64,
}

impl Transfer {
    /// Encodes a linear component, odd for negative values.
    pub fn encode(&self, v: f64) -> f64 {
        let a = v.abs();
        let straight = self.slope * a;
        let e = if straight < self.from { straight } else { self.alpha * a.powf(1.0 / self.gamma) - (self.alpha - 1.0) };
        e.copysign(v)
    }

    /// Decodes a component, the inverse of [`Transfer::encode`].
    pub fn decode(&self, v: f64) -> f64 {
        let a = v.abs();
        let l = if a < self.from { a / self.slope } else { ((a + self.alpha - 1.0) / self.alpha).powf(self.gamma) };
        l.copysign(v)
    }
}
