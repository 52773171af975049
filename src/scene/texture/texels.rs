//! Texels as they are stored, on the host as on the adapter: as few bytes as they need, whatever factors and channels materials ask for.

use crate::spectrum::sigmoid;
use std::sync::Arc;

/// Texels, row by row from the upper left.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What they are.
    pub texels: Texels,
}

/// What texels are.
#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// Numbers, the same at every wavelength: whole numbers of one or two bytes as shares of their greatest, times `scale`.
    Numbers {
        /// The whole numbers.
        stored: Arc<Packed>,
        /// Their factor.
        scale: f64,
    },
    /// Vectors of three whole numbers of one or two bytes, which stand for -1 to 1, and a fourth that stands for nothing; x and y times `scale`.
    Vectors {
        /// The whole numbers.
        stored: Arc<Packed>,
        /// Factor of x and y.
        scale: f64,
    },
    /// Colours by their number in a table of spectra, each sigmoid coefficients c0, c1, c2 and a factor.
    Colors {
        /// The numbers, of one, two or four bytes.
        stored: Arc<Packed>,
        /// The spectra.
        table: Arc<[[f32; 4]]>,
    },
    /// Spectra as [`pack_sigmoid`] has them.
    Sigmoids {
        /// Two words for each.
        stored: Arc<Packed>,
    },
    /// Spectra as they were measured or rendered, times `scale`.
    Spectra {
        /// The spectra.
        stored: Arc<Spectra>,
        /// Are end values held outside the bins? Else it is dark there.
        hold: bool,
    },
}

/// Texels of so many bytes each, little-endian.
#[derive(Debug, PartialEq)]
pub struct Packed {
    size: usize,
    bytes: Vec<u8>,
}

/// Spectra of pixels as means over bins, constant within each.
#[derive(Debug, PartialEq)]
pub struct Spectra {
    edges_nm: Vec<f64>,
    values: Vec<f32>,
}

impl Packed {
    /// Texels of `size` bytes: 1, 2, 4 or 8.
    pub fn new(size: usize, bytes: Vec<u8>) -> Self {
        Packed { size, bytes }
    }

    /// Bytes of a texel.
    pub fn size(&self) -> usize {
        self.size
    }

    /// All texels.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Texel `i` as a whole number.
    pub fn index(&self, i: usize) -> usize {
        self.word(i * self.size, self.size)
    }

    fn word(&self, at: usize, size: usize) -> usize {
        self.bytes[at..at + size].iter().rev().fold(0, |word, &byte| word << 8 | usize::from(byte))
    }
}

impl Image {
    /// One texel of 1.
    pub fn white() -> Self {
        let stored = Arc::new(Packed::new(1, vec![255]));
        Image { width: 1, height: 1, texels: Texels::Numbers { stored, scale: 1.0 } }
    }
}

impl Spectra {
    /// Values of the bins between these edges, pixel by pixel; those below 0, which denoising and resizing leave, count as 0.
    pub fn new(edges_nm: Vec<f64>, mut values: Vec<f32>) -> Self {
        values.iter_mut().filter(|v| **v < 0.0).for_each(|v| *v = 0.0);
        Spectra { edges_nm, values }
    }

    /// Where the bins join, nm, one more than bins.
    pub fn edges_nm(&self) -> &[f64] {
        &self.edges_nm
    }

    /// Bins.
    pub fn channels(&self) -> usize {
        self.edges_nm.len() - 1
    }

    /// Values `[pixel][bin]`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Texels of a table, of four numbers each, that a pixel takes with a 0 at its end.
    pub fn stride(&self) -> usize {
        (self.channels() + 1).div_ceil(4)
    }

    /// The pixels as a table has them.
    pub fn padded(&self) -> impl Iterator<Item = [f32; 4]> {
        let (n, stride) = (self.channels(), self.stride());
        self.values.chunks_exact(n).flat_map(move |pixel| {
            (0..stride).map(move |k| std::array::from_fn(|i| pixel.get(4 * k + i).copied().unwrap_or(0.0)))
        })
    }

    /// The value of a pixel at `nm`.
    pub fn eval(&self, pixel: usize, nm: f64, hold: bool) -> f64 {
        let n = self.channels();
        match channel_at(&self.edges_nm, nm, hold) {
            channel if channel < n => f64::from(self.values[pixel * n + channel]),
            _ => 0.0,
        }
    }

    /// The mean of a pixel over all bins.
    pub fn mean(&self, pixel: usize) -> f64 {
        let n = self.channels();
        let values = self.values[pixel * n..(pixel + 1) * n].iter().zip(self.edges_nm.windows(2));
        let whole = self.edges_nm[n] - self.edges_nm[0];
        values.map(|(v, w)| f64::from(*v) * (w[1] - w[0])).sum::<f64>() / whole
    }

    /// The greatest value.
    pub fn greatest(&self) -> f64 {
        self.values.iter().fold(0.0f32, |a, b| a.max(*b)).into()
    }
}

/// The bin that `nm` is in; outside the next one where values are held, else the number of bins.
pub fn channel_at(edges_nm: &[f64], nm: f64, hold: bool) -> usize {
    let n = edges_nm.len() - 1;
    let above = edges_nm.partition_point(|edge| *edge <= nm);
    match above {
        _ if hold => above.saturating_sub(1).min(n - 1),
        0 => n,
        _ if above > n && nm > edges_nm[n] => n,
        _ => (above - 1).min(n - 1),
    }
}

/// Steps of an arsinh in [`pack_sigmoid`]; the greatest that there is room for is beyond all coefficients.
const ARSINH_STEP: f64 = 14.0 / 32767.0;
/// Steps to an octave of a factor, 68 octaves to either side of 1.
const STEPS_OF_OCTAVE: f64 = 480.0;

/// A sigmoid and its factor in eight bytes: the arsinh of the polynomial at x = 0, 1/2 and 1 (coefficients cancel each other and would want more digits)
/// and the logarithm of the factor, each a multiple of a step. Good to 8e-4 of the factor; factors of 0 and powers of 2 are exact.
pub fn pack_sigmoid([c0, c1, c2, factor]: [f32; 4]) -> [u32; 2] {
    let [c0, c1, c2, factor] = [c0, c1, c2, factor].map(f64::from);
    let code = |t: f64| ((t.asinh() / ARSINH_STEP).round().clamp(-32767.0, 32767.0) + 32768.0) as u32;
    let factor = if factor > 0.0 { ((factor.log2() * STEPS_OF_OCTAVE).round() + 32768.0).clamp(1.0, 65535.0) as u32 } else { 0 };
    [code(c2) | code(0.25 * c0 + 0.5 * c1 + c2) << 16, code(c0 + c1 + c2) | factor << 16]
}

/// c0, c1, c2 and the factor of a packed sigmoid.
pub fn unpack_sigmoid([a, b]: [u32; 2]) -> [f64; 4] {
    let t = |code: u32| ((f64::from(code & 0xffff) - 32768.0) * ARSINH_STEP).sinh();
    let (t0, t1, t2) = (t(a), t(a >> 16), t(b));
    let factor = b >> 16;
    let factor = if factor == 0 { 0.0 } else { ((f64::from(factor) - 32768.0) / STEPS_OF_OCTAVE).exp2() };
    [2.0 * t0 - 4.0 * t1 + 2.0 * t2, 4.0 * t1 - 3.0 * t0 - t2, t0, factor]
}

impl Image {
    /// Number of texels.
    pub fn count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Texel `i` at `nm`.
    pub fn eval(&self, i: usize, nm: f64) -> f64 {
        let of_sigmoid = |[c0, c1, c2, factor]: [f64; 4]| factor * sigmoid(&[c0, c1, c2], nm);
        match &self.texels {
            Texels::Numbers { stored, scale } => number(stored, i) * scale,
            Texels::Vectors { .. } => 0.0,
            Texels::Colors { stored, table } => of_sigmoid(table[stored.index(i)].map(f64::from)),
            Texels::Sigmoids { stored } => of_sigmoid(unpack_sigmoid(words(stored, i))),
            Texels::Spectra { stored, hold } => stored.eval(i, nm, *hold),
        }
    }

    /// Texel `i` as a vector; 0 where they are none.
    pub fn vector(&self, i: usize) -> [f64; 3] {
        let Texels::Vectors { stored, scale } = &self.texels else { return [0.0; 3] };
        let size = stored.size / 4;
        let most = ((1u64 << (8 * size)) - 1) as f64;
        let v: [f64; 3] = std::array::from_fn(|c| 2.0 * stored.word(i * stored.size + c * size, size) as f64 / most - 1.0);
        [v[0] * scale, v[1] * scale, v[2]]
    }

    /// What bounds a texel at all wavelengths, but for what its sigmoid takes off; of numbers, the texel.
    fn bound(&self, i: usize) -> f64 {
        match &self.texels {
            Texels::Numbers { stored, scale } => number(stored, i) * scale,
            Texels::Vectors { .. } => 1.0,
            Texels::Colors { stored, table } => f64::from(table[stored.index(i)][3]),
            Texels::Sigmoids { stored } => unpack_sigmoid(words(stored, i))[3],
            Texels::Spectra { stored, .. } => {
                let n = stored.channels();
                stored.values[i * n..(i + 1) * n].iter().fold(0.0f32, |a, b| a.max(*b)).into()
            }
        }
    }

    /// The least and greatest bound of a texel.
    pub fn range(&self) -> [f64; 2] {
        (0..self.count()).fold([f64::INFINITY, 0.0], |[least, most], i| {
            let bound = self.bound(i);
            [least.min(bound), most.max(bound)]
        })
    }
}

fn number(stored: &Packed, i: usize) -> f64 {
    stored.index(i) as f64 / ((1u64 << (8 * stored.size)) - 1) as f64
}

fn words(stored: &Packed, i: usize) -> [u32; 2] {
    [0, 4].map(|at| stored.word(8 * i + at, 4) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_sigmoids_are_what_they_were() {
        let near = |a: [f32; 4]| {
            let [c0, c1, c2, factor] = unpack_sigmoid(pack_sigmoid(a));
            for nm in [380.0, 450.0, 520.0, 610.0, 780.0] {
                let (got, want) =
                    (factor * sigmoid(&[c0, c1, c2], nm), f64::from(a[3]) * sigmoid(&[a[0], a[1], a[2]].map(f64::from), nm));
                assert!((got - want).abs() <= 8e-4 * f64::from(a[3]), "{a:?} at {nm} nm: {got} for {want}");
            }
        };
        for a in [
            [0.0, 0.0, 0.0, 1.0],
            [300.0, -310.0, 60.0, 1.0],
            [-500.0, 400.0, -70.0, 37.3],
            [12.0, 3.0, -9.0, 1e-12],
            [1.0, 2.0, 3.0, 7e18],
        ] {
            near(a);
        }
        assert_eq!(unpack_sigmoid(pack_sigmoid([0.0, 0.0, 0.0, 2.0])), [0.0, 0.0, 0.0, 2.0]);
        assert_eq!(unpack_sigmoid(pack_sigmoid([0.0; 4]))[3], 0.0);
    }

    #[test]
    fn bins_end_where_the_next_begins_and_are_dark_or_held_outside() {
        let edges = [400.0, 500.0, 700.0];
        let at = |nm, hold| channel_at(&edges, nm, hold);
        assert_eq!([399.0, 400.0, 499.9, 500.0, 700.0, 701.0].map(|nm| at(nm, false)), [2, 0, 0, 1, 1, 2]);
        assert_eq!([399.0, 450.0, 701.0].map(|nm| at(nm, true)), [0, 0, 1]);
    }
}
