//! From a scene to an integrator that is ready: plan, upload, kernels, buffers.

use super::super::adaptive::Adaptive;
use super::super::dispatch::{FIRST_GROUPS, Pass};
use super::super::guide::Guide;
use super::super::landing::Landing;
use super::super::learned::{Learned, MOST_HALVINGS};
use super::super::merge::{self, Merge, Radius};
use super::super::params::{View, params};
use super::super::probe::probed;
use super::super::tiles::{blocks, tiles};
use super::super::{Feature, Features, Plan, Techniques, Wavelengths};
use super::{EVENTS_OF_INVOCATION, GpuIntegrator, MOST_SAMPLES, PASSES_PER_DISPATCH, SAMPLE_BYTES, SAMPLE_BYTES_GPU, fold_seed};
use crate::error::{Error, Result};
use crate::film::Tile;
use crate::gpu::layout::{COUNTERS, Params, PassHead, texels};
use crate::gpu::scene::GpuScene;
use crate::gpu::{Gpu, Kernel, Resource, Staging};
use crate::render::Halt;
use crate::scene::bounds_of_all;
use crate::scene::{FilmSettings, Scene};
use crate::stage::{self, Stage};
use std::sync::Arc;

impl GpuIntegrator {
    /// Plans, compiles and uploads. `device` picks an adapter by part of its name; the seed keys all random numbers.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if no adapter fits, [`crate::Error::Usage`] if the scene exceeds what it can hold.
    pub fn new(scene: &Scene, device: Option<&str>, seed: u64) -> Result<Self> {
        Self::with(scene, device, seed, Techniques::default())
    }

    /// Likewise, with some techniques only.
    ///
    /// # Errors
    /// As [`GpuIntegrator::new`].
    pub fn with(scene: &Scene, device: Option<&str>, seed: u64, techniques: Techniques) -> Result<Self> {
        stage::enter(Stage::Planning);
        Self::with_plan(scene, device, seed, Plan::new(scene, techniques))
    }

    /// Likewise, on a device that is open already if one is given, and where memory runs out again on one opened anew with smaller tiles, halved `halvings` times
    /// at least. They are a part of the state: light paths are traced for every tile.
    ///
    /// # Errors
    /// As [`GpuIntegrator::new`]; [`crate::Error::OutOfMemory`] if the smallest tiles do not help.
    pub fn with_tiles(
        scene: &Scene,
        (device, mut open): (Option<&str>, Option<Arc<Gpu>>),
        seed: u64,
        techniques: Techniques,
        halvings: u32,
    ) -> Result<Self> {
        stage::enter(Stage::Planning);
        let mut halvings = halvings.min(MOST_HALVINGS);
        loop {
            let gpu = open.take().map_or_else(|| Gpu::open(device).map(Arc::new), Ok)?;
            match Self::in_tiles(gpu, scene, seed, Plan::new(scene, techniques), halvings) {
                Err(Error::OutOfMemory { .. }) if halvings < MOST_HALVINGS => halvings += 1,
                done => return done,
            }
        }
    }

    /// Likewise, with what is in the plan, needed or not.
    ///
    /// # Errors
    /// As [`GpuIntegrator::new`].
    pub fn with_plan(scene: &Scene, device: Option<&str>, seed: u64, plan: Plan) -> Result<Self> {
        Self::on(Arc::new(Gpu::open(device)?), scene, seed, plan)
    }

    /// Likewise, on a device that is open already: what was compiled there for this plan, whatever the scene, is not compiled again.
    ///
    /// # Errors
    /// As [`GpuIntegrator::new`].
    pub fn on(gpu: Arc<Gpu>, scene: &Scene, seed: u64, plan: Plan) -> Result<Self> {
        Self::in_tiles(gpu, scene, seed, plan, 0)
    }

    fn in_tiles(gpu: Arc<Gpu>, scene: &Scene, seed: u64, plan: Plan, halvings: u32) -> Result<Self> {
        let faults = gpu.faults.clone();
        faults.guard(|| Self::built(gpu, scene, seed, plan, halvings))
    }

    fn built(gpu: Arc<Gpu>, scene: &Scene, seed: u64, plan: Plan, halvings: u32) -> Result<Self> {
        let gpu_scene = GpuScene::new(&gpu, scene, plan.techniques.guiding)?;
        let reach = merge::reach(scene, &gpu_scene.targets);
        stage::enter(Stage::Compiling);
        let mut params = params(
            scene,
            bounds_of_all(&scene.shapes),
            &gpu_scene,
            reach,
            texels::<PassHead>() + gpu_scene.rows.len() as u32 * plan.wavelengths.div_ceil(4),
        )?;
        let bounds = scene.film.pixel_bounds();
        let view = View { params, bounds };
        let largest = |bounds: Tile| blocks(tiles(&gpu, &plan, bounds, halvings)[0]);
        let blocks = [view, probed(&view)].map(|view| largest(view.bounds)).into_iter().fold(1, u32::max);
        let passes = ((EVENTS_OF_INVOCATION / scene.max_depth.max(1)).min(PASSES_PER_DISPATCH) >> halvings).max(1);
        let merge = if plan.has(Feature::Merging) {
            // As many passes at a time as of the whole picture, so that sums are rounded alike.
            let whole = FilmSettings { crop: None, ..scene.film.clone() };
            let passes = merge::passes(&gpu, &plan, blocks.max(largest(whole.pixel_bounds())), passes);
            Some(Merge::new(&gpu, &plan, blocks, passes)?)
        } else {
            None
        };
        (params.heads, params.points) = merge.as_ref().map_or((0, 0), |g| (g.cells, g.links));
        let constants = plan.constants() + &gpu_scene.constants;
        let limit = gpu.device.limits().max_compute_workgroups_per_dimension;
        let pass = |roots: &[&str], features: Features, limit: u32, first_time: usize| -> Result<Pass> {
            let kernels =
                roots.iter().map(|root| Kernel::new(&gpu, root, &constants, &features.switches())).collect::<Result<_>>()?;
            Ok(Pass { kernels, limit, first_time, groups: FIRST_GROUPS.min(limit) })
        };
        let texels = 64 * u64::from(plan.wavelengths.div_ceil(4));
        let sample_bytes = if gpu.info.is_cpu() { SAMPLE_BYTES } else { SAMPLE_BYTES_GPU };
        let sample_places = ((sample_bytes >> halvings).min(gpu.max_binding()) / (16 * texels)) as u32;
        let samples = gpu.empty_table("samples", u64::from(sample_places) * texels)?;
        let values = 64 * u64::from(blocks) * u64::from(plan.bins + 3);
        let summed = |label: &str, bytes: u64| -> Result<(Resource, Staging)> {
            Ok((gpu.empty_storage(label, bytes)?, Staging::new(&gpu, bytes)))
        };
        let has_lens = plan.has(Feature::SensorLens);
        let film = summed("film", plan.bytes_of_sum() * values)?;
        let splats = plan.light.as_ref().map(|_| summed("splats", 8 * values)).transpose()?;
        let camera_kernels: &[&str] = if has_lens { &["camera_paths.wgsl"] } else { &["camera_paths.wgsl", "update_film.wgsl"] };
        let light = || plan.light.map(|f| pass(&["light_paths.wgsl"], f, limit, 2)).transpose();
        let camera = || pass(camera_kernels, plan.camera, limit, 0);
        // Side by side, by threads whose panics are not those of this one.
        let (camera, light) = rayon::join(|| gpu.faults.guard(camera), || gpu.faults.guard(light));
        let (camera, light) = (camera?, light?);
        let uniforms = gpu.uniform("params", std::mem::size_of::<Params>() as u64);
        let counters = summed("counters", (COUNTERS * 4) as u64)?;
        let guide = plan.guides(gpu_scene.params.lights).map(|[axes, aims]| Guide::new(&gpu, axes, aims)).transpose()?;
        let seed = fold_seed(seed);
        let (wavelengths, bins) = (Wavelengths::new(scene), scene.film.bins);
        let adaptive = plan.is_adaptive().then(|| Adaptive::new(&scene.film, plan.has(Feature::Merging)));
        Ok(Self {
            gpu,
            plan,
            camera,
            light,
            scene: gpu_scene,
            wavelengths,
            bins,
            seed,
            view: View { params, bounds },
            uniforms,
            counters,
            timer: None,
            samples,
            learned: Learned::new(guide, adaptive, passes, halvings),
            film,
            splats,
            landing: Landing::default(),
            merge,
            radius: Radius::new(scene, reach),
            passes,
            sample_bounds: (passes, MOST_SAMPLES),
            sample_places,
            halt: Halt::default(),
        })
    }
}
