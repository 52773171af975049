//! `abbe bench`: speed and error of renders, one row for each scene.

use super::load::Overrides;
use super::print::{out, percent, si};
use super::render::StopArgs;
use super::{Done, Outcome, device, interrupt, progress::Bar};
use crate::color::bins::bin_weights;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::SpectralImage;
use crate::render::{Summary, render};
use crate::spectrum::library::Observer;
use serde_json::json;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

const EXAMPLES: &str = "Examples:
  abbe bench scenes/cornell_spheres.json --spp 64
  abbe bench scenes/*.json --time 10s --json
  abbe bench scenes/compare/pool.json --reference pool.exr

relMSE is the mean over pixels of (Y - Yref)^2 / (Yref^2 + 0.01 <Yref>^2), Y being luminance from the bins. The reference is the
EXR given, or reference.exr in the folder SCENE (the scene's file without .json) where there is one; it sets the resolution
unless --size is given.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scenes to render [default: scenes/*.json]
    #[arg(value_name = "SCENES")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    stop: StopArgs,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Part of a device's name (see 'abbe devices'), or 'reference'
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Spectral EXR to compare with
    #[arg(long, value_name = "EXR")]
    reference: Option<PathBuf>,
    /// Print one JSON object per row
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let scenes = if args.scenes.is_empty() { shipped_scenes()? } else { args.scenes.clone() };
    if !args.json {
        out(&format!(
            "{:<20} {:>6} {:>8} {:>8} {:>12} {:>9} {:>9}  device",
            "scene", "spp", "set-up/s", "render/s", "rays/s", "error", "relMSE"
        ));
    }
    interrupt::heed();
    for path in &scenes {
        let row = measure(args, path)?;
        out(&if args.json { row.json() } else { row.text() });
        if interrupt::requested() {
            return Ok(Done::Interrupted);
        }
    }
    Ok(Done::Completely)
}

fn shipped_scenes() -> Result<Vec<PathBuf>> {
    let remedy = "name scenes, or run this where Abbe's scenes/ folder is";
    let folder = std::fs::read_dir("scenes").map_err(|e| Error::file("scenes", format!("cannot list: {e}"), remedy))?;
    let files = folder.filter_map(|entry| entry.ok().map(|e| e.path()));
    let mut scenes: Vec<PathBuf> =
        files.filter(|p| p.extension().is_some_and(|e| e == "json") && !p.to_string_lossy().ends_with(".schema.json")).collect();
    scenes.sort();
    if scenes.is_empty() { Err(Error::file("scenes", "holds no scenes", remedy)) } else { Ok(scenes) }
}

struct Row {
    scene: String,
    device: String,
    setup: f64,
    summary: Summary,
    relative_mse: Option<f64>,
}

fn measure(args: &Args, path: &Path) -> Result<Row> {
    let beside = path.with_extension("").join("reference.exr");
    let reference = match &args.reference {
        Some(path) => Some(path.clone()),
        None => beside.exists().then_some(beside),
    };
    let reference = reference.map(|path| SpectralImage::read(&path).map(|image| (path, image))).transpose()?;
    let mut overrides = args.overrides.clone();
    if let (None, Some((_, image))) = (overrides.size, &reference) {
        overrides.size = u32::try_from(image.width).ok().zip(u32::try_from(image.height).ok());
    }
    let scene = overrides.load(path)?;
    let start = Instant::now();
    let mut film = Film::try_new(&scene.film)?;
    let mut device = device::open(&scene, args.device.as_deref(), args.seed)?;
    let setup = start.elapsed().as_secs_f64();
    let bar = Bar::new(args.json);
    let summary = render(device.integrator.as_mut(), &mut film, &args.stop.into(), &mut |p| {
        bar.update(p);
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.clear();
    let relative_mse = reference.map(|(path, image)| relative_mse(&film, &path, &image)).transpose()?;
    Ok(Row { scene: scene.name.clone(), device: device.name, setup, summary: summary?, relative_mse })
}

/// Mean over pixels of `(Y - Yref)^2 / (Yref^2 + 0.01 <Yref>^2)`. Both luminances come from bin averages by the same weights, so
/// that they differ by what was rendered alone.
fn relative_mse(film: &Film, path: &Path, reference: &SpectralImage) -> Result<f64> {
    let bins = &film.settings().bins;
    let same_bins = reference.bins() == film.bins()
        && reference.wavelengths_nm.iter().enumerate().all(|(b, nm)| (nm - bins.centre_nm(b as u32)).abs() < 1e-3);
    let (width, height) = (film.settings().width as usize, film.settings().height as usize);
    if !same_bins || (width, height) != (reference.width, reference.height) {
        let problem = format!(
            "{}x{} with {} wavelengths does not match the render, {width}x{height} with {} bins",
            reference.width,
            reference.height,
            reference.bins(),
            film.bins()
        );
        return Err(Error::file(path, problem, "render with the size and bins of the reference"));
    }
    let weights = bin_weights(bins, Observer::Cie1931);
    let y = |values: &mut dyn Iterator<Item = f64>| -> f64 { values.zip(&weights).map(|(v, w)| v * w[1]).sum() };
    let pairs: Vec<(f64, f64)> = (0..film.pixels())
        .map(|p| (y(&mut film.pixel(p).iter().copied()), y(&mut reference.pixel(p).iter().map(|&v| f64::from(v)))))
        .collect();
    let mean = pairs.iter().map(|(_, reference)| reference).sum::<f64>() / pairs.len() as f64;
    let floor = (0.01 * mean * mean).max(f64::MIN_POSITIVE);
    Ok(pairs.iter().map(|(y, r)| (y - r).powi(2) / (r * r + floor)).sum::<f64>() / pairs.len() as f64)
}

impl Row {
    fn text(&self) -> String {
        let p = &self.summary.progress;
        format!(
            "{:<20} {:>6} {:>8.2} {:>8.2} {:>12} {:>9} {:>9}  {}",
            self.scene,
            p.spp,
            self.setup,
            p.elapsed.as_secs_f64(),
            si(p.rays_per_second),
            percent(p.relative_error),
            self.relative_mse.map_or("-".to_string(), |e| format!("{e:.2e}")),
            self.device
        )
    }

    fn json(&self) -> String {
        let p = &self.summary.progress;
        json!({
            "scene": self.scene,
            "device": self.device,
            "samples_per_pixel": p.spp,
            "setup_seconds": self.setup,
            "seconds": p.elapsed.as_secs_f64(),
            "rays": p.stats.rays,
            "rays_per_second": p.rays_per_second,
            "relative_error": p.relative_error.is_finite().then_some(p.relative_error),
            "relative_mse": self.relative_mse,
            "dropped": p.stats.dropped_not_finite + p.stats.dropped_negative + p.stats.dropped_saturated,
        })
        .to_string()
    }
}
