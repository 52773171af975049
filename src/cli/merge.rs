//! `abbe merge`: one picture of several that were rendered apart, shares of one render or renders of different seeds.

use super::checkpoint::difference;
use super::print::{note, out, percent};
use super::render::{png_beside, write_files};
use super::{Done, Outcome};
use crate::color::cie::is_visible;
use crate::develop::picture::{Development, PictureSettings};
use crate::error::{Error, Result};
use crate::output::exr::Aovs;
use crate::output::picture::Precision;
use crate::output::{Checkpoint, check_writable, merge_exrs, write_picture};
use crate::render::Share;
use serde_json::Value;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  abbe render pool.json --spp 1024 --share 1/2 -o a.checkpoint     on one machine
  abbe render pool.json --spp 1024 --share 2/2 -o b.checkpoint     on another
  abbe merge a.checkpoint b.checkpoint -o pool.exr
  abbe render pool.json --seed 1 -o one.exr && abbe render pool.json --seed 2 -o two.exr
  abbe merge one.exr two.exr -o both.exr

Files may come in any order. Of shares, what is missing or not done is named, and the others make a noisier picture. EXRs weigh by their samples, and the
errors of pixels (--aov error) are those of the mean. Each seed begins anew with the widest radius of merging: shares have less bias than seeds.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Checkpoints that 'abbe render --share' has left, or spectral EXRs of one scene that differ in --seed
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Spectral EXR to write; the picture goes beside it as .png
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Store standard errors in the EXR of shares, even if they were not asked for with --aov error
    #[arg(long)]
    errors: bool,
    /// Merge shares that different devices have rendered
    #[arg(long)]
    any_device: bool,
}

/// A share whose header has been read.
struct Part {
    path: PathBuf,
    share: Share,
    device: String,
    is_done: bool,
}

/// Runs the command. One file is in memory at a time, beside the sum.
pub fn run(args: &Args) -> Outcome {
    let png = png_beside(&args.output)?;
    [&args.output, &png].into_iter().try_for_each(|path| check_writable(path, &args.files))?;
    let (checkpoints, others): (Vec<&PathBuf>, Vec<&PathBuf>) = args.files.iter().partition(|path| Checkpoint::is_one(path));
    match (checkpoints.first(), others.first()) {
        (Some(checkpoint), Some(other)) => {
            let problem = format!("this is no checkpoint, as {} is", checkpoint.display());
            Err(Error::file(other, problem, "merge the checkpoints of one render first, and its EXR with those of other seeds"))
        }
        (Some(_), None) => merge_shares(args),
        _ => merge_seeds(args),
    }
}

/// One EXR of shares.
fn merge_shares(args: &Args) -> Outcome {
    let first = Checkpoint::open(&args.files[0])?.header;
    let mut parts = args.files.iter().map(|path| part(path, &first, args)).collect::<Result<Vec<_>>>()?;
    // Sums are made in one order, whatever the order of the files.
    parts.sort_by_key(|part| part.share.number);
    if let Some([a, b]) =
        parts.windows(2).find_map(|pair| pair.first_chunk::<2>().filter(|[a, b]| a.share.number == b.share.number))
    {
        let problem = format!("this is the same share as {}", a.path.display());
        return Err(Error::file(&b.path, problem, "give every share once"));
    }
    let of = parts[0].share.of;
    if let Some(other) = parts.iter().find(|part| part.share.of != of) {
        let problem = format!("this is one of {} shares, and {} one of {of}", other.share.of, parts[0].path.display());
        return Err(Error::file(&other.path, problem, "give shares of one render"));
    }

    let (mut merged, mut origin, mut errors) = Checkpoint::open(&parts[0].path)?.rendering()?;
    for part in &parts[1..] {
        let (rendering, _, has_errors) = Checkpoint::open(&part.path)?.rendering()?;
        merged.film.add_film(&rendering.film);
        merged.stats += rendering.stats;
        merged.elapsed += rendering.elapsed;
        errors |= has_errors;
    }
    let film = &merged.film;
    if film.batches() == 0 {
        return Err(Error::file(
            &parts[0].path,
            "there are no samples in these shares",
            "give shares that have rendered something",
        ));
    }
    let names =
        |is_one: &dyn Fn(&u32) -> bool| (0..of).filter(is_one).map(|i| format!("{}/{of}", i + 1)).collect::<Vec<_>>().join(", ");
    let missing = names(&|i| parts.iter().all(|part| part.share.number != *i));
    let undone = names(&|i| parts.iter().any(|part| part.share.number == *i && !part.is_done));
    for (shares, how) in [(missing, "missing"), (undone, "not done")] {
        if !shares.is_empty() {
            note(&format!("note: {how}: {shares}; the picture is noisier for it"));
        }
    }
    let mut devices: Vec<&str> = parts.iter().map(|part| part.device.as_str()).collect();
    devices.sort_unstable();
    devices.dedup();
    origin.device = devices.join("; ");
    (origin.seconds, origin.stats) = (merged.elapsed.as_secs_f64(), merged.stats);
    // The first share's own, unless the scene has one.
    origin.exposure = first["picture"]["exposure"].as_f64();
    let png = png_of(args, (film.settings().bins.min_nm, film.settings().bins.max_nm));
    write_files(
        &args.output,
        png.as_deref(),
        film,
        origin,
        Aovs { errors: args.errors || errors, halves: film.keeps_half(), ..Aovs::default() },
        &PictureSettings::default(),
    )?;
    out(&format!(
        "{} samples per pixel in {} batches, estimated relative error {}",
        film.samples_per_pixel(),
        film.batches(),
        percent(film.relative_error())
    ));
    say_written(args, png)
}

fn part(path: &Path, first: &Value, args: &Args) -> Result<Part> {
    let header = Checkpoint::open(path)?.header;
    if let Some((name, theirs, ours)) = difference(&header, first, args.any_device) {
        let problem = format!("this is of another {name} than {}: {theirs} instead of {ours}", args.files[0].display());
        let remedy = match name.as_str() {
            "device" => "allow it with --any-device",
            "seed" => "give shares of one render; make EXRs of renders of different seeds, and merge these",
            _ => "give shares of one render",
        };
        return Err(Error::file(path, problem, remedy));
    }
    let number = |i: usize| header["request"]["share"][i].as_u64().and_then(|n| u32::try_from(n).ok());
    let share = number(0).zip(number(1)).and_then(|(number, of)| Share::new(number, of)).unwrap_or(Share::WHOLE);
    let device = header["identity"]["device"].as_str().unwrap_or_default().to_string();
    Ok(Part { path: path.to_path_buf(), share, device, is_done: header["done"] == true })
}

/// One EXR of EXRs of different seeds.
fn merge_seeds(args: &Args) -> Outcome {
    let merged = merge_exrs(&args.files, &args.output)?;
    merged.notes.iter().for_each(|n| note(&format!("note: {n}")));
    let png = png_of(args, merged.range_nm);
    if let Some(png) = &png {
        let development = Development { exposure: merged.exposure, ..Development::default() };
        write_picture(png, &merged.xyz, merged.width, &development, Precision::default(), None)?;
    }
    out(&format!("{} samples per pixel in {} batches", merged.samples, merged.batches));
    say_written(args, png)
}

/// The picture to write, where there is anything to be seen.
fn png_of(args: &Args, (lo, hi): (f64, f64)) -> Option<PathBuf> {
    is_visible(lo, hi).then(|| args.output.with_extension("png"))
}

fn say_written(args: &Args, png: Option<PathBuf>) -> Outcome {
    let png = png.map_or(String::new(), |png| format!(" and {}", png.display()));
    out(&format!("wrote {}{png}", args.output.display()));
    Ok(Done::Completely)
}
