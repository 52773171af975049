//! Flight through a homogeneous medium, for all wavelengths of a path at once.

use super::rng::Rng;
use super::walk::WavelengthSample;
use crate::scene::Interior;

/// The medium around a path: coefficients per carried wavelength.
pub(super) struct Medium {
    sigma_t: Vec<f64>,
    sigma_s: Vec<f64>,
    pub g: f64,
}

impl Medium {
    pub(super) fn new(interior: &Interior, wavelengths: &[WavelengthSample]) -> Self {
        let sigma_s: Vec<f64> = wavelengths.iter().map(|l| interior.sigma_s.eval(l.nm)).collect();
        let sigma_t = wavelengths.iter().zip(&sigma_s).map(|(l, s)| interior.sigma_a.eval(l.nm) + s).collect();
        Self { sigma_t, sigma_s, g: interior.g }
    }

    /// Transmittance over distance `t` per wavelength.
    pub(super) fn transmittance(&self, t: f64) -> Vec<f64> {
        // In the vacuum infinitely far is clear, which 0 * infinity would not say.
        self.sigma_t.iter().map(|&s| if s == 0.0 { 1.0 } else { (-s * t).exp() }).collect()
    }

    fn scatters(&self) -> bool {
        self.sigma_s.iter().any(|&s| s > 0.0)
    }

    /// Where the path scatters before `t_max`, by the free flight of one of its wavelengths. Mere absorption is never sampled.
    pub(super) fn sample_flight(&self, t_max: f64, rng: &mut Rng) -> Option<f64> {
        if !self.scatters() {
            return None;
        }
        let sigma = self.sigma_t[((rng.next() * self.sigma_t.len() as f64) as usize).min(self.sigma_t.len() - 1)];
        let t = -(-rng.next()).ln_1p() / sigma;
        (t < t_max).then_some(t)
    }

    /// Factor on each wavelength of a path that flew past `t`: its transmittance over the probability of doing so.
    pub(super) fn weight_past(&self, t: f64) -> Vec<f64> {
        let pass = self.transmittance(t);
        if !self.scatters() {
            return pass;
        }
        let probability = mean(&pass);
        // Where no wavelength gets through, the path could not have come here but for a free flight of infinite length.
        pass.iter().map(|p| if probability > 0.0 { p / probability } else { 0.0 }).collect()
    }

    /// Factor on each wavelength of a path that scattered at `t`: `sigma_s` times transmittance over the density of doing so.
    pub(super) fn weight_scatter(&self, t: f64) -> Vec<f64> {
        let pass = self.transmittance(t);
        let density = mean(&self.sigma_t.iter().zip(&pass).map(|(s, p)| s * p).collect::<Vec<_>>());
        self.sigma_s.iter().zip(&pass).map(|(s, p)| s * p / density).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
