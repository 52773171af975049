//! `abbe merge`: one picture of shares that were rendered apart.

use super::checkpoint::{difference, film_of};
use super::print::{note, out, percent};
use super::render::{is_exr, write_files};
use super::{Done, Outcome};
use crate::color::cie::is_visible;
use crate::error::{Error, Result};
use crate::output::exr::Aovs;
use crate::output::{Checkpoint, Provenance, check_writable};
use crate::render::{Rendering, Share};
use serde_json::Value;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  abbe render pool.json --spp 1024 --share 1/2 -o a.exr        on one machine
  abbe render pool.json --spp 1024 --share 2/2 -o b.exr        on another
  abbe merge a.checkpoint b.checkpoint -o pool.exr

The shares may come in any order. What is missing is named, and the others make a noisier picture.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Checkpoints that 'abbe render --share' has left
    #[arg(value_name = "SHARE", required = true)]
    shares: Vec<PathBuf>,
    /// Spectral EXR to write; the picture goes beside it as .png
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Store standard errors in the EXR, too
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
}

/// Runs the command. One share is in memory at a time, beside the sum.
pub fn run(args: &Args) -> Outcome {
    if !is_exr(&args.output) {
        return Err(Error::usage(format!("-o {} does not end in .exr", args.output.display()), "name the spectral EXR to write"));
    }
    check_writable(&args.output, &args.shares)?;
    let first = Checkpoint::open(&args.shares[0])?.header;
    let mut parts = args.shares.iter().map(|path| part(path, &first, args)).collect::<Result<Vec<_>>>()?;
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

    let mut merged = Rendering::new(film_of(&first)?);
    for part in &parts {
        let mut rendering = Rendering::new(film_of(&first)?);
        Checkpoint::open(&part.path)?.restore_first(&mut rendering)?;
        merged.film.add_film(&rendering.film);
        merged.stats += rendering.stats;
        merged.batches += rendering.batches;
        merged.elapsed += rendering.elapsed;
    }
    let missing: Vec<String> =
        (0..of).filter(|i| parts.iter().all(|part| part.share.number != *i)).map(|i| format!("{}/{of}", i + 1)).collect();
    if !missing.is_empty() {
        note(&format!("note: shares {} are missing: the picture is noisier for it", missing.join(", ")));
    }
    let identity = &first["identity"];
    let text = |name: &str| identity[name].as_str().unwrap_or_default().to_string();
    let origin = Provenance {
        scene: text("scene"),
        scene_hash: format!("fnv1a64:{}", text("content of the scene's files")),
        max_depth: identity["greatest depth"].as_u64().unwrap_or(0) as u32,
        device: text("device"),
        seed: identity["seed"].as_u64().unwrap_or(0),
        seconds: merged.elapsed.as_secs_f64(),
        stats: merged.stats,
        exposure: first["picture"]["exposure"].as_f64(),
        irradiance: first["picture"]["irradiance"].as_bool().unwrap_or(false),
    };
    let bins = &merged.film.settings().bins;
    let png = is_visible(bins.min_nm, bins.max_nm).then(|| args.output.with_extension("png"));
    write_files(&args.output, png.as_deref(), &merged.film, origin, Aovs { errors: args.errors, ..Aovs::default() })?;
    let film = &merged.film;
    out(&format!(
        "{} samples per pixel in {} batches, estimated relative error {}",
        film.samples_per_pixel(),
        film.batches(),
        percent(film.relative_error())
    ));
    out(&format!("wrote {}{}", args.output.display(), png.map_or(String::new(), |png| format!(" and {}", png.display()))));
    Ok(Done::Completely)
}

fn part(path: &Path, first: &Value, args: &Args) -> Result<Part> {
    let header = Checkpoint::open(path)?.header;
    if let Some((name, theirs, ours)) = difference(&header, first, args.any_device) {
        let problem = format!("this is of another {name} than {}: {theirs} instead of {ours}", args.shares[0].display());
        let remedy = if name == "device" { "allow it with --any-device" } else { "give shares of one render" };
        return Err(Error::file(path, problem, remedy));
    }
    let number = |i: usize| header["request"]["share"][i].as_u64().and_then(|n| u32::try_from(n).ok());
    let share = number(0).zip(number(1)).and_then(|(number, of)| Share::new(number, of)).unwrap_or(Share::WHOLE);
    Ok(Part { path: path.to_path_buf(), share })
}
