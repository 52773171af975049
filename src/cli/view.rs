//! `abbe view`: a scene live, or spectral files, in the browser.

use super::bands::BandsArgs;
use super::load::{MemoryArgs, Overrides};
use super::print::{note, out};
use super::render::{png_beside, write_files};
use super::{Done, Outcome, interrupt, values};
use crate::color::cie::is_visible;
use crate::develop::picture::PictureSettings;
use crate::error::Error;
use crate::memory;
use crate::output::check_writable;
use crate::output::exr::Aovs;
use crate::render::Stop;
use crate::view::document::Document;
use crate::view::engine::{Engine, Request};
use crate::view::live::{Command, Published};
use crate::view::{Files, Server, access};
use std::path::PathBuf;
use std::process::Stdio;
use std::sync::Arc;
use std::time::Duration;

const EXAMPLES: &str = "Examples:
  abbe view scenes/prism.json                        the scene, live: turn it, change its glass, read its spectra
  abbe view model.glb --size 800x600
  abbe view newton.exr                               a spectral EXR: Abbe's, or any of Fichet's layout
  abbe view a.exr b.exr                              two of them, compared
  abbe view mitsuba.exr --bands 400-700
  abbe view scenes/pool.json --no-open --port 8888   on a machine far away; here: ssh -L 8888:127.0.0.1:8888 THERE

Whoever has the address that is printed, token and all, may look and change: it is of this session alone. Nothing is
written but the scene that you save, beside the scene's file, and what -o names. Ctrl-C ends it.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A scene (.json, .gltf, .glb), or one or two spectral EXRs
    #[arg(value_name = "FILE", required = true, num_args = 1..=2)]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    overrides: Overrides,
    /// Spectral EXR to write at the end of a scene; the picture goes beside it as .png
    #[arg(short, long, value_name = "OUT.exr")]
    output: Option<PathBuf>,
    /// Render until the estimated relative error is this small
    #[arg(long, value_name = "ERROR", default_value = "1%", value_parser = values::error)]
    error: f64,
    /// Stop at this many samples per pixel, if that comes first
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Number or part of the name of a device (see 'abbe devices')
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Port to listen at; 0 takes any that is free
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Address to listen at. Another than the loopback address lets everybody who can reach it and has the token in, unencrypted
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    host: String,
    /// Do not open a browser
    #[arg(long)]
    no_open: bool,
    #[command(flatten)]
    bands: BandsArgs,
    #[command(flatten)]
    memory: MemoryArgs,
}

/// How often signals and files are looked at.
const WATCH: Duration = Duration::from_millis(250);

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let is_image =
        |path: &&PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("checkpoint"));
    let published = Arc::new(Published::default());
    let (scenes, images): (Vec<&PathBuf>, Vec<&PathBuf>) = args.paths.iter().partition(|path| !is_image(path));
    if scenes.len() > 1 {
        return Err(Error::usage("two scenes cannot be looked at together", "give one, or render one and give its EXR"));
    }
    let images: Vec<PathBuf> = images.into_iter().cloned().collect();
    args.memory.limit();
    let mut files = match images.as_slice() {
        [] => None,
        images => Some(Files::open(images, args.bands.bands()?, scenes.len(), published.clone())?),
    };
    let Some(scene) = scenes.first() else {
        memory::limit(None);
        let server = Server::start(&args.host, args.port, published, None)?;
        args.announce(&server);
        loop {
            std::thread::sleep(WATCH);
            files.iter_mut().for_each(Files::reload_if_outdated);
        }
    };
    let (document, loaded) = Document::open(scene, args.overrides.options())?;
    if let Some(output) = &args.output {
        let png = png_beside(output)?;
        [output, &png].into_iter().try_for_each(|path| check_writable(path, &loaded.sources))?;
    }
    let request = Request {
        device: args.device.clone(),
        seed: args.seed,
        stop: Stop { spp: args.spp, time: None, error: Some(args.error) },
    };
    let (engine, live) = Engine::new(document, loaded, request, published.clone())?;
    memory::limit(None);
    let server = Server::start(&args.host, args.port, published, Some(live.clone()))?;
    args.announce(&server);
    if args.output.is_some() {
        interrupt::heed();
    }
    let engine = std::thread::Builder::new().name("engine".into()).spawn(move || engine.run());
    let engine = engine.map_err(|e| Error::usage(format!("cannot start a thread: {e}"), "end other programs"))?;
    while !interrupt::requested() && !engine.is_finished() {
        std::thread::sleep(WATCH);
        files.iter_mut().for_each(Files::reload_if_outdated);
        live.heed_files();
    }
    live.send(Command::End);
    let (film, provenance) =
        engine.join().map_err(|_| Error::fault("the render has failed", "this is a defect of Abbe: please report it"))?;
    drop(server);
    if let Some(output) = &args.output {
        match film {
            Some(film) => {
                let bins = &film.settings().bins;
                let png = is_visible(bins.min_nm, bins.max_nm).then(|| output.with_extension("png"));
                let aovs = Aovs { errors: film.batches() > 1, ..Aovs::default() };
                write_files(output, png.as_deref(), &film, provenance, aovs, &PictureSettings::default())?;
                let png = png.map_or(String::new(), |png| format!(" and {}", png.display()));
                out(&format!("wrote {}{png} with {} samples per pixel", output.display(), film.samples_per_pixel()));
            }
            None => note("no batch was done: nothing is written"),
        }
    }
    Ok(Done::Interrupted)
}

impl Args {
    /// Says where it is, and opens it where there is a display.
    fn announce(&self, server: &Server) {
        let (url, port) = (server.url(), server.address.port());
        out(&format!("abbe view is at {url}"));
        if access::is_loopback(&self.host) {
            out(&format!("from another machine: ssh -L {port}:127.0.0.1:{port} {}, and the same address there", host_name()));
        } else {
            note("warning: it can be reached from other machines, unencrypted; ssh -L is safer");
        }
        out("Ctrl-C ends it");
        if !self.no_open
            && has_display()
            && let Err(e) = open(&url)
        {
            note(&format!("note: no browser could be opened ({e}): open the address yourself"));
        }
    }
}

/// This machine's name, for a command to be typed elsewhere.
fn host_name() -> String {
    let name = std::fs::read_to_string("/etc/hostname").unwrap_or_default();
    if name.trim().is_empty() { "THIS-MACHINE".into() } else { name.trim().into() }
}

fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let is_remote = is_set("SSH_CONNECTION");
    !is_remote && (cfg!(any(target_os = "macos", windows)) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY"))
}

fn open(url: &str) -> std::io::Result<()> {
    let (program, before): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/c", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    let mut command = std::process::Command::new(program);
    command.args(before).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().map(drop)
}
