//! The filter, in two steps: how much light there is, which has detail and little noise, and of which wavelengths, which has less detail and more noise.
//! Spectra are weighed relative to how much light there is, all bins and X, Y, Z by the same weights: no colour comes out that did not go in.

use super::kernel::{Feature, Guide, Kernel};
use super::planes::{Size, box_mean, mean, mean_plane, plane};
use super::rows::{RADIUS, WIDTHS};
use super::select::{self, Comparison, Raw};

/// Guides that the bins are taken together to, at most.
const MOST_GUIDES: usize = 10;
/// k of the candidates: of light, and of spectra.
const LIGHT_WIDTHS: [f32; WIDTHS] = [0.7, 1.5, 4.0];
const SPECTRAL_WIDTHS: [f32; WIDTHS] = [0.5, 1.0, 3.0];
/// Pixels to every side of a patch: of light, and of spectra, whose guides are means over 3 x 3 pixels.
const LIGHT_PATCH: usize = 2;
const SPECTRAL_PATCH: usize = 1;
/// How candidates are compared: light, of which one value says less, and spectra. Of light without `wide` patches keep their grain, and with a greater factor
/// single glints are lost.
const LIGHT: Comparison = Comparison { radius: 2, wide: 6, factor: 1.0 };
const SPECTRA: Comparison = Comparison { radius: 1, wide: 1, factor: 1.25 };
/// Pixels to every side that a pixel of a look may be like, which has to be there soon.
const LOOK_REACH: usize = 4;
/// Of a look, what is not filtered must be better by this factor: after a few samples grain that is left draws the eye, and a glint comes out later.
const LOOK_FACTOR: f32 = 10.0;
/// What spectra are relative to is not less than this part of its mean.
const LEAST_LIGHT: f32 = 0.01;
/// Luminance of spectra is changed by this factor at most.
const MOST_CHANGE: f32 = 2.0;

/// What is to be filtered, plane by plane.
#[derive(Debug)]
pub struct Noisy {
    /// Pixels.
    pub size: Size,
    /// Means: wavelength bins, if any, then X, Y, Z.
    pub mean: Vec<Vec<f32>>,
    /// Half the differences of two halves of the samples.
    pub half: Vec<Vec<f32>>,
    /// Standard errors of the bins, or without any of X, Y, Z; then of Y.
    pub error: Vec<Vec<f32>>,
    /// What is seen: means and half the differences; and whether it says something of colours.
    pub features: Vec<(Vec<f32>, Vec<f32>, bool)>,
}

/// What came of it.
#[derive(Debug)]
pub struct Filtered {
    /// Means: wavelength bins, then X, Y, Z.
    pub mean: Vec<Vec<f32>>,
    /// Their root mean square errors, bias included.
    pub error: Vec<Vec<f32>>,
}

impl Noisy {
    /// Wavelength bins.
    pub fn bins(&self) -> usize {
        self.mean.len() - 3
    }

    /// Whether there are no bins: it is to be looked at, soon, and X, Y, Z say of which wavelengths light is.
    fn is_look(&self) -> bool {
        self.bins() == 0
    }

    /// Planes that say of which wavelengths light is.
    fn compared(&self) -> usize {
        if self.is_look() { 3 } else { self.bins() }
    }

    /// Pixels to every side that a pixel may be like.
    fn reach(&self) -> usize {
        if self.is_look() { LOOK_REACH } else { RADIUS }
    }

    /// How candidates are compared, `usual` where there are bins.
    fn comparison(&self, usual: Comparison) -> Comparison {
        if self.is_look() { Comparison { factor: LOOK_FACTOR, ..usual } } else { usual }
    }

    /// Filters one plane, of which there are means, half differences and standard errors; both halves.
    fn filter_light(&self, mean: Vec<f32>, half: Vec<f32>, error: &[f32], features: &[&Feature]) -> [Vec<f32>; 2] {
        let size = self.size;
        let guide = Guide::new(size, &mean, &half, &plane(size, |p| error[p] * error[p]));
        let kernel = Kernel::<LIGHT_PATCH> {
            size,
            guides: std::slice::from_ref(&guide),
            features,
            widths: LIGHT_WIDTHS,
            reach: self.reach(),
        };
        let even = vec![1.0; size.pixels()];
        let candidates = kernel.filter(&guide.halves.clone().map(|half| vec![half]), [&even, &even]);
        let raw = Raw { mean: &[mean], half: &[half] };
        let shares = select::shares(size, raw, &candidates, 1, self.comparison(LIGHT));
        select::blend(size, raw, &candidates, &shares).map(|mut planes| planes.swap_remove(0))
    }

    /// Spectra relative to `light`, as guides.
    fn spectral_guides(&self, light: &[f32], least: f32) -> Vec<Guide> {
        let (size, bins) = (self.size, self.compared());
        let count = MOST_GUIDES.min(bins);
        let guide = |g: usize| {
            let band = g * bins / count..(g + 1) * bins / count;
            let of = |planes: &[Vec<f32>]| {
                let band = mean_plane(size, &planes[band.clone()]);
                plane(size, |p| band[p] / (light[p] + least))
            };
            let error = of(&self.error);
            let variance = box_mean(&plane(size, |p| error[p] * error[p]), size, 1);
            Guide::new(size, &box_mean(&of(&self.mean), size, 1), &box_mean(&of(&self.half), size, 1), &variance)
        };
        (0..count).map(guide).collect()
    }

    /// Filters it.
    pub fn filter(&self) -> Filtered {
        let (size, bins) = (self.size, self.bins());
        let features: Vec<Feature> = self.features.iter().map(|(mean, half, _)| Feature::new(size, mean, half)).collect();
        let all: Vec<&Feature> = features.iter().collect();
        let of_color: Vec<&Feature> =
            features.iter().zip(&self.features).filter(|(_, (.., color))| *color).map(|(f, _)| f).collect();
        let luminance =
            self.filter_light(self.mean[bins + 1].clone(), self.half[bins + 1].clone(), &self.error[self.compared()], &all);
        // Mean over the bins.
        let of_bins = |planes: &[Vec<f32>]| mean_plane(size, &planes[..bins]);
        let radiance = match self.is_look() {
            true => luminance.clone(),
            false => self.filter_light(of_bins(&self.mean), of_bins(&self.half), &of_bins(&self.error), &all),
        };

        let both = mean_plane(size, &radiance);
        let least = (LEAST_LIGHT * mean(&both)).max(f32::MIN_POSITIVE);
        let guides = self.spectral_guides(&both, least);
        let kernel =
            Kernel::<SPECTRAL_PATCH> { size, guides: &guides, features: &of_color, widths: SPECTRAL_WIDTHS, reach: self.reach() };
        let raw = Raw { mean: &self.mean, half: &self.half };
        let halves = [0, 1].map(|half| (0..bins + 3).map(|c| plane(size, |p| raw.halves(c, p)[half])).collect());
        let [a, b] = radiance.map(|light| plane(size, |p| light[p] + least));
        let candidates = kernel.filter(&halves, [&a, &b]);
        drop((halves, guides));
        let shares = select::shares(size, raw, &candidates, self.compared(), self.comparison(SPECTRA));
        let mut filtered = select::blend(size, raw, &candidates, &shares);
        for (filtered, luminance) in filtered.iter_mut().zip(&luminance) {
            let least = 1e-3 * mean(luminance) + f32::MIN_POSITIVE;
            let y = &filtered[bins + 1];
            let change = plane(size, |p| ((luminance[p] + least) / (y[p] + least)).clamp(1.0 / MOST_CHANGE, MOST_CHANGE));
            filtered.iter_mut().for_each(|plane| plane.iter_mut().zip(&change).for_each(|(v, change)| *v *= change));
        }
        let error = select::errors(size, raw, &filtered);
        let [a, b] = &filtered;
        Filtered { mean: a.iter().zip(b).map(|(a, b)| plane(size, |p| 0.5 * (a[p] + b[p]))).collect(), error }
    }
}
