//! What a film was with fewer samples. The samples since then are another half: who has kept it knows what is noise, of any film, while that keeps nothing.

use super::Film;
use super::half::half_difference;

/// X, Y, Z of every pixel, and its samples, at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Earlier {
    xyz: Vec<[f32; 3]>,
    samples: Vec<f32>,
}

impl Film {
    /// What it is now, for later.
    pub fn keep_earlier(&self) -> Earlier {
        Earlier { xyz: self.xyz_image(), samples: self.weight.iter().map(|&w| w as f32).collect() }
    }

    /// As [`Film::half_difference`], of X, Y, Z, where the one half of the samples are those that it had `earlier`.
    pub fn half_difference_since(&self, earlier: &Earlier, pixel: usize) -> [f64; 3] {
        let (xyz, weight) = (self.xyz(pixel), f64::from(earlier.samples[pixel]));
        let of = |i: usize| half_difference(f64::from(earlier.xyz[pixel][i]), weight, xyz[i], self.weight[pixel]);
        std::array::from_fn(of)
    }
}
