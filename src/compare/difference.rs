//! The difference between two images of the same pixels: squared errors, and tests whether it is more than their errors explain.

use crate::error::Result;
use crate::output::{Bands, SpectralImage, Window};
use std::path::Path;

/// An image with what is known of its standard errors.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// The image.
    pub image: SpectralImage,
    /// Standard errors `[pixel][wavelength]`.
    pub errors: Option<Vec<f32>>,
    /// Degrees of freedom of each of [`Measurement::errors`].
    pub dof: f64,
    /// Standard errors of the mean of every wavelength over all pixels, correlations between pixels included.
    pub mean_errors: Option<Vec<f64>>,
    /// Degrees of freedom of each of [`Measurement::mean_errors`].
    pub mean_dof: f64,
}

impl Measurement {
    /// Reads an image; its errors from its own channels and header, or else from a file beside it whose name ends in `_error.exr`: there
    /// every value is one draw of the standard error, such as half the difference of two independent halves of a render.
    ///
    /// # Errors
    /// [`crate::Error::File`] as of [`SpectralImage::read_with`], and where the file beside it does not match.
    pub fn read(path: &Path, bands: Option<&Bands>) -> Result<Self> {
        let image = SpectralImage::read_with(path, bands)?;
        let mean_errors = image.attribute("abbe.meanErrors").and_then(|text| {
            let errors: Vec<f64> =
                text.split(' ').map(|t| t.parse().ok().filter(|e: &f64| e.is_finite())).collect::<Option<_>>()?;
            (errors.len() == image.bins()).then_some(errors)
        });
        let dof = |groups: &str| image.attribute(groups).and_then(|n| n.parse().ok()).map_or(f64::INFINITY, |n: f64| n - 1.0);
        let batches_dof = dof("abbe.batches");
        let mean_dof = dof("abbe.meanGroups").min(batches_dof);
        if let Some(errors) = image.errors() {
            return Ok(Measurement { image, errors: Some(errors), dof: batches_dof, mean_errors, mean_dof });
        }
        let mut name = path.file_stem().unwrap_or_default().to_os_string();
        name.push("_error.exr");
        let beside = path.with_file_name(name);
        let errors = if beside.exists() {
            let error = SpectralImage::read_with(&beside, bands)?;
            matches(&error, &image).map_err(|problem| {
                crate::Error::file(&beside, format!("{problem} of {}", path.display()), "remove it, or put the right one there")
            })?;
            Some(error.data)
        } else {
            None
        };
        let dof = if errors.is_some() { 1.0 } else { batches_dof };
        Ok(Measurement { image, errors, dof, mean_errors, mean_dof })
    }

    /// What lies in `window`, one of the same picture. The error of a part's mean is not known but for those of its pixels.
    ///
    /// # Panics
    /// As [`SpectralImage::cut`].
    pub fn cut(self, window: Window) -> Self {
        if self.image.window == window {
            return self;
        }
        let of_errors = |data: Vec<f32>| {
            let mut image = self.image.clone();
            image.data = data;
            image.cut(window).data
        };
        let errors = self.errors.map(of_errors);
        Measurement { image: self.image.cut(window), errors, mean_errors: None, ..self }
    }

    /// Of every pixel, the sum over `weights`, pairs of a wavelength's index and its factor.
    pub fn weighted(&self, weights: &[(usize, f64)]) -> Vec<f64> {
        let pixel = |values: &[f32]| weights.iter().map(|(b, w)| f64::from(values[*b]) * w).sum();
        self.image.data.chunks_exact(self.image.bins()).map(pixel).collect()
    }

    /// The variance of [`Measurement::weighted`], errors of different wavelengths taken as independent; 0 where none is known.
    pub fn variance(&self, weights: &[(usize, f64)]) -> Vec<f64> {
        let pixel = |errors: &[f32]| weights.iter().map(|(b, w)| (f64::from(errors[*b]) * w).powi(2)).sum();
        match &self.errors {
            Some(errors) => errors.chunks_exact(self.image.bins()).map(pixel).collect(),
            None => vec![0.0; self.image.width * self.image.height],
        }
    }

    /// The variance of [`Measurement::weighted`] where `weights` make it luminance, cd m^-2. Paths that carry all wavelengths make the errors of bins alike,
    /// so that of luminance does not follow from them: it is taken from the file where it has it, and from bins as if they were independent where not.
    pub fn luminance_variance(&self, weights: &[(usize, f64)]) -> Vec<f64> {
        match self.image.other("error.Y").filter(|errors| errors.iter().all(|e| e.is_finite())) {
            Some(errors) => errors.iter().map(|e| f64::from(*e).powi(2)).collect(),
            None => self.variance(weights),
        }
    }

    /// Mean of a wavelength over all pixels, with its variance and the degrees of freedom of that; `None` where no error is known.
    pub fn mean(&self, bin: usize) -> (f64, Option<(f64, f64)>) {
        let bins = self.image.bins();
        let pixels = (self.image.data.len() / bins) as f64;
        let mean = self.image.data.iter().skip(bin).step_by(bins).map(|v| f64::from(*v)).sum::<f64>() / pixels;
        let of_pixels = |errors: &Vec<f32>| {
            let powers = errors.iter().skip(bin).step_by(bins).map(|e| f64::from(*e).powi(2));
            let (sum, squares) = powers.fold((0.0, 0.0), |(sum, squares), v| (sum + v, squares + v * v));
            // Welch & Satterthwaite: few bright dots leave few degrees of freedom.
            (sum / (pixels * pixels), if squares > 0.0 { self.dof * sum * sum / squares } else { f64::INFINITY })
        };
        let error = match (&self.mean_errors, &self.errors) {
            (Some(errors), _) => Some((errors[bin].powi(2), self.mean_dof)),
            (None, errors) => errors.as_ref().map(of_pixels),
        };
        (mean, error)
    }
}

/// Whether two images have the same quantity, size and wavelengths; the error says what the first has and what not.
pub fn matches(a: &SpectralImage, b: &SpectralImage) -> std::result::Result<(), String> {
    let same_nm = a.bins() == b.bins() && a.wavelengths_nm.iter().zip(&b.wavelengths_nm).all(|(a, b)| (a - b).abs() < 1e-3);
    if same_nm && (a.window.size, a.quantity) == (b.window.size, b.quantity) {
        return Ok(());
    }
    let describe = |i: &SpectralImage| {
        let (first, last) = (i.wavelengths_nm[0], i.wavelengths_nm[i.bins() - 1]);
        format!("{:?} {}x{} with {} wavelengths from {first} to {last} nm", i.quantity, i.width, i.height, i.bins())
            .to_lowercase()
    };
    Err(format!("{} does not match the {}", describe(a), describe(b)))
}

/// Root of the mean square of `values - reference`.
pub fn rmse(values: &[f64], reference: &[f64]) -> f64 {
    (values.iter().zip(reference).map(|(v, r)| (v - r).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// The mean over pixels of `((v - r)^2 - e^2) / (r^2 + 0.01 <r>^2)`, `e^2` being the reference's own `variance` and `<r>` its mean; the second
/// term keeps dark pixels from ruling.
pub fn relative_mse(values: &[f64], reference: &[f64], variance: &[f64]) -> f64 {
    let pixels = values.len() as f64;
    let mean = reference.iter().sum::<f64>() / pixels;
    let floor = (0.01 * mean * mean).max(f64::MIN_POSITIVE);
    let pixel = |((v, r), own): ((&f64, &f64), &f64)| ((v - r).powi(2) - own) / (r * r + floor);
    values.iter().zip(reference).zip(variance).map(pixel).sum::<f64>() / pixels
}

/// Two means in units of the error of their difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZTest {
    /// The first less the second, in standard errors.
    pub z: f64,
    /// Beyond this |z| there is a difference.
    pub limit: f64,
}

/// Share of a mean that single precision may take or add, whatever the errors say.
const ROUNDING: f64 = 1e-6;

/// Degrees of freedom below which a standard error is itself too uncertain to test by: those of 16 batches.
const LEAST_DOF: f64 = 15.0;

/// Compares the means of wavelength `bin` over all pixels; one of `family` such tests, all together with a false-alarm rate of 1e-3. An image
/// that does not know its errors is taken to be exact; where neither does, or too little is behind them, the error says so.
pub fn z_test(a: &Measurement, b: &Measurement, bin: usize, family: usize) -> std::result::Result<ZTest, &'static str> {
    let ((mean_a, error_a), (mean_b, error_b)) = (a.mean(bin), b.mean(bin));
    let errors = [error_a, error_b];
    if errors.iter().all(Option::is_none) {
        return Err("neither file has errors; compare files of which one at least does");
    }
    let rounding = (ROUNDING * mean_a.abs().max(mean_b.abs())).powi(2);
    let variance = errors.iter().flatten().map(|e| e.0).sum::<f64>() + rounding;
    // Welch & Satterthwaite again, for the two together.
    let spread: f64 = errors.iter().flatten().map(|(v, dof)| v * v / dof).sum();
    let dof = if spread > 0.0 { variance * variance / spread } else { f64::INFINITY };
    if dof < LEAST_DOF {
        return Err("the errors come from fewer than 16 batches; render with more samples");
    }
    let z = if mean_a == mean_b { 0.0 } else { (mean_a - mean_b) / variance.sqrt() };
    Ok(ZTest { z, limit: threshold(family, dof) })
}

/// Two-sided threshold of Student's t with `dof` degrees of freedom for one of `family` tests, all together at a false-alarm rate of 1e-3
/// (Sidak; Cornish-Fisher expansion, Abramowitz & Stegun 26.7.5).
pub fn threshold(family: usize, dof: f64) -> f64 {
    let z = normal_quantile(0.5 * -f64::exp_m1((-1e-3f64).ln_1p() / family as f64));
    z + (z.powi(3) + z) / (4.0 * dof) + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * dof * dof)
}

/// Upper quantile of the standard normal distribution (Abramowitz & Stegun 26.2.23, error below 4.5e-4).
fn normal_quantile(p: f64) -> f64 {
    let t = (-2.0 * p.ln()).sqrt();
    t - (2.515517 + 0.802853 * t + 0.010328 * t * t) / (1.0 + 1.432788 * t + 0.189269 * t * t + 0.001308 * t.powi(3))
}
