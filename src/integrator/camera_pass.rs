//! The camera pass on the GPU: batches of passes, tile by tile.

use super::{Plan, Wavelengths};
use crate::color::cie::K_M;
use crate::error::{Error, Result};
use crate::film::{Film, Tile};
use crate::gpu::layout::{COUNTERS, Params};
use crate::gpu::{AdapterInfo, Gpu, GpuScene, Kernel, rank};
use crate::reference::initial_interiors;
use crate::render::{BatchStats, Integrator};
use crate::scene::{Bins, Filter, Scene, Sensor};
use crate::spectrum::library::{Observer, observer};
use glam::{DVec3, UVec4, Vec4};
use std::time::{Duration, Instant};

/// Passes whose spectra are uploaded at a time.
const PASSES_PER_UPLOAD: u32 = 64;
/// How long a dispatch should take: well below the watchdogs of desktop drivers.
const DISPATCH_TIME: Duration = Duration::from_millis(50);

/// Renders a scene on an adapter.
#[derive(Debug)]
pub struct GpuIntegrator {
    gpu: Gpu,
    plan: Plan,
    kernel: Kernel,
    scene: GpuScene,
    wavelengths: Wavelengths,
    bins: Bins,
    seed: u32,
    params: Params,
    uniforms: wgpu::Buffer,
    counters: wgpu::Buffer,
    /// Workgroups of the next dispatch: adapted so that it takes [`DISPATCH_TIME`].
    groups: u32,
}

impl GpuIntegrator {
    /// Plans, compiles and uploads. `device` picks an adapter by part of its name; the seed keys all random numbers.
    ///
    /// # Errors
    /// [`Error::Device`] if no adapter fits, [`Error::Usage`] if the scene exceeds what it can hold.
    pub fn new(scene: &Scene, device: Option<&str>, seed: u64) -> Result<Self> {
        let gpu = Gpu::open(device)?;
        let plan = Plan::new(scene);
        let gpu_scene = GpuScene::new(&gpu, scene)?;
        let constants = plan.constants() + &gpu_scene.constants;
        let kernel = Kernel::new(&gpu, "camera_paths.wgsl", &constants, &plan.features)?;
        let params = params(scene, gpu_scene.origin, gpu_scene.rows.len() as u32 * plan.lanes.div_ceil(4))?;
        let uniforms = gpu.uniform("params", std::mem::size_of::<Params>() as u64);
        let counters = gpu.empty_storage("counters", (COUNTERS * 4) as u64)?;
        let seed = (seed ^ (seed >> 32)) as u32;
        Ok(Self {
            wavelengths: Wavelengths::new(scene),
            bins: scene.film.bins,
            scene: gpu_scene,
            groups: 64,
            gpu,
            plan,
            kernel,
            seed,
            params,
            uniforms,
            counters,
        })
    }

    /// What the scene needed.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Where it runs.
    pub fn adapter(&self) -> &AdapterInfo {
        &self.gpu.info
    }

    /// Bytes of the scene on the adapter.
    pub fn scene_bytes(&self) -> u64 {
        self.scene.bytes
    }

    /// Offset of pass `pass` of batch `batch`: radical inverses, shifted at random from batch to batch (Cranley & Patterson 1976).
    fn offset(&self, batch: u32, pass: u32) -> f64 {
        let mut h = (u64::from(self.seed) << 32 | u64::from(batch)).wrapping_add(0x9e37_79b9_7f4a_7c15);
        // SplitMix64 finaliser (Steele et al. 2014).
        h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        h ^= h >> 31;
        let shift = (h >> 11) as f64 * 0.5f64.powi(53);
        (f64::from(pass.reverse_bits()) * 0.5f64.powi(32) + shift).fract()
    }

    /// Spectra of the passes `first .. first + count` as the shaders read them, and the bin of each lane.
    fn spectra(&self, batch: u32, first: u32, count: u32) -> (Vec<Vec4>, Vec<u32>) {
        let lanes = self.plan.lanes as usize;
        let cmf = observer(Observer::Cie1931);
        let mut table = Vec::new();
        let mut lane_bins = Vec::new();
        for pass in first..first + count {
            let sampled = self.wavelengths.pass(self.offset(batch, pass));
            lane_bins.extend(sampled.iter().map(|(nm, _)| self.bins.index_of(*nm)));
            let weights: Vec<[f64; 4]> = sampled
                .iter()
                .map(|(nm, pdf)| {
                    let [x, y, z] = cmf.eval(*nm).map(|v| K_M * v / pdf);
                    [1.0 / (pdf * self.bins.width_nm()), x, y, z]
                })
                .collect();
            for row in &self.scene.rows {
                let mut values: Vec<f32> = sampled.iter().zip(&weights).map(|((nm, _), w)| row.eval(*nm, w) as f32).collect();
                // Lanes that only fill up the last vec4 carry no light; 1 keeps ratios of indices finite.
                values.resize(lanes.next_multiple_of(4), 1.0);
                table.extend(values.chunks_exact(4).map(Vec4::from_slice));
            }
        }
        (table, lane_bins)
    }

    /// Tiles that fit an adapter's binding, in rows of whole 8 x 8 blocks.
    fn tiles(&self) -> Vec<Tile> {
        let (width, height) = (self.params.image_width, self.params.image_height);
        let row_bytes = u64::from(width) * u64::from(self.plan.bins + 3) * 4;
        let rows = (self.gpu.max_binding() / row_bytes / 8 * 8).clamp(8, 1 << 20) as u32;
        let mut tiles = Vec::new();
        let columns = if row_bytes * 8 > self.gpu.max_binding() {
            (self.gpu.max_binding() / (u64::from(self.plan.bins + 3) * 4 * 8) / 8 * 8) as u32
        } else {
            width
        };
        for y in (0..height).step_by(rows as usize) {
            for x in (0..width).step_by(columns as usize) {
                tiles.push(Tile { x, y, width: columns.min(width - x), height: rows.min(height - y) });
            }
        }
        tiles
    }

    /// Renders one tile into `film`.
    fn render_tile(&mut self, tile: Tile, batch: u32, spp: u32, film: &mut Film) -> Result<BatchStats> {
        let floats = u64::from(tile.width) * u64::from(tile.height) * u64::from(self.plan.bins + 3);
        let sums = self.gpu.empty_storage("film", floats * 4)?;
        let mut stats = BatchStats { paths: u64::from(tile.width) * u64::from(tile.height) * u64::from(spp), ..Default::default() };
        let blocks = tile.width.div_ceil(8) * tile.height.div_ceil(8);
        for first in (0..spp).step_by(PASSES_PER_UPLOAD as usize) {
            let count = PASSES_PER_UPLOAD.min(spp - first);
            let (table, lane_bins) = self.spectra(batch, first, count);
            let spectra = self.gpu.storage("spectra", &table)?;
            let lane_bins = self.gpu.storage("wavelength bins", &lane_bins)?;
            let mut buffers: Vec<(&str, &wgpu::Buffer)> = self.scene.buffers.iter().map(|(n, b)| (*n, b)).collect();
            buffers.extend([("params", &self.uniforms), ("counters", &self.counters), ("film", &sums)]);
            buffers.extend([("spectra", &spectra), ("lane_bins", &lane_bins)]);
            let bindings = self.kernel.bind(&self.gpu, &buffers)?;
            let mut block = 0;
            while block < blocks {
                let groups = self.groups.min(blocks - block);
                let params = Params {
                    tile_x: tile.x,
                    tile_y: tile.y,
                    tile_width: tile.width,
                    tile_height: tile.height,
                    first_block: block,
                    first_sample: first,
                    samples: count,
                    batch,
                    seed: self.seed,
                    ..self.params
                };
                self.gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&params));
                self.gpu.queue.write_buffer(&self.counters, 0, &[0; COUNTERS * 4]);
                let start = Instant::now();
                self.kernel.run(&self.gpu, &bindings, groups)?;
                let ratio = DISPATCH_TIME.as_secs_f64() / start.elapsed().as_secs_f64().max(1e-4);
                block += groups;
                let limit = self.gpu.device.limits().max_compute_workgroups_per_dimension;
                self.groups = ((f64::from(groups) * ratio.clamp(0.25, 2.0)) as u32).clamp(1, limit);
                let c: Vec<u32> = self.gpu.read(&self.counters, (COUNTERS * 4) as u64)?;
                stats += BatchStats {
                    paths: 0,
                    rays: u64::from(c[0]),
                    dropped_not_finite: u64::from(c[1]),
                    dropped_negative: u64::from(c[2]),
                    truncated: u64::from(c[3]),
                };
            }
        }
        let sums: Vec<f32> = self.gpu.read(&sums, floats * 4)?;
        film.add_batch(tile, &sums, spp);
        Ok(stats)
    }
}

impl Integrator for GpuIntegrator {
    fn render_batch(&mut self, index: u32, spp: u32, film: &mut Film) -> Result<BatchStats> {
        let mut stats = BatchStats::default();
        for tile in self.tiles() {
            stats += self.render_tile(tile, index, spp, film)?;
        }
        Ok(stats)
    }
}

/// Uniforms that do not change from dispatch to dispatch.
fn params(scene: &Scene, origin: DVec3, spectra_stride: u32) -> Result<Params> {
    let film = &scene.film;
    let local = |p: DVec3| (p - origin).as_vec3().extend(0.0);
    let vec4 = |v: DVec3| v.as_vec3().extend(0.0);
    let aspect = f64::from(film.width) / f64::from(film.height);
    let half = |x: f64, y: f64, z: f64, w: f64| Vec4::new(x as f32, y as f32, z as f32, w as f32);
    let mut p = Params {
        image_width: film.width,
        image_height: film.height,
        max_depth: scene.max_depth,
        spectra_stride,
        filter_radius: match film.filter {
            Filter::Box => 0.5,
            Filter::Tent { radius } => radius as f32,
            Filter::Gaussian { sigma } => sigma as f32,
        },
        ..Default::default()
    };
    let start = match &scene.sensor {
        Sensor::Perspective { eye, frame, tan_half_vfov, lens_radius, focus_distance } => {
            p.origin = local(*eye);
            [p.axis_x, p.axis_y, p.axis_z] = [frame.x_axis, frame.y_axis, frame.z_axis].map(vec4);
            p.half_extent = half(tan_half_vfov * aspect, *tan_half_vfov, *lens_radius, *focus_distance);
            *eye
        }
        Sensor::Orthographic { eye, frame, height } => {
            p.origin = local(*eye);
            [p.axis_x, p.axis_y, p.axis_z] = [frame.x_axis, frame.y_axis, frame.z_axis].map(vec4);
            p.half_extent = half(0.5 * height * aspect, 0.5 * height, 0.0, 0.0);
            *eye
        }
        Sensor::IrradiancePlane { origin: corner, edge_u, edge_v } => {
            p.origin = local(*corner);
            [p.axis_x, p.axis_y, p.axis_z] = [*edge_u, *edge_v, edge_u.cross(*edge_v).normalize()].map(vec4);
            *corner + 0.5 * (edge_u + edge_v)
        }
        Sensor::IrradianceSphere { center, radius } => {
            p.origin = local(*center);
            p.half_extent = half(*radius, 0.0, 0.0, 0.0);
            *center + DVec3::Y * *radius
        }
    };
    let inside = initial_interiors(scene, start);
    if inside.len() > 4 {
        return Err(Error::usage(
            format!("the sensor lies inside {} nested volumes, at most 4 are followed", inside.len()),
            "remove some of the glasses or media around it",
        ));
    }
    let mut ranks = [0; 4];
    inside.iter().zip(&mut ranks).for_each(|(&i, r)| *r = rank(scene, i));
    p.inside = UVec4::from_array(ranks);
    Ok(p)
}
