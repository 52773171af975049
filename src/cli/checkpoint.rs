//! Checkpoints of `abbe render`: when they are written, and going on from one.

use super::device::TechniqueArgs;
use super::load::Overrides;
use super::print::{duration, note};
use super::values;
use crate::error::{Error, Result};
use crate::output::{Checkpoint, check_writable, write_checkpoint};
use crate::render::{Checkpointable, Share};
use crate::scene::{FilmSettings, Scene};
use crate::state::{Persistent, State};
use serde_json::{Map, Value, json};
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Bytes that the guide of light paths grows by.
const GUIDE_BYTES: u64 = 4 << 20;

/// How often checkpoints are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interval {
    /// Never.
    Off,
    /// After each such time of rendering.
    Every(Duration),
}

/// What checkpoints are asked for.
#[derive(clap::Args, Clone)]
pub struct CheckpointArgs {
    /// Write a checkpoint beside the output this often, as in 30s or 10m, and when a signal or a fault ends the render; it is removed when the render is done. 'off': never
    #[arg(long, value_name = "TIME", value_parser = interval, default_value = "5m")]
    checkpoint: Interval,
    /// Leave the checkpoint of a finished render, so that --resume can add samples to it
    #[arg(long)]
    keep_checkpoint: bool,
    /// Render the batches of one machine of several, as in 1/8, into a checkpoint instead of an EXR; 'abbe merge' makes one picture of all
    #[arg(long, value_name = "I/N", value_parser = share)]
    pub share: Option<Share>,
    /// Go on from the checkpoint beside the output; the scene and all that was asked for need not be given again. Where the scene is given and there is no checkpoint, begin
    #[arg(long, value_name = "OUT.exr", num_args = 0..=1)]
    pub resume: Option<Option<PathBuf>>,
    /// Go on although the checkpoint is of another device: the bits differ from those of a render that was never interrupted
    #[arg(long, requires = "resume")]
    any_device: bool,
}

/// A time, or `off`.
pub fn interval(text: &str) -> std::result::Result<Interval, String> {
    if text == "off" { Ok(Interval::Off) } else { values::time(text).map(Interval::Every) }
}

fn share(text: &str) -> std::result::Result<Share, String> {
    let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse::<u32>().ok()?, n.parse::<u32>().ok()?)));
    let share = numbers.and_then(|(number, of)| Share::new(number.checked_sub(1)?, of));
    share.ok_or_else(|| format!("write number/of, as in 1/8, with numbers from 1 to {}", Share::MOST))
}

/// The checkpoint beside this output.
pub fn beside(exr: &Path) -> PathBuf {
    exr.with_extension("checkpoint")
}

/// Two renders of the same identity give the same bits, if they are of the same share.
pub fn identity(
    scene: &Scene,
    overrides: &Overrides,
    seed: u64,
    techniques: &TechniqueArgs,
    device: &str,
    denoise: bool,
) -> Value {
    let (film, bins) = (&scene.film, &scene.film.bins);
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene": scene.name,
        "content of the scene's files": format!("{:016x}", scene.source_hash),
        "frame": overrides.frame,
        "number of frames per second": overrides.frames_per_second,
        "size": format!("{}x{}", film.width, film.height),
        "part of the picture": crop(film),
        "wavelength bins": format!("{} from {} to {} nm", bins.count, bins.min_nm, bins.max_nm),
        "greatest depth": scene.max_depth,
        "seed": seed,
        "techniques": techniques.to_string(),
        "device": device,
        "set of halves for --aov denoise": if denoise { "kept" } else { "none" },
    })
}

/// Writes the checkpoints of one render.
pub struct Keeper {
    path: PathBuf,
    args: CheckpointArgs,
    header: Value,
    last: Instant,
    lock: Option<Lock>,
}

impl Keeper {
    /// For a render of this identity into `exr`, asked for by `request`; `picture` as of [`picture`].
    ///
    /// # Errors
    /// [`Error::File`] where none could be written.
    pub fn new(exr: &Path, args: &CheckpointArgs, identity: Value, request: Value, picture: Value) -> Result<Self> {
        let path = beside(exr);
        if args.checkpoint != Interval::Off || args.share.is_some() {
            check_writable::<&Path>(&path, [])?;
        }
        let header = json!({"identity": identity, "request": request, "picture": picture, "done": false});
        Ok(Keeper { path, args: args.clone(), header, last: Instant::now(), lock: None })
    }

    /// Puts the render where its checkpoint is, if that is asked for and there is one: the same command begins a render and goes on with it.
    ///
    /// # Errors
    /// [`Error::File`] if it is damaged or that of another render: the first difference is named.
    pub fn resume(&mut self, state: &mut Checkpointable<'_>) -> Result<()> {
        if self.args.resume.is_none() {
            return Ok(());
        }
        self.lock()?;
        if !self.path.exists() {
            return Ok(());
        }
        let checkpoint = Checkpoint::open(&self.path)?;
        if let Some((name, theirs, ours)) = difference(&checkpoint.header, &self.header, self.args.any_device) {
            let remedy = match name.as_str() {
                "device" => "choose that device with --device, or go on here with --any-device",
                _ => "ask for the same, or begin anew without --resume",
            };
            return Err(Error::file(
                &self.path,
                format!("this checkpoint is of another {name}: {theirs} instead of {ours}"),
                remedy,
            ));
        }
        let share = state.settled().0.share;
        checkpoint.restore(state)?;
        let Share { number, of } = state.settled().0.share;
        if state.settled().0.share != share {
            let problem = format!("this checkpoint is share {}/{of} of a render", number + 1);
            return Err(Error::file(&self.path, problem, "ask for that with --share, or begin anew without --resume"));
        }
        Ok(())
    }

    /// Bytes that a checkpoint takes, at most: 0 if none is to be written.
    pub fn bytes(&self, state: &mut Checkpointable<'_>) -> u64 {
        let CheckpointArgs { checkpoint, keep_checkpoint, share, .. } = &self.args;
        if *checkpoint == Interval::Off && !keep_checkpoint && share.is_none() {
            return 0;
        }
        let mut nowhere = io::sink();
        let mut counter = State::saving(&mut nowhere);
        // It cannot fail; if it does, so will the checkpoint, and that is told.
        let _ = state.persist(&mut counter);
        counter.position() + GUIDE_BYTES
    }

    /// After every batch.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn after_batch(&mut self, state: &mut Checkpointable<'_>) -> Result<()> {
        match self.args.checkpoint {
            Interval::Every(interval) if self.last.elapsed() >= interval => self.write(state),
            _ => Ok(()),
        }
    }

    /// Writes one now, for a render that ends before it is done.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn leave(&mut self, state: &mut Checkpointable<'_>) -> Result<Option<&Path>> {
        if self.args.checkpoint == Interval::Off && self.args.share.is_none() {
            return Ok(None);
        }
        self.write(state)?;
        Ok(Some(&self.path))
    }

    /// The render is done, and its files are written.
    ///
    /// # Errors
    /// [`Error::File`] where one that is to be kept cannot be written.
    pub fn finish(&mut self, state: &mut Checkpointable<'_>) -> Result<()> {
        if self.args.keep_checkpoint || self.args.share.is_some() {
            self.header["done"] = true.into();
            return self.write(state);
        }
        if self.lock.is_some() {
            // Only one that this render has written or gone on from; if it is gone already, all is well.
            let _ = std::fs::remove_file(&self.path);
        }
        Ok(())
    }

    fn write(&mut self, state: &mut Checkpointable<'_>) -> Result<()> {
        self.lock()?;
        let begun = Instant::now();
        write_checkpoint(&self.path, &self.header, state)?;
        log::debug!("checkpoint written in {}", duration(begun.elapsed().as_secs_f64()));
        self.last = Instant::now();
        Ok(())
    }

    fn lock(&mut self) -> Result<()> {
        if self.lock.is_none() {
            self.lock = Some(Lock::take(&self.path)?);
        }
        Ok(())
    }
}

/// The first thing in which two headers are of different renders: its name, what `a` and what `b` has.
pub fn difference(a: &Value, b: &Value, any_device: bool) -> Option<(String, Value, Value)> {
    let none = Map::new();
    let a = a["identity"].as_object().unwrap_or(&none);
    let all = b["identity"].as_object().unwrap_or(&none).iter();
    let pairs = all.map(|(name, b)| (name, a.get(name).cloned().unwrap_or_default(), b.clone()));
    pairs.filter(|(name, a, b)| a != b && !(any_device && *name == "device")).map(|(name, a, b)| (name.clone(), a, b)).next()
}

/// The part of the picture that is rendered, if it is not all.
fn crop(film: &FilmSettings) -> Option<[u32; 4]> {
    film.crop.map(|part| [part.x, part.y, part.width, part.height])
}

/// What a film and its file are made from.
pub fn picture(scene: &Scene, merging: bool) -> Value {
    let FilmSettings { width, height, bins, exposure, .. } = &scene.film;
    let crop = crop(&scene.film);
    json!({
        "width": width, "height": height, "crop": crop, "bins": bins.count, "min_nm": bins.min_nm, "max_nm": bins.max_nm, "exposure": exposure,
        "irradiance": scene.sensor.area().is_some(), "film_sr": scene.sensor.optics().map(|o| o.axial), "merging": merging,
    })
}

/// What was asked for by the render that left the checkpoint beside `exr`.
///
/// # Errors
/// [`Error::File`] if there is none.
pub fn request_of(exr: &Path) -> Result<Value> {
    Checkpoint::open(&beside(exr)).map(|checkpoint| checkpoint.header["request"].clone())
}

/// Keeps other processes off a checkpoint; the system takes it back when this one ends, however it does.
struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    fn take(checkpoint: &Path) -> Result<Self> {
        let path = checkpoint.with_extension("checkpoint.lock");
        let opened = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
        let failed =
            |e: &dyn std::fmt::Display| Error::file(&path, format!("cannot be locked: {e}"), "choose another name with -o");
        let file = opened.map_err(|e| failed(&e))?;
        match file.try_lock() {
            Ok(()) => Ok(Lock { path, _file: file }),
            Err(TryLockError::WouldBlock) => {
                Err(Error::file(checkpoint, "another process renders into this", "wait for it, or choose another name with -o"))
            }
            // Some network file systems have no locks.
            Err(TryLockError::Error(e)) => {
                note(&format!("note: {} cannot be locked ({e}): let no other process render into it", path.display()));
                Ok(Lock { path, _file: file })
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // If it stays, it is in nobody's way.
        let _ = std::fs::remove_file(&self.path);
    }
}
