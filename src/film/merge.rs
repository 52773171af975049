//! Films of the same picture, rendered apart, made one.

use super::Film;

impl Film {
    /// Adds the batches of `other`, which has others than this film: means weigh by samples, and errors are as if one film had had all batches, but for
    /// rounding (Chan, Golub & LeVeque 1983, eq. 2.1). The order of films changes single bits.
    ///
    /// # Panics
    /// If the films differ in pixels or channels: the caller's mistake.
    pub fn add_film(&mut self, other: &Film) {
        assert_eq!((self.pixels(), self.channels), (other.pixels(), other.channels), "films of different pictures");
        for pixel in 0..self.pixels() {
            let (ours, theirs) = (self.weight[pixel], other.weight[pixel]);
            let all = ours + theirs;
            if theirs == 0.0 {
                continue;
            }
            let at = pixel * self.channels..(pixel + 1) * self.channels;
            let here = self.mean[at.clone()].iter_mut().zip(&mut self.deviation[at.clone()]);
            for ((mean, deviation), (x, more)) in here.zip(other.mean[at.clone()].iter().zip(&other.deviation[at])) {
                let delta = x - *mean;
                *mean += theirs / all * delta;
                let between = ours * theirs / all * delta * delta;
                *deviation = (f64::from(*deviation) + f64::from(*more) + between).min(f64::from(f32::MAX)) as f32;
            }
            self.weight[pixel] = all;
            self.batches[pixel] += other.batches[pixel];
        }
        self.whole.append(&other.whole);
        self.half = self.half.take().zip(other.half.as_ref()).map(|(mut half, other)| {
            half.append(other);
            half
        });
    }
}
