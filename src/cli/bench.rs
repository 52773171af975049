//! `abbe bench`: speed and error of renders, one row for each scene.

use super::bench_scenes;
use super::load::Overrides;
use super::print::{out, percent, si};
use super::render::StopArgs;
use super::{Done, Outcome, device, interrupt, progress::Bar};
use crate::color::bins::bin_weights;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::difference::{self, Measurement};
use crate::render::{Summary, render};
use crate::spectrum::library::Observer;
use serde_json::json;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

const EXAMPLES: &str = "Examples:
  abbe bench cornell_box triangles_70k --spp 64 --size 512x512
  abbe bench scenes/*.json --time 10s --json
  abbe bench scenes/compare/pool.json --reference pool.exr

'cornell_box' (a diffuse box of 12 triangles) and 'triangles_70k' (a diffuse ball of 70,000 triangles in that box) are built in.
camera/s are the rays per second of the camera pass, all its shading included; rays/s are those of all passes over the whole time.

relMSE is the mean over pixels of ((v - r)^2 - e^2) / (r^2 + 0.01 <r>^2): of luminance from the bins, and the mean over bins. The
reference r is the EXR given, NAME/reference.exr in the folder given, or reference.exr in the folder SCENE (the scene's file without
.json) where there is one; it sets the resolution unless --size is given. e, the reference's own error, is read from its error channels
or a file beside it whose name ends in _error.exr, one draw of the standard error per pixel and bin; without either it is 0.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scenes to render [default: cornell_box triangles_70k scenes/compare/*.json]
    #[arg(value_name = "SCENES")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    #[command(flatten)]
    stop: StopArgs,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    techniques: device::TechniqueArgs,
    /// Part of a device's name (see 'abbe devices'), or 'reference'
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Spectral EXR to compare with, or a folder of folders with one for each scene
    #[arg(long, value_name = "PATH")]
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
            "{:<20} {:>6} {:>8} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9}  device",
            "scene", "spp", "set-up/s", "render/s", "rays/s", "camera/s", "error", "relMSE Y", "bins"
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
    let path = Path::new("scenes/compare");
    let folder = std::fs::read_dir(path).map_err(|e| Error::file(path, format!("cannot list: {e}"), remedy))?;
    let files = folder.filter_map(|entry| entry.ok().map(|e| e.path()));
    let mut scenes: Vec<PathBuf> = files.filter(|p| p.extension().is_some_and(|e| e == "json")).collect();
    scenes.sort();
    if scenes.is_empty() {
        return Err(Error::file(path, "holds no scenes", remedy));
    }
    Ok(bench_scenes::NAMES.iter().map(PathBuf::from).chain(scenes).collect())
}

/// What a render is compared with.
struct Reference {
    path: PathBuf,
    measured: Measurement,
}

impl Reference {
    fn of(args: &Args, scene: &Path) -> Result<Option<Self>> {
        let path = match &args.reference {
            Some(given) if given.is_dir() => given.join(scene.file_stem().unwrap_or_default()).join("reference.exr"),
            Some(given) => given.clone(),
            None => scene.with_extension("").join("reference.exr"),
        };
        let given = args.reference.as_ref().is_some_and(|given| *given == path);
        if given || path.exists() { Ok(Some(Reference { measured: Measurement::read(&path, None)?, path })) } else { Ok(None) }
    }
}

struct Row {
    scene: String,
    device: String,
    setup: f64,
    summary: Summary,
    relative_mse: Option<RelativeMse>,
}

fn measure(args: &Args, path: &Path) -> Result<Row> {
    let reference = Reference::of(args, path)?;
    let mut overrides = args.overrides.clone();
    if let (None, Some(Reference { measured: Measurement { image, .. }, .. })) = (overrides.size, &reference) {
        overrides.size = u32::try_from(image.width).ok().zip(u32::try_from(image.height).ok());
    }
    let scene = match bench_scenes::built_in(path, &overrides.options()) {
        Some(scene) => scene?,
        None => overrides.load(path)?,
    };
    let start = Instant::now();
    let mut film = Film::try_new(&scene.film)?;
    let mut device = device::open(&scene, args.device.as_deref(), args.seed, &args.techniques)?;
    let setup = start.elapsed().as_secs_f64();
    let bar = Bar::new(args.json);
    let summary = render(device.integrator.as_mut(), &mut film, &args.stop.into(), &mut |p| {
        bar.update(p);
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.clear();
    let relative_mse = reference.map(|r| relative_mse(&film, &r)).transpose()?;
    Ok(Row { scene: scene.name.clone(), device: device.name, setup, summary: summary?, relative_mse })
}

/// Mean squared errors relative to a reference, net of its own.
struct RelativeMse {
    luminance: f64,
    /// Mean over the bins.
    bins: f64,
}

/// Errors as [`EXAMPLES`] has them. Both luminances come from bin averages by the same weights, so that they differ by what was
/// rendered alone.
fn relative_mse(film: &Film, reference: &Reference) -> Result<RelativeMse> {
    let (bins, image) = (&film.settings().bins, &reference.measured.image);
    let same_bins = image.bins() == film.bins()
        && image.wavelengths_nm.iter().enumerate().all(|(b, nm)| (nm - bins.centre_nm(b as u32)).abs() < 1e-3);
    let (width, height) = (film.settings().width as usize, film.settings().height as usize);
    if !same_bins || (width, height) != (image.width, image.height) {
        let problem = format!(
            "{}x{} with {} wavelengths does not match the render, {width}x{height} with {} bins",
            image.width,
            image.height,
            image.bins(),
            film.bins()
        );
        return Err(Error::file(&reference.path, problem, "render with the size and bins of the reference"));
    }
    // The error of a weighted sum of bins.
    let score = |weights: &[(usize, f64)]| {
        let ours: Vec<f64> = (0..film.pixels()).map(|p| weights.iter().map(|(b, w)| film.bin(p, *b) * w).sum()).collect();
        difference::relative_mse(&ours, &reference.measured.weighted(weights), &reference.measured.variance(weights))
    };
    let y: Vec<(usize, f64)> = bin_weights(bins, Observer::Cie1931).iter().map(|w| w[1]).enumerate().collect();
    let per_bin = (0..film.bins()).map(|b| score(&[(b, 1.0)])).sum::<f64>() / film.bins() as f64;
    Ok(RelativeMse { luminance: score(&y), bins: per_bin })
}

impl Row {
    /// Rays per second of the GPU's camera pass by itself.
    fn camera_rays_per_second(&self) -> Option<f64> {
        let stats = &self.summary.progress.stats;
        (stats.camera_rays > 0).then(|| stats.camera_rays as f64 / stats.camera_time.as_secs_f64().max(1e-9))
    }

    fn text(&self) -> String {
        let p = &self.summary.progress;
        let error = |e: Option<f64>| e.map_or("-".to_string(), |e| format!("{e:.2e}"));
        format!(
            "{:<20} {:>6} {:>8.2} {:>8.2} {:>9} {:>9} {:>9} {:>9} {:>9}  {}",
            self.scene,
            p.spp,
            self.setup,
            p.elapsed.as_secs_f64(),
            si(p.rays_per_second),
            self.camera_rays_per_second().map_or("-".to_string(), si),
            percent(p.relative_error),
            error(self.relative_mse.as_ref().map(|e| e.luminance)),
            error(self.relative_mse.as_ref().map(|e| e.bins)),
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
            "camera_rays_per_second": self.camera_rays_per_second(),
            "relative_error": p.relative_error.is_finite().then_some(p.relative_error),
            "relative_mse": self.relative_mse.as_ref().map(|e| e.luminance),
            "relative_mse_bins": self.relative_mse.as_ref().map(|e| e.bins),
            "dropped": p.stats.dropped_not_finite + p.stats.dropped_negative + p.stats.dropped_saturated,
        })
        .to_string()
    }
}
