//! `abbe render`: from a scene file to a spectral EXR and a picture.

mod report;
mod request;

use super::check::unfound;
use super::checkpoint::{self, CheckpointArgs, Keeper};
use super::disk::{self, Sizes};
use super::load::{CropArgs, MemoryArgs, Overrides};
use super::picture::PictureArgs;
use super::preview::{Preview, PreviewArgs};
use super::print::{self, note, out};
use super::progress::{Bar, Log, Stages};
use super::sequence::{Sequence, SequenceArgs};
use super::{Done, Outcome, denoise, device, interrupt, sequence, values};
use crate::color::cie::{is_visible, lacks_for_colour};
use crate::develop::picture::{Exposure, PictureSettings};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{AovBuffers, albedos};
use crate::integrator::{MOST_HALVINGS, Plan};
use crate::memory;
use crate::output::exr::Aovs;
use crate::output::picture::Precision;
use crate::output::{Provenance, SpectralImage, check_writable, picture_exposure, write_exr, write_picture};
use crate::render::{Checkpointable, Ended, Rendering, Share, Stop, Summary};
use crate::scene::{FilmSettings, Scene, advice_before_rendering};
use clap::ValueEnum;
use report::Report;
use std::io::{ErrorKind, IsTerminal, stderr};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const EXAMPLES: &str = "Examples:
  abbe render scenes/newton.json
  abbe render scenes/prism.json --size 1280x720 --spp 1024 -o prism.exr
  abbe render scenes/bunny_light.json --time 2m --channels 40
  abbe render scenes/nephroid.json --error 2% --json
  abbe render scenes/newton.json --exposure auto+1 --tone agx
  abbe render scenes/fog.json --time 30s --denoise  also fog.denoised.exr and .png
  abbe render scenes/bunny_light.json --aov error,depth,normal,albedo
  abbe render scenes/cornell_spheres.json --device reference --size 64x64
  abbe render --resume pool.exr                     goes on with a render that was stopped
  abbe render scenes/pool.json --keep-checkpoint && abbe render --resume pool.exr --spp 1024
  abbe render scenes/turning_prism.json --frames 0..120  turning_prism.0000.exr and .png, and so on, one for each frame
  abbe render scenes/pool.json --spp 1024 --share 3/8 -o 3.checkpoint --resume       begins a share, or goes on with it

Of --spp, --time and --error the first that is met ends the render; without any it is --spp 64.
Ctrl-C ends it within seconds and writes what there is; so do the signals TERM and HUP, the latter not under nohup. A second one quits at once.
Where standard error is no terminal it gets the plan, then a line every 10 s.

Exit codes: 0 done, 2 the request or its input is at fault or its files cannot be written, 3 the device failed, 130 ended by INT (Ctrl-C), 143 by TERM, 129 by HUP.";

#[derive(clap::Args, Clone)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scene file (.json), or a glTF file (.gltf, .glb)
    #[arg(value_name = "SCENE", required_unless_present = "resume")]
    pub path: Option<PathBuf>,
    #[command(flatten)]
    pub overrides: Overrides,
    /// Spectral EXR to write; the picture goes beside it as .png [default: the scene's name, in the current folder]
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub sequence: SequenceArgs,
    #[command(flatten)]
    crop: CropArgs,
    #[command(flatten)]
    stop: StopArgs,
    /// Seed of the random numbers: the same seed on the same device gives the same picture
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    techniques: device::TechniqueArgs,
    /// Number or part of the name of a device (see 'abbe devices'), or 'reference' for double precision on the CPU
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Extra channels in the EXR, with commas between: standard errors; depth, normal and albedo of what is seen first; 'denoise' for all that 'abbe denoise' needs, these and those of what is behind smooth glass and in mirrors included
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    aov: Vec<Aov>,
    /// Also write the picture without noise, as NAME.denoised.exr and .png; with --aov denoise in the EXR
    #[arg(long)]
    denoise: bool,
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Exposure of the sequence that this is a frame of, in stops
    #[arg(skip)]
    pub exposure: Option<f64>,
    #[command(flatten)]
    pub checkpoint: CheckpointArgs,
    #[command(flatten)]
    preview: PreviewArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Print nothing but errors
    #[arg(long, conflicts_with = "json")]
    quiet: bool,
    /// Print one JSON object instead of the summary; progress goes to standard error as ever
    #[arg(long)]
    json: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq)]
enum Aov {
    Error,
    Depth,
    Normal,
    Albedo,
    Denoise,
}

/// Samples of a pixel for depth, normal and albedo.
const AOV_SAMPLES: u32 = 16;

/// When to stop.
#[derive(clap::Args, Clone, Copy)]
pub struct StopArgs {
    /// Stop at this many samples per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Stop after this time of rendering, as in 30s, 2m or 1h
    #[arg(long, value_name = "TIME", value_parser = values::time)]
    time: Option<Duration>,
    /// Stop when the estimated relative error is this small, as in 2%
    #[arg(long, value_name = "ERROR", value_parser = values::error)]
    error: Option<f64>,
}

impl From<StopArgs> for Stop {
    fn from(a: StopArgs) -> Stop {
        Stop { spp: a.spp, time: a.time, error: a.error }
    }
}

impl Args {
    fn wants(&self, aov: Aov) -> bool {
        self.denoise || self.aov.contains(&aov) || self.aov.contains(&Aov::Denoise)
    }
}

/// Whether a path is named as an EXR.
pub fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let args = args.completed()?;
    if args.sequence.frames.is_some() { sequence::run(&args) } else { render(&args, None) }
}

/// Renders one picture, a frame of `sequence` if there is one.
pub fn render(args: &Args, mut sequence: Option<&mut Sequence>) -> Outcome {
    let path = args.path.as_deref().unwrap_or(Path::new(""));
    let (exr, png) = output_paths(args, path)?;
    let wants_aovs = [Aov::Depth, Aov::Normal, Aov::Albedo].into_iter().any(|aov| args.wants(aov));
    let share = args.checkpoint.share;
    if share.is_some() && wants_aovs {
        return Err(Error::usage(
            "a share has no depth, normal or albedo",
            "render these by themselves, without --share, at --spp 1",
        ));
    }
    let talkative = !args.quiet && !args.json;
    args.memory.limit();
    let stages = Stages::show(!talkative);
    let mut scene = args.overrides.load(path)?;
    let mut settings = args.picture.settings();
    settings.check_for_screens()?;
    let (options, asked) = (args.options(), settings.exposure.or(scene.film.exposure.map(Exposure::Stops)).unwrap_or_default());
    let bins = &scene.film.bins;
    // A share is a checkpoint, and no picture.
    let png = (is_visible(bins.min_nm, bins.max_nm) && share.is_none()).then_some(png);
    // Before the work, not after it.
    let denoised = args.denoise.then(|| exr.with_extension("denoised.exr"));
    let denoised_png = denoised.as_ref().filter(|_| png.is_some()).map(|exr| exr.with_extension("png"));
    let paths = |exr, png| [exr, png].into_iter().flatten().map(PathBuf::as_path).collect::<Vec<&Path>>();
    let (files, files_denoised) = (paths(Some(&exr), png.as_ref()), paths(denoised.as_ref(), denoised_png.as_ref()));
    let mut exposure = args.exposure;
    if let Some(sequence) = &mut sequence {
        if sequence.has_finished(&files, &files_denoised, &scene, &options, asked)? {
            if talkative {
                note(&format!("{} is done already", exr.display()));
            }
            return Ok(Done::Completely);
        }
        exposure = sequence.exposure(&scene, &options, asked)?;
    }
    settings.exposure = exposure.map(Exposure::Stops).or(settings.exposure);
    if let Some(exposure) = settings.exposure {
        scene.film.exposure = if let Exposure::Stops(stops) = exposure { Some(stops) } else { None };
    }
    files.iter().chain(&files_denoised).try_for_each(|path| check_writable(path, &scene.sources))?;
    let mut warnings = if args.quiet { Vec::new() } else { warnings(&scene, args) };
    if talkative {
        let end = if png.is_none() { "; no picture is made" } else { "" };
        let lack = lacks_for_colour(bins.min_nm, bins.max_nm).map(|lack| lack + end);
        stages.aside(|| {
            scene.notes.iter().chain(&lack).for_each(|n| note(&format!("note: {n}")));
            warnings.iter().for_each(|w| note(&format!("warning: {w}")));
        });
    }
    let setup = Instant::now();
    let mut rendering = Rendering::of_share(Film::try_new(&scene.film)?, share.unwrap_or(Share::WHOLE));
    if args.wants(Aov::Denoise) {
        rendering.film.keep_half();
    }
    let gpu = sequence.as_mut().and_then(|sequence| sequence.gpu.take());
    let mut device = device::open_on(gpu, &scene, args.device.as_deref(), args.seed, &args.techniques)?;
    let setup = setup.elapsed();
    drop(stages);
    // What rendering takes is known by now, and what it has found is not to be lost.
    memory::limit(None);
    // Before the work too: what fails here fails at once.
    let mut aovs_of = |index| device.integrator.aovs(&albedos(&scene), index, AOV_SAMPLES);
    let aovs = match (wants_aovs, args.wants(Aov::Denoise)) {
        (false, _) => None,
        (true, false) => Some(aovs_of(0)?),
        (true, true) => Some(AovBuffers::of_halves(aovs_of(0)?, aovs_of(1)?)),
    };
    let behind = aovs.as_ref().filter(|_| args.wants(Aov::Denoise)).and_then(AovBuffers::behind);

    let identity =
        checkpoint::identity(&scene, &args.overrides, args.seed, &args.techniques, &device.name, args.wants(Aov::Denoise));
    let picture = checkpoint::picture(&scene, device.merging);
    let mut keeper = Keeper::new(&exr, &args.checkpoint, identity, args.request(path, exposure), picture)?;
    let integrator = device.integrator.as_mut();
    let mut state = Checkpointable::new(&mut rendering, integrator);
    keeper.resume(&mut state)?;
    let room = Sizes::new(&scene.film, aov_channels(args, &scene.film, behind.is_some()), &keeper, &mut state).check(&exr)?;

    interrupt::heed();
    let bar = Bar::new(args.quiet);
    let plan = format!("{}\n  {room}", device.integrator.describe().trim_end());
    let log = (!args.quiet && !stderr().is_terminal()).then(|| Log::start(&plan));
    let mut preview = Preview::new(png.as_deref().filter(|_| share.is_none()), &args.preview, settings);
    let rendered = loop {
        let rendered = rendering.render(device.integrator.as_mut(), &args.stop.into(), &mut |p, state| {
            bar.update(p);
            log.iter().for_each(|log| log.update(p));
            // A full disk is no reason to stop: room may be made before the end.
            keeper.after_batch(state).unwrap_or_else(|e| note(&format!("warning: {}", e)));
            preview.take_if(|preview| !preview.after_batch(state, p));
            if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let Err(Error::OutOfMemory { problem, .. }) = &rendered else { break rendered };
        if device.integrator.halvings() >= MOST_HALVINGS
            || device.shrink(&scene, args.device.as_deref(), args.seed, &args.techniques).is_err()
        {
            break rendered;
        }
        if !args.quiet {
            note(&format!("note: {problem}: it goes on with smaller tiles"));
        }
    };
    bar.clear();
    drop(log);
    let is_done = matches!(&rendered, Ok(Summary { ended, .. }) if *ended != Ended::Interrupted);
    let mut state = Checkpointable::new(&mut rendering, device.integrator.as_mut());
    if !is_done && state.settled().0.batches > 0 {
        // Before all else: it is the best of what there is.
        match keeper.leave(&mut state) {
            Ok(Some(path)) if !args.quiet => {
                let again = format!("abbe render --resume {}", exr.display());
                note(&format!("wrote {}: '{again}' goes on", path.display()));
            }
            Ok(_) => {}
            Err(e) => note(&format!("warning: {}", e)),
        }
    }
    let stats = rendering.stats;

    let (mut denoised_files, mut stops) = (Ok(Vec::new()), None);
    // A device may fail after hours: what it had done is written before its error is passed on.
    if rendering.film.batches() > 0 && share.is_none() {
        let aovs_for = |aov| aovs.as_ref().filter(|_| args.wants(aov));
        let aovs = Aovs {
            errors: args.wants(Aov::Error),
            depth: aovs_for(Aov::Depth),
            normal: aovs_for(Aov::Normal),
            albedo: aovs_for(Aov::Albedo),
            behind,
            halves: args.wants(Aov::Denoise),
        };
        let (name, techniques) = (device.name.clone(), args.techniques.to_string());
        let mut origin = Provenance {
            frame: args.overrides.frame,
            options: options.clone(),
            interrupted: !is_done,
            ..Provenance::of(&scene, &rendering, name, device.merging, args.seed, techniques)
        };
        let written = write_files(&exr, png.as_deref(), &rendering.film, origin.clone(), aovs, &settings);
        if let Err(failure) = written {
            let mut state = Checkpointable::new(&mut rendering, device.integrator.as_mut());
            let elsewhere = disk::keep_elsewhere(&exr, &state.settled().0.film, &origin, aovs);
            let place = elsewhere.or_else(|| keeper.leave(&mut state).ok().flatten().map(Path::to_path_buf));
            return Err(disk::kept(failure, place.as_deref()));
        }
        stops = written.ok();
        origin.exposure = stops;
        if denoised.is_some() && rendering.film.batches() == 1 {
            // Those of an earlier render would be taken for this one's.
            files_denoised.iter().try_for_each(|path| remove_if_there(path))?;
            warnings.push(format!(
                "{} is not denoised: one batch does not tell what is noise, two do; render it for longer",
                exr.display()
            ));
            if talkative {
                warnings.last().into_iter().for_each(|w| note(&format!("warning: {w}")));
            }
        } else if let Some(denoised) = &denoised {
            let image = SpectralImage::of_film(&rendering.film, &origin, aovs)
                .map_err(|problem| Error::usage(problem, "give it bins"))?;
            // What went wrong before comes first, and what is done is kept.
            denoised_files = denoise::write_denoised(&image, &exr, denoised, &settings);
        }
    }
    let film = &rendering.film;
    if let (Err(failure), false) = (&rendered, args.quiet) {
        match (film.batches(), failure) {
            (0, Error::Interrupted) => note("interrupted before the first batch was done: nothing is written"),
            (0, _) => note("the first batch was not done: nothing is written"),
            _ if share.is_some() => {}
            _ => note(&format!("wrote {} with {} samples per pixel", exr.display(), film.samples_per_pixel())),
        }
    }
    if talkative && rendered.is_ok() && film.batches() > 0 && (0..film.channels()).all(|channel| film.mean_of(channel) == 0.0) {
        note("warning: no light has reached the sensor, and the picture is black; 'abbe check' may say why");
    }
    let summary = rendered?;
    if is_done {
        keeper.finish(&mut Checkpointable::new(&mut rendering, device.integrator.as_mut()))?;
    }
    let denoised = denoised_files?;
    if let (Some(sequence), Some(stops), true) = (&mut sequence, stops, is_done) {
        sequence.keep_exposure(&scene, &options, asked, stops)?;
    }
    let has_begun = sequence.as_mut().is_some_and(|sequence| {
        sequence.gpu = device.gpu.take();
        std::mem::replace(&mut sequence.has_begun, true)
    });
    let report = Report {
        scene: &scene,
        film: &rendering.film,
        warnings: &warnings,
        summary: &summary,
        device: &device,
        setup,
        exr: share.is_none().then_some(&*exr),
        png: png.as_deref(),
        denoised: &denoised,
        frame: args.overrides.frame,
        is_brief: has_begun,
        share: share.is_some().then(|| checkpoint::beside(&exr)),
    };
    if args.json {
        out(&report.json().to_string());
    } else if talkative {
        out(&report.text());
    }
    if interrupt::requested() {
        return Ok(Done::Interrupted);
    }
    if stats.is_crowded() {
        let (lost, of) = (stats.dropped_crowded, stats.paths + stats.light_paths);
        print::error(&format!(
            "{lost} of {of} paths were lost where more than 8 different volumes overlap; give those that are alike one name, or move some apart"
        ));
        return Ok(Done::Crowded);
    }
    Ok(Done::Completely)
}

/// Channels that these are in a file, with what is behind glass or without.
fn aov_channels(args: &Args, film: &FilmSettings, behind: bool) -> u64 {
    let (bins, behind) = (u64::from(film.bins.count), 14 * u64::from(behind));
    let of = |aov: Aov| match aov {
        Aov::Error => bins + 1,
        Aov::Depth => 1,
        Aov::Normal | Aov::Albedo => 3,
        // Halves of these; and another file without them.
        Aov::Denoise if args.denoise => 2 * (bins + 10) + bins + behind,
        Aov::Denoise => bins + 10 + behind,
    };
    Aov::value_variants().iter().filter(|aov| args.wants(**aov)).map(|aov| of(*aov)).sum()
}

/// What `abbe check` warns of, as far as it is found at once.
fn warnings(scene: &Scene, args: &Args) -> Vec<String> {
    let mut warnings = advice_before_rendering(scene);
    if args.device.as_deref() != Some(device::REFERENCE) {
        warnings.extend(unfound(&Plan::new(scene, (&args.techniques).into())));
    }
    warnings
}

/// Writes a film as a spectral EXR and, where it is visible, a picture, at the exposure that `origin` has or `settings` say, which is returned.
pub fn write_files(
    exr: &Path,
    png: Option<&Path>,
    film: &Film,
    mut origin: Provenance,
    aovs: Aovs<'_>,
    settings: &PictureSettings,
) -> Result<f64> {
    let (xyz, bins) = (film.xyz_image(), &film.settings().bins);
    let exposure = origin.exposure.map(Exposure::Stops).or(settings.exposure).unwrap_or_default();
    let exposure = picture_exposure(&xyz, (bins.min_nm, bins.max_nm), exposure);
    origin.exposure = Some(exposure);
    write_exr(exr, film, &origin, aovs)?;
    if let Some(png) = png {
        write_picture(
            png,
            &xyz,
            film.settings().pixel_bounds().width as usize,
            &settings.development(exposure),
            Precision::default(),
            None,
        )?;
    }
    Ok(exposure)
}

fn remove_if_there(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::file(path, format!("cannot remove: {e}"), "remove it")),
        _ => Ok(()),
    }
}

/// The spectral EXR to write: as told, or beside the scene's name.
pub fn output(args: &Args, scene: &Path) -> Result<PathBuf> {
    if let Some(path) = &args.output {
        return Ok(path.clone());
    }
    let stem = scene.file_stem();
    let stem = stem.ok_or_else(|| Error::file(scene, "this names no file", "give the path of a scene file"))?;
    let mut name = stem.to_os_string();
    name.push(".exr");
    Ok(PathBuf::from(name))
}

fn output_paths(args: &Args, scene: &Path) -> Result<(PathBuf, PathBuf)> {
    let exr = output(args, scene)?;
    let names_share = args.checkpoint.share.is_some() && checkpoint::beside(&exr) == exr;
    let png = if names_share { exr.with_extension("png") } else { png_beside(&exr)? };
    Ok((exr, png))
}

/// The picture beside a spectral EXR that is to be written; refuses another kind of file.
pub fn png_beside(exr: &Path) -> Result<PathBuf> {
    if !is_exr(exr) {
        let problem = format!("-o {} does not end in .exr", exr.display());
        return Err(Error::usage(problem, "name the spectral EXR to write; the .png goes beside it"));
    }
    Ok(exr.with_extension("png"))
}
