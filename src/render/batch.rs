//! The one sequence of batches: sixteen of one sample per pixel, sixteen of four, of eight, and so on up to the largest. It is the same whatever is asked
//! for: `--spp`, `--time` and `--error` only say where it stops, so that any render can be stopped, gone on with, added to and shared out. The first picture
//! comes after one sample, an error that can be trusted after sixteen, and from there on blocks share samples out unevenly (`integrator::adaptive`), which
//! takes four samples of a batch at least.

/// Batches of each size but the largest. Standard errors can be trusted from so many.
pub const PER_SIZE: u32 = 16;
/// Samples of a batch after the first size.
const SECOND_SPP: u32 = 4;
/// Samples of all pixels together in one batch, at most, but for the first sizes: a batch is what a time limit and a signal wait for.
const MOST_SAMPLES: u64 = 1 << 22;
/// Samples of a pixel in one batch, at most: sums of so many have their place in single precision.
const MOST_SPP: u32 = 64;

/// Samples of every pixel that are taken together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Batch {
    /// Its number, which keys random numbers of the reference.
    pub index: u32,
    /// Number of its first pass (one sample of every pixel, in the mean) among those of all batches.
    pub first_pass: u64,
    /// Samples per pixel, in the mean over pixels.
    pub spp: u32,
    /// Sequence of random numbers that its passes have their places in. All batches of a render have the same one, so that their errors make up for each other: what they differ by
    /// overstates the error of their mean.
    pub sequence: u32,
    /// Number of its first sample in that sequence.
    pub first_sample: u64,
}

impl Batch {
    /// Batch `index` of a picture of so many pixels, however many of them are kept.
    pub fn nth(index: u32, pixels: usize) -> Self {
        let most = MOST_SAMPLES / (pixels as u64).max(1);
        let largest = 1 << most.clamp(1, u64::from(MOST_SPP)).ilog2();
        let (mut spp, mut first, mut first_pass) = (1, 0, 0);
        loop {
            if spp == largest || index - first < PER_SIZE {
                let first_pass = first_pass + u64::from(index - first) * u64::from(spp);
                return Batch { index, first_pass, spp, sequence: 0, first_sample: first_pass };
            }
            first += PER_SIZE;
            first_pass += u64::from(PER_SIZE * spp);
            spp = largest.min(if spp == 1 { SECOND_SPP } else { 2 * spp });
        }
    }

    /// Batch `index` of independent batches that are all of `spp` samples, for what is measured beside renders.
    pub fn even(index: u32, spp: u32) -> Self {
        Batch { index, first_pass: u64::from(index) * u64::from(spp), spp, sequence: index, first_sample: 0 }
    }

    /// Its first samples, `spp` at most.
    pub fn up_to(self, spp: u64) -> Self {
        Batch { spp: u64::from(self.spp).min(spp) as u32, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_are_numbered_without_gap_and_sizes_grow() {
        for pixels in [1, 128 * 128, 640 * 480, 1 << 30] {
            let mut passes = 0;
            for index in 0..200 {
                let batch = Batch::nth(index, pixels);
                assert_eq!((batch.index, batch.first_pass), (index, passes), "{pixels} pixels");
                passes += u64::from(batch.spp);
            }
        }
        let sizes = |pixels| [0, 15, 16, 31, 32, 48, 64, 80, 1000].map(|index| Batch::nth(index, pixels).spp);
        assert_eq!(sizes(128 * 128), [1, 1, 4, 4, 8, 16, 32, 64, 64]);
        assert_eq!(sizes(1 << 20), [1, 1, 4, 4, 4, 4, 4, 4, 4]);
        assert_eq!(sizes(1 << 30), [1; 9]);
    }
}
