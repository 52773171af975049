//! What renders are compared with: stored references, and long renders that become such.

use super::Args;
use crate::cli::print::{note, percent};
use crate::cli::{device, interrupt, progress::Bar};
use crate::color::bins::bin_weights;
use crate::compare::difference::{self, Measurement};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::exr::Aovs;
use crate::output::{Provenance, write_exr};
use crate::render::{Rendering, Stop};
use crate::scene::{FilmSettings, Scene};
use crate::spectrum::library::Observer;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Time for a reference where nothing else is asked for.
const TIME: Duration = Duration::from_secs(600);
/// Mixed into the seed of a reference, so that it shares no random number with the renders compared with it.
const SEED: u64 = 0x7265_6665_7265_6e63;

/// What a render is compared with.
pub struct Reference {
    path: PathBuf,
    measured: Measurement,
}

/// Mean squared errors relative to a reference, net of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeMse {
    /// Of luminance.
    pub luminance: f64,
    /// Mean over the bins.
    pub bins: f64,
}

impl Reference {
    /// The reference of `scene`, if there is one: as `--reference` says, or beside the scene.
    pub fn of(given: Option<&Path>, scene: &Path) -> Result<Option<Self>> {
        let path = match given {
            Some(folder) if folder.is_dir() => stored(folder, scene),
            Some(file) => file.to_path_buf(),
            None => scene.with_extension("").join("reference.exr"),
        };
        let named = given.is_some_and(|given| given == path);
        if named || path.exists() { Ok(Some(Reference { measured: Measurement::read(&path, None)?, path })) } else { Ok(None) }
    }

    /// Width and height.
    pub fn size(&self) -> Option<(u32, u32)> {
        let image = &self.measured.image;
        u32::try_from(image.width).ok().zip(u32::try_from(image.height).ok())
    }

    /// Errors, as [`super::EXAMPLES`] has them, of an image for `film` whose bins are `value` of pixel and bin. Both luminances come from bin averages by the same weights, so that they differ by what was
    /// rendered alone.
    pub fn relative_mse(&self, film: &FilmSettings, value: impl Fn(usize, usize) -> f64) -> Result<RelativeMse> {
        let (bins, image) = (&film.bins, &self.measured.image);
        let count = bins.count as usize;
        let same_bins = image.bins() == count
            && image.wavelengths_nm.iter().enumerate().all(|(b, nm)| (nm - bins.centre_nm(b as u32)).abs() < 1e-3);
        let (width, height) = (film.width as usize, film.height as usize);
        if !same_bins || (width, height) != (image.width, image.height) {
            let problem = format!(
                "{}x{} with {} wavelengths does not match the render, {width}x{height} with {} bins",
                image.width,
                image.height,
                image.bins(),
                count
            );
            return Err(Error::file(&self.path, problem, "render with the size and bins of the reference"));
        }
        // The error of a weighted sum of bins.
        let score = |weights: &[(usize, f64)], variance: &[f64]| {
            let ours: Vec<f64> = (0..width * height).map(|p| weights.iter().map(|(b, w)| value(p, *b) * w).sum()).collect();
            difference::relative_mse(&ours, &self.measured.weighted(weights), variance)
        };
        let y: Vec<(usize, f64)> = bin_weights(bins, Observer::Cie1931).iter().map(|w| w[1]).enumerate().collect();
        let of_bin = |b: usize| score(&[(b, 1.0)], &self.measured.variance(&[(b, 1.0)]));
        let per_bin = (0..count).map(of_bin).sum::<f64>() / count as f64;
        Ok(RelativeMse { luminance: score(&y, &self.measured.luminance_variance(&y)), bins: per_bin })
    }
}

/// Where a folder of references keeps that of `scene`.
fn stored(folder: &Path, scene: &Path) -> PathBuf {
    folder.join(scene.file_stem().unwrap_or_default()).join("reference.exr")
}

/// Renders `scene`, loaded from `path`, and stores it in `folder` with its errors.
pub fn make(args: &Args, folder: &Path, path: &Path, scene: &Scene) -> Result<()> {
    let file = stored(folder, path);
    let place = file.parent().unwrap_or(folder);
    std::fs::create_dir_all(place)
        .map_err(|e| Error::file(place, format!("cannot be made: {e}"), "name a folder that can be written to"))?;
    let mut rendering = Rendering::new(Film::try_new(&scene.film)?);
    let seed = args.seed ^ SEED;
    let mut device = device::open(scene, args.device.as_deref(), seed, &args.techniques)?;
    let stop = match args.stop.into() {
        Stop { spp: None, time: None, error: None } => Stop { time: Some(TIME), ..Stop::default() },
        stop => stop,
    };
    let bar = Bar::new(args.json);
    let summary = rendering.render(device.integrator.as_mut(), &stop, &mut |p, _| {
        bar.update(p);
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.clear();
    let progress = summary?.progress;
    let origin = Provenance::of(scene, &rendering, device.name, device.merging, seed, args.techniques.to_string());
    write_exr(&file, &rendering.film, &origin, Aovs { errors: true, ..Aovs::default() })?;
    note(&format!(
        "{}: {} samples per pixel, estimated error {}",
        file.display(),
        progress.spp,
        percent(progress.relative_error)
    ));
    Ok(())
}
