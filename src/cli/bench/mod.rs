//! `abbe bench`: speed and error of renders, scene by scene and method by method.

mod cases;
mod clock;
mod curves;
mod features;
mod host;
mod many;
mod methods;
mod peer;
mod reference;
mod report;
mod roofline;
mod scaling;
mod scenes;
mod tiles;

use super::load::Overrides;
use super::render::StopArgs;
use super::{Done, Outcome, device, interrupt, progress::Bar, values};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::check_writable;
use crate::render::{Progress, Rendering};
use crate::scene::Scene;
use clock::{Clock, Spent};
use methods::Method;
use peer::{Peer, PeerKind};
use reference::Reference;
use report::{Report, Row, Run};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

const EXAMPLES: &str = "Examples:
  abbe bench cornell_box triangles_70k --spp 64 --size 512x512
  abbe bench scenes/compare/*.json --make-references scenes/compare --size 128x128 --time 10m
  abbe bench scenes/compare/*.json --methods all,backward --time 30s -o bench.json
  abbe bench scenes/compare/pool.json --reference pool.exr --json
  abbe bench scenes/compare/nephroid.json --peer mitsuba --time 30s
  abbe bench --scaling --features -o growth.json
  abbe bench --counts triangles_70k scenes/compare/newton.json
  abbe bench --host

'cornell_box' (a diffuse box of 12 triangles) and 'triangles_70k' (a diffuse ball of 70,000 triangles in that box) are built in.
camera/s are the rays per second of the camera pass, all its shading included; rays/s those of all passes over the whole time. CPU/s is the
time of all processors together. The table has the end of each render; --json and -o have a row each time its samples have doubled.

relMSE is the mean over pixels of ((v - r)^2 - e^2) / (r^2 + 0.01 <r>^2): of luminance from the bins, and the mean over bins. The
reference r is the EXR given, NAME/reference.exr in the folder given, or reference.exr in the folder SCENE (the scene's file without
.json) where there is one; it sets the resolution unless --size is given. e, the reference's own error, is read from its error channels
or a file beside it whose name ends in _error.exr, one draw of the standard error per pixel and bin; without either it is 0. References
made by --make-references come from Abbe itself: what it gets wrong in the same way each time, they do not show.

The picture beside OUT.json shows relMSE of luminance over time (of all processors where the device is a CPU), the slope of its later half in
logarithms, and how many times each method's relMSE x time is the first one's at the end. The ratio of times to an error that both reach is
printed besides; it is a bound where the first method's first row is better than all of the other's.

--peer: whenever Abbe's samples have doubled, Mitsuba (pip install mitsuba) renders until it has had as much processor time, by path and by light
tracing. It needs an LLVM library newer than 15 on processors with AVX-512 (of Debian libllvm16 or later; DRJIT_LIBLLVM_PATH says where). Its set-up has a pass of every wavelength in it, which compiles its kernels. Its time is that of rendering alone, as Abbe's
is; --time stops at the time of all together.

--features and --scaling take their cases in turns and give the median ratio to another case. --features has the camera pass alone, --size
256x256 unless told otherwise: its first series is the plain box with the code of features that it does not have. --counts takes times from
a render that does not count; a node is 80 bytes, a primitive 48, before any cache; 'alive' are paths after so many scattering events.
--host has batches of 16 samples unless told otherwise, and the least time of 8: 'device' is the time that the host waits, 'host' all that it does, 'unhidden' what of that the
device waits for: the rest is done while the next batch is traced.";

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
    /// Ways to render each scene, with commas between
    #[arg(long, value_name = "METHODS", value_delimiter = ',', default_value = "all")]
    methods: Vec<Method>,
    #[command(flatten)]
    techniques: device::TechniqueArgs,
    /// Render by another renderer too, in turns with the first method: mitsuba, Mitsuba 3 of the 'python3' that is found, one wavelength at a time
    #[arg(long, value_name = "RENDERER", conflicts_with_all = ["features", "scaling", "counts", "make_references"])]
    peer: Option<PeerKind>,
    /// Part of a device's name (see 'abbe devices'), or 'reference'
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Spectral EXR to compare with, or a folder of folders with one for each scene
    #[arg(long, value_name = "PATH")]
    reference: Option<PathBuf>,
    /// Render references into FOLDER/NAME/reference.exr instead, each for ten minutes unless told otherwise
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["reference", "output"])]
    make_references: Option<PathBuf>,
    /// Instead of scenes, measure what features cost: each in a scene, and its code in the pipeline of a scene without it
    #[arg(long, conflicts_with_all = ["scenes", "make_references"])]
    features: bool,
    /// Instead of scenes, measure how time grows with the resolution, the triangles, the bins, many lights, materials and instances, and tiles
    #[arg(long, conflicts_with_all = ["scenes", "make_references"])]
    scaling: bool,
    /// Count what rays test and how long paths are, and what share of the time each pass takes
    #[arg(long, conflicts_with_all = ["make_references", "features", "scaling"])]
    counts: bool,
    /// Instead of scenes, measure for a batch how long the host waits for the device, and how long the device for the host
    #[arg(long, conflicts_with_all = ["scenes", "make_references", "counts"])]
    host: bool,
    /// Write all rows here as they come, and a picture of error over time beside it as .svg
    #[arg(short, long, value_name = "OUT.json", value_parser = values::json)]
    output: Option<PathBuf>,
    /// Print one JSON object per row
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    if let Some(path) = &args.output {
        [path.clone(), path.with_extension("svg")].iter().try_for_each(|path| check_writable(path, &args.scenes))?;
    }
    interrupt::heed();
    let mut report = Report::new(args.output.as_deref(), args.json);
    if args.features || args.scaling || args.host {
        if args.host {
            host::run(args, &mut report)?;
        }
        if args.features {
            features::run(args, &mut report)?;
        }
        if args.scaling {
            scaling::run(args, &mut report)?;
            many::run(args, &mut report)?;
            tiles::run(args, &mut report)?;
        }
        return Ok(if interrupt::requested() { Done::Interrupted } else { Done::Completely });
    }
    let scenes = if args.scenes.is_empty() { shipped_scenes()? } else { args.scenes.clone() };
    if let Some(folder) = &args.make_references {
        for path in &scenes {
            reference::make(args, folder, path, &load(&args.overrides, path)?)?;
            if interrupt::requested() {
                return Ok(Done::Interrupted);
            }
        }
        return Ok(Done::Completely);
    }
    if args.counts {
        for path in &scenes {
            roofline::run(args, &load(&args.overrides, path)?, &mut report)?;
            if interrupt::requested() {
                return Ok(Done::Interrupted);
            }
        }
        return Ok(Done::Completely);
    }
    for path in &scenes {
        for (i, method) in args.methods.iter().enumerate() {
            measure(args, path, *method, args.peer.filter(|_| i == 0), &mut report)?;
            if interrupt::requested() {
                return Ok(Done::Interrupted);
            }
        }
    }
    report.finish()?;
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
    Ok(scenes::NAMES.iter().map(PathBuf::from).chain(scenes).collect())
}

fn load(overrides: &Overrides, path: &Path) -> Result<Scene> {
    scenes::built_in(path, &overrides.options()).unwrap_or_else(|| overrides.load(path))
}

/// Renders one scene by one method, and where asked for by another renderer in turns with it.
fn measure(args: &Args, path: &Path, method: Method, peer: Option<PeerKind>, report: &mut Report) -> Result<()> {
    let reference = Reference::of(args.reference.as_deref(), path)?;
    let size = args.overrides.size.or(reference.as_ref().and_then(Reference::size));
    let scene = load(&Overrides { size, ..args.overrides.clone() }, path)?;
    let start = Instant::now();
    let mut rendering = Rendering::new(Film::try_new(&scene.film)?);
    let mut device = device::open(&scene, args.device.as_deref(), args.seed, &args.techniques.but(method.leaves_out()))?;
    let setup = start.elapsed().as_secs_f64();
    let plan = device.integrator.describe().lines().map(str::trim).collect::<Vec<_>>().join("; ");
    let on_cpu = device.on_cpu;
    let run =
        report.begin(Run { scene: scene.name.clone(), method: method.to_string(), device: device.name, on_cpu, plan, setup });
    let mut peers = if peer.is_some() { start_peers(&scene, report)? } else { Vec::new() };

    let bar = Bar::new(args.json);
    let (mut clock, mut last, mut failed) = (Clock::start(), 0, None);
    let mut rows = |p: &Progress, film: &Film, spent: Spent| {
        let mse = reference.as_ref().map(|r| r.relative_mse(&scene.film, |pixel, b| film.bin(pixel, b))).transpose()?;
        let progress = Progress { relative_error: film.relative_error(), ..*p };
        report.add(run, Row { progress, spent, relative_mse: mse })?;
        for (run, peer) in &mut peers {
            let image = peer.catch_up(spent.counted(on_cpu))?;
            let value = |pixel: usize, b: usize| f64::from(image.data[pixel * scene.film.bins.count as usize + b]);
            let mse = reference.as_ref().map(|r| r.relative_mse(&scene.film, value)).transpose()?;
            report.add(*run, Row { progress: image.progress(film.pixels()), spent: image.spent, relative_mse: mse })?;
        }
        Ok(())
    };
    let summary = rendering.render(device.integrator.as_mut(), &args.stop.into(), &mut |p, state| {
        clock.hold(|spent| {
            bar.update(p);
            if p.spp >= 2 * last || p.fraction >= 1.0 {
                last = p.spp;
                failed = rows(p, &state.settled().0.film, spent).err();
            }
            if failed.is_some() || interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    bar.clear();
    summary?;
    failed.map_or(Ok(()), Err)?;
    report.end(run);
    peers.iter().for_each(|(run, _)| report.end(*run));
    Ok(())
}

/// Every integrator of the other renderer, with the number of its run.
fn start_peers(scene: &Scene, report: &mut Report) -> Result<Vec<(usize, Peer)>> {
    let mut peers = Vec::new();
    for (integrator, runs) in peer::integrators(scene) {
        let method = format!("mitsuba-{integrator}");
        match runs.and_then(|()| Peer::start(scene, integrator)) {
            Ok(peer) => {
                let (device, setup) = (peer.name.clone(), peer.setup);
                let run = Run { scene: scene.name.clone(), method, device, on_cpu: true, plan: integrator.to_string(), setup };
                peers.push((report.begin(run), peer));
            }
            Err(why) => report.not_run(&scene.name, &method, &why)?,
        }
    }
    Ok(peers)
}
