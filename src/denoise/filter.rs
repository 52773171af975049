//! The filter, in two steps: how much light there is, which has detail and little noise, and of which wavelengths, which has less detail and more noise.
//! Spectra are weighed relative to how much light there is, all bins and X, Y, Z by the same weights: no colour comes out that did not go in.

use super::kernel::{Feature, Guide, Halves, Kernel};
use super::planes::{Size, box_mean, mean, plane};
use super::select::{self, Comparison, Raw};

/// Guides that the bins are taken together to, at most.
const MOST_GUIDES: usize = 10;
/// k of the candidates: of light, and of spectra.
const LIGHT_WIDTHS: [f32; 3] = [0.7, 1.5, 4.0];
const SPECTRAL_WIDTHS: [f32; 3] = [0.5, 1.0, 3.0];
/// Pixels to every side of a patch: of light, and of spectra, whose guides are means over 3 x 3 pixels.
const LIGHT_PATCH: usize = 2;
const SPECTRAL_PATCH: usize = 1;
/// How candidates are compared: light, of which one value says less, and spectra. Of light without `wide` patches keep their grain, and with a greater factor
/// single glints are lost.
const LIGHT: Comparison = Comparison { radius: 2, wide: 6, factor: 1.0 };
const SPECTRA: Comparison = Comparison { radius: 1, wide: 1, factor: 1.25 };
/// What spectra are relative to is not less than this part of its mean.
const LEAST_LIGHT: f32 = 0.01;
/// Luminance of spectra is changed by this factor at most.
const MOST_CHANGE: f32 = 2.0;

/// What is to be filtered, row by row from the upper left.
#[derive(Debug)]
pub struct Noisy {
    /// Pixels.
    pub size: Size,
    /// Wavelength bins, which are the first channels; then X, Y, Z.
    pub bins: usize,
    /// Means, `[pixel][channel]`.
    pub mean: Vec<f32>,
    /// Half the differences of two halves of the samples.
    pub half: Vec<f32>,
    /// Standard errors `[pixel][bin]`, and of Y.
    pub error: (Vec<f32>, Vec<f32>),
    /// What is seen: means and half the differences; and whether it says something of colours.
    pub features: Vec<(Vec<f32>, Vec<f32>, bool)>,
}

/// What came of it.
#[derive(Debug)]
pub struct Filtered {
    /// Means, `[pixel][channel]`.
    pub mean: Vec<f32>,
    /// Their root mean square errors, bias included.
    pub error: Vec<f32>,
}

impl Noisy {
    /// Channels: the bins, then X, Y, Z.
    pub fn channels(&self) -> usize {
        self.bins + 3
    }

    /// Means, half differences and standard errors of luminance, and of radiance (mean over the bins).
    fn light(&self) -> [[Vec<f32>; 3]; 2] {
        let (channels, bins) = (self.channels(), self.bins);
        let y = |v: &[f32]| plane(self.size, |p| v[p * channels + bins + 1]);
        let all = |v: &[f32], channels| mean_over(self.size, v, channels, 0, bins);
        let of_y = [y(&self.mean), y(&self.half), self.error.1.clone()];
        [of_y, [all(&self.mean, channels), all(&self.half, channels), all(&self.error.0, bins)]]
    }

    /// Filters one plane; both halves.
    fn filter_light(&self, [mean, half, error]: &[Vec<f32>; 3], features: &[&Feature]) -> Halves {
        let size = self.size;
        let guide = Guide::new(size, mean, half, &plane(size, |p| error[p] * error[p]));
        let kernel = Kernel { size, guides: std::slice::from_ref(&guide), features, patch: LIGHT_PATCH, widths: &LIGHT_WIDTHS };
        let candidates = kernel.filter(&guide.halves, 1);
        let raw = Raw { mean, half, channels: 1 };
        select::blend(size, raw, &candidates, &select::shares(size, raw, &candidates, 1, LIGHT))
    }

    /// Spectra relative to `light`, as guides.
    fn spectral_guides(&self, light: &[f32], least: f32) -> Vec<Guide> {
        let (size, channels, bins) = (self.size, self.channels(), self.bins);
        let count = MOST_GUIDES.min(bins);
        let guide = |g: usize| {
            let (first, end) = (g * bins / count, (g + 1) * bins / count);
            let of = |v: &[f32], channels| {
                let band = mean_over(size, v, channels, first, end);
                plane(size, |p| band[p] / (light[p] + least))
            };
            let error = of(&self.error.0, bins);
            let variance = box_mean(&plane(size, |p| error[p] * error[p]), size, 1);
            Guide::new(
                size,
                &box_mean(&of(&self.mean, channels), size, 1),
                &box_mean(&of(&self.half, channels), size, 1),
                &variance,
            )
        };
        (0..count).map(guide).collect()
    }

    /// Filters it.
    pub fn filter(&self) -> Filtered {
        let (size, channels, bins) = (self.size, self.channels(), self.bins);
        let features: Vec<Feature> = self.features.iter().map(|(mean, half, _)| Feature::new(size, mean, half)).collect();
        let all: Vec<&Feature> = features.iter().collect();
        let of_color: Vec<&Feature> =
            features.iter().zip(&self.features).filter(|(_, (.., color))| *color).map(|(f, _)| f).collect();
        let [luminance, radiance] = self.light().map(|light| self.filter_light(&light, &all));

        let both = plane(size, |p| 0.5 * (radiance[0][p] + radiance[1][p]));
        let least = (LEAST_LIGHT * mean(&both)).max(f32::MIN_POSITIVE);
        let raw = Raw { mean: &self.mean, half: &self.half, channels };
        let guides = self.spectral_guides(&both, least);
        let kernel = Kernel { size, guides: &guides, features: &of_color, patch: SPECTRAL_PATCH, widths: &SPECTRAL_WIDTHS };
        // With them goes the light that they are relative to.
        let with_light = [1.0, -1.0].map(|sign: f32| {
            let light = &radiance[usize::from(sign < 0.0)];
            let wide = Size { width: size.width * (channels + 1), ..size };
            plane(wide, |at| {
                let (p, c) = (at / (channels + 1), at % (channels + 1));
                if c == channels { light[p] + least } else { self.mean[p * channels + c] + sign * self.half[p * channels + c] }
            })
        });
        let mut candidates = kernel.filter(&with_light, channels + 1);
        drop(with_light);
        for candidate in &mut candidates {
            for (filtered, light) in candidate.iter_mut().zip(&radiance) {
                let wide = Size { width: size.width * channels, ..size };
                *filtered = plane(wide, |at| {
                    let (p, c) = (at / channels, at % channels);
                    let of = &filtered[p * (channels + 1)..(p + 1) * (channels + 1)];
                    of[c] * (light[p] + least) / of[channels]
                });
            }
        }
        let shares = select::shares(size, raw, &candidates, bins, SPECTRA);
        let mut filtered = select::blend(size, raw, &candidates, &shares);
        for (filtered, luminance) in filtered.iter_mut().zip(&luminance) {
            let least = 1e-3 * mean(luminance) + f32::MIN_POSITIVE;
            for (values, y) in filtered.chunks_exact_mut(channels).zip(luminance) {
                let change = ((y + least) / (values[bins + 1] + least)).clamp(1.0 / MOST_CHANGE, MOST_CHANGE);
                values.iter_mut().for_each(|v| *v *= change);
            }
        }
        let mean = filtered[0].iter().zip(&filtered[1]).map(|(a, b)| 0.5 * (a + b)).collect();
        Filtered { mean, error: select::errors(size, raw, &filtered) }
    }
}

/// Means over channels from `first` to `end` of values `[pixel][channel]`.
fn mean_over(size: Size, values: &[f32], channels: usize, first: usize, end: usize) -> Vec<f32> {
    let share = 1.0 / (end - first) as f32;
    plane(size, |p| share * values[p * channels + first..p * channels + end].iter().sum::<f32>())
}
