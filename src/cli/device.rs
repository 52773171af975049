//! Choosing a device: a GPU adapter by wgpu, or the double-precision reference on the CPU.

use super::{Done, Outcome, interrupt, print::out};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{Albedo, AovBuffers};
use crate::gpu::Gpu;
use crate::integrator::{GpuIntegrator, Techniques};
use crate::reference::ReferenceIntegrator;
use crate::render::{Batch, Integrator, Renderer};
use crate::scene::{Estimator, Scene};
use crate::state::State;
use crate::stats::BatchStats;
use clap::ValueEnum;
use serde_json::{Value, json};
use std::io;
use std::sync::Arc;

const EXAMPLES: &str = "Examples:
  abbe devices
  abbe render scenes/newton.json --device llvmpipe
  abbe render scenes/newton.json --device 1

A device is chosen by its number or any part of its name; 'reference' is always there.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Print a JSON array instead of lines
    #[arg(long)]
    json: bool,
}

/// The name that stands for [`ReferenceIntegrator`].
pub(super) const REFERENCE: &str = "reference";

/// `abbe devices`.
pub fn run(args: &Args) -> Outcome {
    let adapters = crate::gpu::list_adapters();
    if args.json {
        let list = adapters.iter().map(|a| json!({"name": a.name, "driver": a.driver, "backend": a.backend, "kind": a.kind}));
        let reference = json!({"name": REFERENCE, "driver": "", "backend": "cpu", "kind": "reference"});
        out(&serde_json::Value::Array(list.chain([reference]).collect()).to_string());
        return Ok(Done::Completely);
    }
    adapters.iter().enumerate().for_each(|(i, adapter)| out(&format!("{}: {adapter}", i + 1)));
    if adapters.is_empty() {
        out("no GPU adapter; on Debian, mesa-vulkan-drivers and libvulkan1 provide one that runs on the CPU");
    }
    out("reference (double precision on the CPU: slow and plain, for checking)");
    Ok(Done::Completely)
}

/// An integrator with what there is to say about it.
pub struct Device {
    /// What renders.
    pub integrator: Box<dyn Renderer>,
    /// Its name, with the driver's.
    pub name: String,
    /// It has no processor of its own.
    pub on_cpu: bool,
    /// What it finds is blurred within a pixel ([`abbe::integrator::Plan::is_blurred`]).
    pub merging: bool,
    /// What the next render can run on, with the kernels that are compiled.
    pub gpu: Option<Arc<Gpu>>,
}

/// A field of [`Techniques`].
#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq)]
pub enum Technique {
    #[value(alias = "chance-hits")]
    BsdfSampling,
    #[value(alias = "light-samples", alias = "nee")]
    NextEventEstimation,
    LightPaths,
    #[value(alias = "gathering")]
    Merging,
    Guiding,
    AdaptiveSampling,
    WavelengthSharing,
}

/// How paths are found; for render, bench and check.
#[derive(clap::Args, Clone, Default)]
pub struct TechniqueArgs {
    /// Leave out a way of finding paths or of sending them where they are of use (may be given again); the others make up for it where they can, and the plan says where not
    #[arg(long, value_name = "TECHNIQUE")]
    without: Vec<Technique>,
    /// Light paths for each camera path, instead of what a probe finds best
    #[arg(long, value_name = "N", value_parser = light_paths)]
    light_paths: Option<f64>,
}

fn light_paths(text: &str) -> std::result::Result<f64, String> {
    let n: f64 = text.parse().map_err(|_| format!("{text:?} is not a number"))?;
    if (0.001..=1000.0).contains(&n) { Ok(n) } else { Err("must be between 0.001 and 1000".to_string()) }
}

impl std::fmt::Display for TechniqueArgs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut without = self.names();
        without.sort();
        let without = if without.is_empty() { "all".to_string() } else { format!("without {}", without.join(", ")) };
        let light_paths = self.light_paths.map_or(String::new(), |n| format!(", {n} light paths for each camera path"));
        write!(f, "{without}{light_paths}")
    }
}

impl TechniqueArgs {
    fn names(&self) -> Vec<String> {
        self.without.iter().filter_map(|t| Some(t.to_possible_value()?.get_name().to_string())).collect()
    }

    /// As JSON, for another process.
    pub fn json(&self) -> Value {
        json!({"without": self.names(), "light_paths": self.light_paths})
    }

    /// What [`TechniqueArgs::json`] has made.
    pub fn of_json(value: &Value) -> Self {
        let names = value["without"].as_array().into_iter().flatten().filter_map(Value::as_str);
        Self {
            without: names.filter_map(|n| Technique::from_str(n, false).ok()).collect(),
            light_paths: value["light_paths"].as_f64(),
        }
    }

    /// The same but for these.
    pub fn but(&self, without: &[Technique]) -> Self {
        Self { without: [&self.without, without].concat(), ..self.clone() }
    }
}

impl From<&TechniqueArgs> for Techniques {
    fn from(args: &TechniqueArgs) -> Self {
        let has = |t: Technique| !args.without.contains(&t);
        Self {
            bsdf_sampling: has(Technique::BsdfSampling),
            next_event_estimation: has(Technique::NextEventEstimation),
            light_paths: has(Technique::LightPaths),
            merging: has(Technique::Merging),
            guiding: has(Technique::Guiding),
            adaptive_sampling: has(Technique::AdaptiveSampling),
            wavelength_sharing: has(Technique::WavelengthSharing),
        }
    }
}

/// Opens the device `name` (any adapter if `None`) for `scene`; signals end its work. The reference has techniques of its own.
pub fn open(scene: &Scene, name: Option<&str>, seed: u64, args: &TechniqueArgs) -> Result<Device> {
    open_on(None, scene, name, seed, args)
}

/// Likewise, on what a device before has left ([`Device::gpu`]), if there was one.
pub fn open_on(gpu: Option<Arc<Gpu>>, scene: &Scene, name: Option<&str>, seed: u64, args: &TechniqueArgs) -> Result<Device> {
    open_with(scene, (name, gpu), seed, args.into(), args.light_paths, 0)
}

impl Device {
    /// Opens the device anew after its memory ran out, with smaller tiles, to go on from the last one that is done. If this fails, what it has come to can
    /// still be saved.
    ///
    /// # Errors
    /// As [`open`].
    pub fn shrink(&mut self, scene: &Scene, name: Option<&str>, seed: u64, args: &TechniqueArgs) -> Result<()> {
        let mut saved = Vec::new();
        let damaged = |e| Error::device(format!("what was learned cannot be copied: {e}"), "report this");
        self.integrator.persist(&mut State::saving(&mut saved)).map_err(damaged)?;
        let halvings = self.integrator.halvings() + 1;
        let plan = self.integrator.describe();
        // What the old one holds makes room for the new one.
        self.integrator = Box::new(Parked { saved, plan });
        self.gpu = None;
        let mut next = open_with(scene, (name, None), seed, args.into(), args.light_paths, halvings)?;
        let mut saved = Vec::new();
        self.integrator.persist(&mut State::saving(&mut saved)).map_err(damaged)?;
        next.integrator.persist(&mut State::restoring(&mut saved.as_slice())).map_err(damaged)?;
        *self = next;
        Ok(())
    }
}

/// What an integrator has come to that is gone.
struct Parked {
    saved: Vec<u8>,
    plan: String,
}

impl Integrator for Parked {
    fn render_batch(&mut self, _: Batch, _: &mut Film) -> Result<BatchStats> {
        Err(Error::fault("the device is closed", "render again"))
    }

    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        self.saved.iter_mut().try_for_each(|byte| state.value(byte))
    }
}

impl Renderer for Parked {
    fn describe(&self) -> String {
        self.plan.clone()
    }

    fn aovs(&mut self, _: &[Albedo], _: u32, _: u32) -> Result<AovBuffers> {
        Err(Error::fault("the device is closed", "render again"))
    }
}

/// Likewise, with these techniques, where given the number of light paths for each camera path, and tiles halved so often at least.
pub fn open_with(
    scene: &Scene,
    (name, gpu): (Option<&str>, Option<Arc<Gpu>>),
    seed: u64,
    techniques: Techniques,
    light_paths: Option<f64>,
    halvings: u32,
) -> Result<Device> {
    if name == Some(REFERENCE) {
        let estimator = match scene.reference {
            Estimator::Backward => "backward",
            Estimator::Forward => "forward",
        };
        let mut integrator = ReferenceIntegrator::new(scene, scene.reference, seed)?;
        integrator.heed(interrupt::halt());
        return Ok(Device {
            integrator: Box::new(integrator),
            name: format!("reference ({estimator}, double precision)"),
            on_cpu: true,
            merging: false,
            gpu: None,
        });
    }
    let mut integrator = GpuIntegrator::with_tiles(scene, (name, gpu), seed, techniques, halvings)?;
    integrator.heed(interrupt::halt());
    if let Some(n) = light_paths {
        integrator.set_light_paths(n);
    }
    let adapter = integrator.adapter();
    let (name, on_cpu) = (adapter.to_string(), adapter.is_cpu());
    let merging = integrator.plan().is_blurred();
    let gpu = Some(integrator.gpu());
    Ok(Device { integrator: Box::new(integrator), name, on_cpu, merging, gpu })
}
