//! `abbe compare`: how far two spectral EXRs of the same view are apart, for people and for scripts.

use super::bands::BandsArgs;
use super::print::{note, out};
use super::{Done, Outcome, values};
use crate::color::bins::{emission_weights, reflection_weights};
use crate::color::cie::{xyz_of, xyz_of_unit};
use crate::color::convert::{linear_srgb_of_xyz, xyz_of_linear_srgb};
use crate::compare::difference::{Measurement, ZTest, matches, relative_mse, rmse, z_test};
use crate::compare::flip::{PIXELS_PER_DEGREE, flip};
use crate::compare::lab::{delta_e_2000, lab_of_xyz};
use crate::develop::picture::{AUTO_SHARE, auto_exposure};
use crate::error::{Error, Result};
use crate::output::{Bands, Quantity, SpectralImage, check_writable, write_rgb};
use crate::spectrum::library::{Observer, illuminant};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  abbe compare newton.exr reference.exr
  abbe compare a.exr b.exr -o difference.png --picture delta-e
  abbe compare a.exr b.exr --max-rel-mse 1e-3 --max-delta-e 2 && echo alike
  abbe compare a.exr b.exr --z --json

A is held to the reference B. relMSE is the mean over pixels of ((a - b)^2 - e^2) / (b^2 + 0.01 <b>^2), e being B's own error where it is
known. Luminance and colours are those of the bins, of a reflectance under D65. Delta E2000 and FLIP see both at one exposure, B's unless told otherwise: white is D65, as
bright as an equal-energy spectrum of 2^-EV W m^-2 sr^-1 nm^-1; FLIP clips what is brighter and takes 67 pixels per degree.

z compares each bin's mean over the image with its standard error, all bins together at a false-alarm rate of 1e-3. Abbe's files have the
errors of the means in their headers. Elsewhere those of the pixels are taken as independent: the channels that 'abbe render --aov error'
writes, or a file beside the image whose name ends in _error.exr. Where only one file knows its errors, the other counts as exact.

Exit code 0: alike within all that was asked for; 1: not; 2: they cannot be compared.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Spectral EXR
    #[arg(value_name = "A.exr")]
    image: PathBuf,
    /// Spectral EXR to compare it with
    #[arg(value_name = "B.exr")]
    reference: PathBuf,
    /// Greatest relMSE of luminance that is still alike
    #[arg(long, value_name = "X", value_parser = values::limit)]
    max_rel_mse: Option<f64>,
    /// Greatest Delta E2000 that is still alike, of all but the worst 5 % of pixels
    #[arg(long, value_name = "X", value_parser = values::limit)]
    max_delta_e: Option<f64>,
    /// Greatest mean FLIP that is still alike, 0 to 1
    #[arg(long, value_name = "X", value_parser = values::limit)]
    max_flip: Option<f64>,
    /// Not alike where a bin's mean differs by more than the files' errors explain
    #[arg(long)]
    z: bool,
    /// Exposure for Delta E2000 and FLIP in stops [default: that of B's preview]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = values::finite)]
    exposure: Option<f64>,
    /// Picture of the difference: red where A is brighter or the colours differ, blue where B is brighter, grey where they agree
    #[arg(short, long, value_name = "OUT.png", value_parser = values::png)]
    output: Option<PathBuf>,
    /// What the picture shows
    #[arg(long, value_name = "WHAT", default_value = "luminance", requires = "output")]
    picture: Shown,
    /// Difference of the picture's fullest colour, cd m^-2 or Delta E [default: that of all but 1 % of pixels]
    #[arg(long, value_name = "X", value_parser = values::limit, requires = "output")]
    scale: Option<f64>,
    #[command(flatten)]
    bands: BandsArgs,
    /// Print one JSON object instead of lines
    #[arg(long)]
    json: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq)]
enum Shown {
    Luminance,
    DeltaE,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let bands = args.bands.bands()?;
    let (a, b) = alike(read(&args.image, bands.as_ref())?, read(&args.reference, bands.as_ref())?);
    matches(&a.image, &b.image)
        .map_err(|problem| Error::file(&args.image, format!("{problem} of {}", args.reference.display()), "render both alike"))?;
    let comparison = Comparison::of(&a, &b, args.exposure);
    let failures = comparison.failures(args)?;
    let scale = match &args.output {
        Some(path) => Some(comparison.draw(path, &a.image, args)?),
        None => None,
    };
    if args.json {
        out(&comparison.json(&a.image, scale, &failures).to_string());
    } else {
        out(&comparison.text(args, &a.image, scale, &failures));
    }
    Ok(if failures.is_empty() { Done::Completely } else { Done::Differently })
}

fn read(path: &Path, bands: Option<&Bands>) -> Result<Measurement> {
    let measured = Measurement::read(path, bands)?;
    match measured.image.data.iter().filter(|v| !v.is_finite()).count() {
        0 => Ok(measured),
        n => Err(Error::file(path, format!("{n} values are not finite"), "compare images that are whole")),
    }
}

/// Of files that have parts of one picture, what both have.
fn alike(a: Measurement, b: Measurement) -> (Measurement, Measurement) {
    let (of_a, of_b) = (a.image.window, b.image.window);
    match of_a.common(&of_b).filter(|_| of_a.picture == of_b.picture && of_a != of_b) {
        Some(common) => {
            note(&format!("note: compared where both files have pixels, {common}"));
            (a.cut(common), b.cut(common))
        }
        None => (a, b),
    }
}

/// All that is measured.
struct Comparison {
    /// Y of every pixel of both, cd m^-2.
    luminance: [Vec<f64>; 2],
    luminance_rmse: f64,
    luminance_relative_mse: f64,
    bins: Vec<Bin>,
    exposure: f64,
    delta_e: Vec<f64>,
    /// Of all pixels, sorted.
    delta_e_sorted: Vec<f64>,
    flip_mean: f64,
    flip_max: f64,
}

struct Bin {
    means: [f64; 2],
    rmse: f64,
    relative_mse: f64,
    z: std::result::Result<ZTest, &'static str>,
}

impl Comparison {
    fn of(a: &Measurement, b: &Measurement, exposure: Option<f64>) -> Self {
        let weights = xyz_weights(&a.image);
        let column = |i: usize| weights.iter().map(|w| w[i]).enumerate().collect::<Vec<(usize, f64)>>();
        let planes = |m: &Measurement| [0, 1, 2].map(|i| m.weighted(&column(i)));
        let ([xa, ya, za], [xb, yb, zb]) = (planes(a), planes(b));

        let bins = (0..a.image.bins()).map(|i| {
            let (values, reference) = (a.weighted(&[(i, 1.0)]), b.weighted(&[(i, 1.0)]));
            Bin {
                means: [a.mean(i).0, b.mean(i).0],
                rmse: rmse(&values, &reference),
                relative_mse: relative_mse(&values, &reference, &b.variance(&[(i, 1.0)])),
                z: z_test(a, b, i, a.image.bins()),
            }
        });
        let bins = bins.collect();

        let xyz = |x: &[f64], y: &[f64], z: &[f64]| -> Vec<[f64; 3]> { (0..x.len()).map(|p| [x[p], y[p], z[p]]).collect() };
        let (xyz_a, xyz_b) = (xyz(&xa, &ya, &za), xyz(&xb, &yb, &zb));
        let single = |xyz: &[[f64; 3]]| xyz.iter().map(|v| v.map(|v| v as f32)).collect::<Vec<_>>();
        let of_file = || b.image.attribute("EV").and_then(|ev| ev.parse().ok());
        let exposure = exposure.or_else(of_file).unwrap_or_else(|| auto_exposure(&single(&xyz_b), Observer::Cie1931, AUTO_SHARE));
        let gain = exposure.exp2() / xyz_of_unit(Observer::Cie1931)[1];
        let white = xyz_of_linear_srgb([1.0; 3]);
        let lab = |xyz: [f64; 3]| lab_of_xyz(xyz.map(|v| v * gain), white);
        let delta_e: Vec<f64> = xyz_a.par_iter().zip(&xyz_b).map(|(a, b)| delta_e_2000(lab(*a), lab(*b))).collect();
        let rgb = |xyz: &[[f64; 3]]| -> Vec<[f32; 3]> {
            xyz.iter().map(|v| linear_srgb_of_xyz(v.map(|v| v * gain)).map(|v| v as f32)).collect()
        };
        let flip = flip(&rgb(&xyz_b), &rgb(&xyz_a), a.image.width, PIXELS_PER_DEGREE);
        Comparison {
            luminance_rmse: rmse(&ya, &yb),
            luminance_relative_mse: relative_mse(&ya, &yb, &b.luminance_variance(&column(1))),
            luminance: [ya, yb],
            bins,
            exposure,
            delta_e_sorted: sorted(&delta_e),
            delta_e,
            flip_mean: flip.iter().map(|v| f64::from(*v)).sum::<f64>() / flip.len() as f64,
            flip_max: flip.iter().fold(0.0, |max, v| max.max(f64::from(*v))),
        }
    }

    /// Mean over bins.
    fn bins_relative_mse(&self) -> f64 {
        self.bins.iter().map(|b| b.relative_mse).sum::<f64>() / self.bins.len() as f64
    }

    fn delta_e_mean(&self) -> f64 {
        self.delta_e.iter().sum::<f64>() / self.delta_e.len() as f64
    }

    /// The z-test that is the furthest beyond its limit or the nearest to it, with its bin; why there is none, where one of them could not run.
    fn worst_z(&self) -> std::result::Result<(usize, ZTest), &'static str> {
        let tests = self.bins.iter().map(|b| b.z).collect::<std::result::Result<Vec<_>, _>>()?;
        let worst = tests.into_iter().enumerate().max_by(|a, b| (a.1.z.abs() / a.1.limit).total_cmp(&(b.1.z.abs() / b.1.limit)));
        worst.ok_or("there are no bins")
    }

    /// What exceeds its limit, in words. Fails where a limit is asked for that cannot be tried.
    fn failures(&self, args: &Args) -> Result<Vec<String>> {
        let mut failures: Vec<String> = [
            ("relMSE of luminance", self.luminance_relative_mse, args.max_rel_mse),
            ("Delta E2000 of 95 % of pixels", quantile(&self.delta_e_sorted, 0.95), args.max_delta_e),
            ("mean FLIP", self.flip_mean, args.max_flip),
        ]
        .into_iter()
        .filter_map(|(what, value, limit)| limit.filter(|l| value > *l).map(|l| format!("{what} is {value:.3e}, limit {l}")))
        .collect();
        if args.z {
            let (_, worst) = self.worst_z().map_err(|why| Error::usage("--z cannot be tried", why))?;
            if worst.z.abs() > worst.limit {
                let beyond = self.bins.iter().filter(|b| b.z.is_ok_and(|t| t.z.abs() > t.limit)).count();
                failures.push(format!("{beyond} of {} bins differ beyond their errors", self.bins.len()));
            }
        }
        Ok(failures)
    }

    fn text(&self, args: &Args, image: &SpectralImage, scale: Option<f64>, failures: &[String]) -> String {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let of = |share: f64| quantile(&self.delta_e_sorted, share);
        let (a, b) = (mean(&self.luminance[0]), mean(&self.luminance[1]));
        let mut lines = vec![
            format!("{} against {}", args.image.display(), args.reference.display()),
            format!("{}x{} pixels, {} wavelengths", image.width, image.height, image.bins()),
            format!(
                "luminance    mean {a:.6e} against {b:.6e}, RMSE {:.3e}, relMSE {:.3e}",
                self.luminance_rmse, self.luminance_relative_mse
            ),
            format!("bins         relMSE {:.3e}, their mean", self.bins_relative_mse()),
            format!(
                "Delta E2000  mean {:.3}, median {:.3}, 95 % {:.3}, max {:.3}, at EV {:.2}",
                self.delta_e_mean(),
                of(0.5),
                of(0.95),
                of(1.0),
                self.exposure
            ),
            format!("FLIP         mean {:.4}, max {:.4}", self.flip_mean, self.flip_max),
        ];
        lines.push(match self.worst_z() {
            Ok((bin, t)) => {
                let verdict = if t.z.abs() > t.limit { "beyond the errors" } else { "within the errors" };
                format!("z            worst {:+.2} at {} nm, limit {:.2}: {verdict}", t.z, image.wavelengths_nm[bin], t.limit)
            }
            Err(why) => format!("z            not run: {why}"),
        });
        lines.push(format!("{:>8}  {:>12}  {:>12}  {:>9}  {:>10}  {:>7}", "nm", "mean A", "mean B", "RMSE", "relMSE", "z"));
        for (bin, nm) in self.bins.iter().zip(&image.wavelengths_nm) {
            let z = bin.z.map_or("-".to_string(), |t| format!("{:+.2}", t.z));
            let [a, b] = bin.means;
            lines.push(format!("{nm:>8.2}  {a:>12.6e}  {b:>12.6e}  {:>9.3e}  {:>10.3e}  {z:>7}", bin.rmse, bin.relative_mse));
        }
        if let (Some(scale), Some(path)) = (scale, &args.output) {
            let unit = if args.picture == Shown::Luminance { "cd m^-2" } else { "Delta E" };
            lines.push(format!("{}: fullest colour at {scale:.3e} {unit}", path.display()));
        }
        lines.extend(failures.iter().map(|f| format!("not alike: {f}")));
        lines.join("\n")
    }

    fn json(&self, image: &SpectralImage, scale: Option<f64>, failures: &[String]) -> Value {
        let list = |f: &dyn Fn(&Bin) -> f64| self.bins.iter().map(f).collect::<Vec<f64>>();
        let worst = self.worst_z();
        let z = worst.map(|(bin, t)| {
            let all: Vec<f64> = self.bins.iter().filter_map(|b| b.z.ok()).map(|t| t.z).collect();
            json!({"bins": all, "worst": t.z, "worst_nm": image.wavelengths_nm[bin], "limit": t.limit, "within": t.z.abs() <= t.limit})
        });
        json!({
            "alike": failures.is_empty(),
            "failures": failures,
            "size": format!("{}x{}", image.width, image.height),
            "luminance": {"rmse": self.luminance_rmse, "relative_mse": self.luminance_relative_mse},
            "bins": {
                "nm": image.wavelengths_nm,
                "mean_a": list(&|b| b.means[0]),
                "mean_b": list(&|b| b.means[1]),
                "rmse": list(&|b| b.rmse),
                "relative_mse": list(&|b| b.relative_mse),
                "relative_mse_mean": self.bins_relative_mse(),
            },
            "exposure": self.exposure,
            "delta_e_2000": {
                "mean": self.delta_e_mean(),
                "median": quantile(&self.delta_e_sorted, 0.5),
                "p95": quantile(&self.delta_e_sorted, 0.95),
                "max": quantile(&self.delta_e_sorted, 1.0),
            },
            "flip": {"mean": self.flip_mean, "max": self.flip_max},
            "z": z.as_ref().ok(),
            "z_not_run": z.as_ref().err(),
            "picture_scale": scale,
        })
    }

    /// Writes the picture and returns the difference of its fullest colour.
    fn draw(&self, path: &Path, image: &SpectralImage, args: &Args) -> Result<f64> {
        check_writable(path, args.bands.table())?;
        let difference: Vec<f64> = match args.picture {
            Shown::Luminance => self.luminance[0].iter().zip(&self.luminance[1]).map(|(a, b)| a - b).collect(),
            Shown::DeltaE => self.delta_e.clone(),
        };
        let sizes = sorted(&difference.iter().map(|d| d.abs()).collect::<Vec<_>>());
        let scale = args.scale.unwrap_or_else(|| quantile(&sizes, 0.99)).max(f64::MIN_POSITIVE);
        let pixels: Vec<u8> = difference.iter().flat_map(|d| false_color(d / scale)).collect();
        write_rgb(path, image.width as u32, image.height as u32, &pixels)?;
        Ok(scale)
    }
}

/// Weights that turn the bins of an image into XYZ; of a reflectance, lit by D65 as bright as the equal-energy spectrum of 1.
fn xyz_weights(image: &SpectralImage) -> Vec<[f64; 3]> {
    const OBSERVER: Observer = Observer::Cie1931;
    match (image.quantity, illuminant("D65")) {
        (Quantity::Reflective, Some(light)) => {
            let gain = xyz_of_unit(OBSERVER)[1] / xyz_of(&light, OBSERVER)[1];
            reflection_weights(image.edges_nm(), OBSERVER, &light.scaled(gain))
        }
        _ => emission_weights(image.edges_nm(), OBSERVER),
    }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// The value that a `share` of `sorted` does not exceed.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}

/// sRGB of a difference: from blue at -1 by way of light grey to red at 1 (the ends and middle of Moreland, "Diverging Color Maps for Scientific
/// Visualization", 2009).
fn false_color(difference: f64) -> [u8; 3] {
    const MIDDLE: [f64; 3] = [221.0, 221.0, 221.0];
    let end = if difference < 0.0 { [59.0, 76.0, 192.0] } else { [180.0, 4.0, 38.0] };
    let t = difference.abs().min(1.0);
    std::array::from_fn(|i| (MIDDLE[i] + t * (end[i] - MIDDLE[i])).round() as u8)
}
