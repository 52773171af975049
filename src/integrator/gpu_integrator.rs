//! Batches on the GPU, tile by tile: the camera pass, then the light pass where there can be caustics.

mod set_up;

use super::budget::Budget;
use super::dispatch::{FIRST_GROUPS, Job, Pass, least_groups};
use super::guide::Guide;
use super::landing::Landing;
use super::learned::Learned;
use super::merge::{BLUR, Merge, Radius, SPREAD, shrinkage};
use super::params::View;
use super::sample_counts::{ROUND, SampleCounts, Window, splitmix};
use super::tile_sums::TileSums;
use super::tiles::{even_rates, tiles};
use super::wavelengths::{HEROES, hero_texels};
use super::{Feature, Plan, Wavelengths, aov};
use crate::color::cie::K_M;
use crate::error::{Error, Result};
use crate::film::aov::{Albedo, AovBuffers};
use crate::film::{Film, Tile};
use crate::gpu::layout::{Params, PassHead, WorkItem, texels};
use crate::gpu::scene::{GpuScene, SpectrumRow};
use crate::gpu::{AdapterInfo, Gpu, Kernel, Resource, Staging, Timer, Traffic};
use crate::render::{Batch, Halt, Integrator, Renderer};
use crate::scene::Bins;
use crate::spectrum::library::{Observer, observer};
use crate::state::{Persistent, State};
use crate::stats::BatchStats;
use bytemuck::cast_slice;
use glam::{DVec4, UVec4, Vec4};
use rayon::prelude::*;
use std::io;
use std::iter::repeat;
use std::mem::take;
use std::sync::Arc;
use std::time::Instant;

/// Most passes of one dispatch.
const PASSES_PER_DISPATCH: u32 = 16;
/// Most samples that an invocation takes one after the other. The more, the less do lanes wait for the longest path of a few.
const MOST_SAMPLES: u32 = 64;
/// Events that an invocation may come to: lavapipe ends a shader after 65,535 turns of all its loops, a ray takes some tens of them.
const EVENTS_OF_INVOCATION: u32 = 1024;
/// Likewise rays, once it is known how many there are: ten spheres in a box take 35 turns for each (of eight lanes' rays the longest), a million triangles 70
/// to 90.
const RAYS_OF_INVOCATION: u64 = 512;
/// Passes whose sums single precision may hold: a sum of this many alike, one by one, is off by some 2e-6.
const PASSES_PER_SUM: u32 = 64;
/// Bytes for the samples of a dispatch on their way to the film: no more than keeps all cores busy, since an adapter's memory may be the host's.
const SAMPLE_BYTES: u64 = 32 << 20;
/// Likewise on a GPU, which traces some 100,000 paths at a time.
const SAMPLE_BYTES_GPU: u64 = 128 << 20;

/// Renders a scene on an adapter.
#[derive(Debug)]
pub struct GpuIntegrator {
    pub(super) gpu: Arc<Gpu>,
    pub(super) plan: Plan,
    camera: Pass,
    /// Finds the caustics, where there can be any.
    pub(super) light: Option<Pass>,
    pub(super) scene: GpuScene,
    wavelengths: Wavelengths,
    bins: Bins,
    seed: u32,
    pub(super) view: View,
    uniforms: Resource,
    counters: (Resource, Staging),
    timer: Option<Timer>,
    samples: Resource,
    pub(super) learned: Learned,
    /// Sums of the tile at hand, cleared whenever they are read.
    pub(super) film: (Resource, Staging),
    pub(super) splats: Option<(Resource, Staging)>,
    /// Those of the tile before.
    landing: Landing,
    merge: Option<Merge>,
    radius: Radius,
    /// Most passes of one dispatch.
    passes: u32,
    /// Bounds of `most_samples`: however long paths are, and at all.
    sample_bounds: (u32, u32),
    /// Samples of 8 x 8 pixels that there is room for in `samples`.
    sample_places: u32,
    halt: Halt,
}

impl GpuIntegrator {
    /// From now on [`BatchStats::kernel_times`] are measured; false if the adapter's clock cannot be read.
    pub fn time_kernels(&mut self) -> bool {
        self.timer = Timer::new(&self.gpu);
        self.timer.is_some()
    }

    /// Splits every pass into dispatches of at most `groups` workgroups (at least one), each of a single unit. What is computed does not depend on it.
    pub fn limit_dispatches(&mut self, groups: u32) {
        self.sample_bounds = (1, 1);
        self.learned.most_samples = 1;
        for pass in std::iter::once(&mut self.camera).chain(&mut self.light) {
            pass.limit = pass.limit.min(groups.max(1));
            pass.groups = pass.groups.min(pass.limit);
        }
    }

    /// What the scene needed.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The device that it runs on, with its kernels, for others to run on.
    pub fn gpu(&self) -> Arc<Gpu> {
        self.gpu.clone()
    }

    /// Where it runs.
    pub fn adapter(&self) -> &AdapterInfo {
        &self.gpu.info
    }

    /// What host and adapter had to do with each other so far.
    pub fn traffic(&self) -> Traffic {
        self.gpu.traffic()
    }

    /// Bytes of the scene on the adapter.
    pub fn scene_bytes(&self) -> u64 {
        self.scene.bytes
    }

    /// Pass `pass` (of all batches) as a point in the unit square, by radical inverses of base 2 and 3 (Halton 1960), shifted by the seed (Cranley &
    /// Patterson 1976): offset of its wavelengths, and place of the heroes of camera paths. One sequence for all batches, since it takes
    /// tens of passes until every wavelength had its turn; what batches differ by overstates the error for it.
    fn offsets(&self, pass: u64) -> (f64, f64) {
        let shift = |dimension: u64| {
            let key = u64::from(self.seed).wrapping_add(0x9e37_79b9_7f4a_7c15u64.wrapping_mul(dimension));
            (splitmix(key) >> 11) as f64 * 0.5f64.powi(53)
        };
        let inverse = |base: u64, mut rest: u64| {
            let (mut sum, mut digit) = (0.0, 1.0 / base as f64);
            while rest > 0 {
                sum += (rest % base) as f64 * digit;
                digit /= base as f64;
                rest /= base;
            }
            sum
        };
        let (point, is_mirrored) = self.wavelengths.point(pass);
        let offset = (inverse(2, point) + shift(0)).fract();
        // Samples in a row go through the wavelengths of one place.
        (if is_mirrored { 1.0 - offset } else { offset }, (inverse(3, pass / HEROES as u64) + shift(1)).fract())
    }

    /// Spectra of `count` passes from `first` as the shaders read them, and the bin of each wavelength.
    fn spectra(&self, first: u64, count: u32) -> (Vec<Vec4>, Vec<u32>) {
        let texels_of_row = self.plan.wavelengths.div_ceil(4) as usize;
        let cmf = observer(Observer::Cie1931);
        let of_pass = |number: u64| {
            let (offset, place) = self.offsets(number);
            let sampled = self.wavelengths.pass(offset);
            let wavelength_bins: Vec<u32> = sampled.iter().map(|(nm, _)| self.bins.index_of(*nm)).collect();
            let heroes = self.wavelengths.heroes(place);
            let (radius, per_metre) = self.radius.at(number, self.view.params.image_height);
            let head = PassHead {
                heroes: UVec4::from_array(heroes.map(|(wavelength, _)| wavelength)),
                hero_weights: Vec4::from_array(heroes.map(|(_, weight)| weight as f32)),
                merge_radius: radius as f32,
                merge_radius_per_metre: per_metre as f32,
                blur: if self.plan.shares_ways() { BLUR } else { 0.0 },
                spread: (SPREAD * shrinkage(number)) as f32,
            };
            let mut table: Vec<Vec4> = cast_slice(&[head]).to_vec();
            let of_film: Vec<[f64; 4]> = sampled
                .iter()
                .map(|(nm, pdf)| {
                    let [x, y, z] = cmf.eval(*nm).map(|v| K_M * v / pdf);
                    [1.0 / (pdf * self.bins.width_nm()), x, y, z]
                })
                .collect();
            for row in &self.scene.rows {
                let values: Vec<f64> = sampled.iter().zip(&of_film).map(|((nm, _), film)| row.eval(*nm, film)).collect();
                let (texels, part) = match row {
                    SpectrumRow::OfSamples(part) => (of_film.iter().map(|w| DVec4::from_array(*w).as_vec4()).collect(), *part),
                    SpectrumRow::Volume(_, part @ 1..) => {
                        (hero_texels(&values, Wavelengths::beyond(self.plan.wavelengths)), part - 1)
                    }
                    _ => {
                        // Wavelengths that only fill up the last vector carry no light: 1 keeps ratios of indices finite, and none of them is kept.
                        let values: Vec<f32> =
                            values.into_iter().map(|v| v as f32).chain(repeat(1.0)).take(4 * texels_of_row).collect();
                        (values.chunks_exact(4).map(Vec4::from_slice).collect(), 0)
                    }
                };
                table.extend(texels.into_iter().chain(repeat(Vec4::ONE)).skip(part as usize * texels_of_row).take(texels_of_row));
            }
            (table, wavelength_bins)
        };
        // The adapter has nothing to do until it is done.
        let passes: Vec<_> = (first..first + u64::from(count)).into_par_iter().map(of_pass).collect();
        let (tables, wavelength_bins): (Vec<_>, Vec<_>) = passes.into_iter().unzip();
        (tables.concat(), wavelength_bins.concat())
    }

    /// Traces passes over one tile, at these rates of its blocks.
    pub(super) fn trace(&mut self, tile: Tile, passes: Passes, rates: &[f64]) -> Result<Traced> {
        let guide = self
            .learned
            .guide
            .as_ref()
            .map(|g| self.gpu.table("guide of light paths", &g.table(self.view.pixels())))
            .transpose()?;
        let light_paths = self.light_paths(passes);
        let (guiding_sample_rate, guiding_sample_room) = self.learned.guide.as_mut().map_or((0.0, 0), |g| g.expect(light_paths));
        let (mut stats, mut earlier) = (BatchStats::default(), Vec::new());
        let mut summed = 0;
        let light_units = self.view.params.light_paths.div_ceil(64);
        let least_groups = least_groups(&self.gpu);
        for (first, window) in self.windows(passes, rates) {
            let count = window.passes;
            stats.paths += window.paths(tile.width, tile.height);
            let groups = window.groups((window.samples / least_groups).min(self.learned.most_samples));
            let work = self.gpu.table("work items", &[cast_slice::<_, u32>(&window.items), cast_slice(&groups)].concat())?;
            let (table, wavelength_bins) = self.spectra(passes.number + u64::from(first), count);
            let spectra = self.gpu.table("spectra", &table)?;
            let wavelength_bins = self.gpu.storage("wavelength bins", &wavelength_bins)?;
            let mut resources: Vec<(&str, &Resource)> = self.scene.resources.iter().map(|(n, b)| (*n, b)).collect();
            resources.extend([
                ("params", &self.uniforms),
                ("counters", &self.counters.0),
                ("film", &self.film.0),
                ("samples", &self.samples),
                ("work", &work),
            ]);
            resources.extend([("spectra", &spectra), ("wavelength_bins", &wavelength_bins)]);
            resources.extend(guide.iter().map(|g| ("guide", g)));
            resources.extend(self.learned.guide.iter().map(|g| ("guiding_samples", &g.guiding_samples)));
            if let Some(merge) = &self.merge {
                self.gpu.clear(&merge.heads);
                resources.extend([("points", &merge.points), ("heads", &merge.heads)]);
            }
            let first_sample = passes.first_sample + u64::from(first);
            let (light_sequence, first_light_pass) = light_sequence(passes.sequence, self.view.params.light_paths, first_sample);
            let params = Params {
                tile_x: tile.x,
                tile_y: tile.y,
                tile_width: tile.width,
                tile_height: tile.height,
                first_sample: first_sample as u32,
                samples: count,
                first_work_group: window.items.len() as u32 * texels::<WorkItem>(),
                light_units: count * (light_units / least_groups).min(self.learned.most_samples / count).max(1),
                sequence: passes.sequence,
                light_sequence,
                first_light_pass,
                seed: self.seed,
                guiding_sample_rate,
                guiding_sample_room,
                ..self.view.params
            };
            let timer = self.timer.as_ref();
            let (gpu, halt) = (&self.gpu, &self.halt);
            let (uniforms, counters) = (&self.uniforms, &self.counters);
            let job = Job { gpu, halt, timer, uniforms, counters, resources: &resources, params };
            // A group has one unit at least, of a sample in every pass at most.
            let limit = self.sample_places / self.learned.most_samples.max(count);
            // Through a lens camera paths splat, too, into sums of their own.
            let mut own = resources.clone();
            own.push(("splats", &self.film.0));
            let (camera, camera_counts, camera_time) =
                Job { resources: &own, ..job }.run(&mut self.camera, groups.len() as u32, limit)?;
            self.learned.fitting =
                self.learned.fitting.min(fitting(groups.iter().map(|g| g.samples).max().unwrap_or(1), camera.most_rays));
            stats += BatchStats { camera_rays: camera.rays, camera_time, camera_counts, ..camera };
            if let Some(light) = &mut self.light {
                let groups = (light_units * count).div_ceil(params.light_units);
                let mut own = resources.clone();
                own.extend(self.splats.iter().map(|(s, _)| ("splats", s)));
                let (light, light_counts, light_time) = Job { resources: &own, ..job }.run(light, groups, u32::MAX)?;
                self.learned.fitting = self.learned.fitting.min(fitting(params.light_units, light.most_rays));
                let light_paths = u64::from(params.light_paths) * u64::from(count);
                stats += BatchStats { light_paths, light_time, light_counts, ..light };
            }
            summed += count;
            if summed >= PASSES_PER_SUM && self.plan.bytes_of_sum() == 4 && first + count < passes.count {
                self.sum_up(tile, &mut earlier)?;
                summed = 0;
            }
        }
        Ok(Traced { earlier, stats })
    }

    /// Values of a tile's film.
    fn values(&self, tile: Tile) -> u64 {
        u64::from(tile.width) * u64::from(tile.height) * u64::from(self.plan.bins + 3)
    }

    /// All those of some passes.
    fn light_paths(&self, passes: Passes) -> f64 {
        f64::from(self.view.params.light_paths) * f64::from(passes.count)
    }

    /// Adds what single precision holds so far to `sums`.
    fn sum_up(&self, tile: Tile, sums: &mut Vec<f64>) -> Result<()> {
        let (film, staging) = &self.film;
        let taken = self.gpu.take(&[(film, staging, 4 * self.values(tile))])?;
        let part = || taken.iter().flat_map(|part| cast_slice::<u8, f32>(part)).map(|&v| f64::from(v));
        if sums.is_empty() {
            sums.extend(part());
        } else {
            sums.iter_mut().zip(part()).for_each(|(sum, v)| *sum += v);
        }
        Ok(())
    }

    /// Brings back what passes over a tile came to, and has the guide learn from it.
    pub(super) fn bring_back(&mut self, tile: Tile, passes: Passes, earlier: Vec<f64>) -> Result<TileSums> {
        let values = self.values(tile);
        let mut parts = vec![(&self.film.0, &self.film.1, self.plan.bytes_of_sum() * values)];
        parts.extend(self.splats.iter().map(|(splats, staging)| (splats, staging, 8 * values)));
        parts.extend(self.learned.guide.iter().map(Guide::report));
        // All that can fail comes first: the state changes as a whole or not at all.
        let mut taken = self.gpu.take(&parts)?.into_iter();
        let mut next =
            || taken.next().ok_or_else(|| Error::device("nothing came back", "this is a defect of Abbe: please report it"));
        let film = next()?;
        let splats = self.splats.is_some().then(&mut next).transpose()?;
        let report = self.learned.guide.is_some().then(&mut next).transpose()?;
        // Every pass is an estimate from all its light paths.
        let quantum = 1.0 / (f64::from(self.view.params.inverse_quantum) * f64::from(self.view.params.light_paths));
        let channels = self.plan.bins as usize + 3;
        let in_quanta = self.plan.has(Feature::SensorLens);
        let sums = TileSums { tile, spp: passes.count, channels, film, in_quanta, earlier, splats, quantum };
        let light_paths = self.light_paths(passes);
        if let Some((guide, report)) = self.learned.guide.as_mut().zip(report) {
            guide.learn(cast_slice(&report), light_paths);
        }
        Ok(sums)
    }

    /// The passes in windows whose samples and visible points fit, each with the first of it; how many samples blocks have is a whole number over a
    /// round of passes, and of every block at least one.
    fn windows(&self, passes: Passes, rates: &[f64]) -> Vec<(u32, Window)> {
        let most = self.merge.as_ref().map_or(self.passes, |g| g.passes);
        let fits = |window: &Window| self.merge.as_ref().is_none_or(|g| 64 * window.samples <= g.slots);
        let mut windows = Vec::new();
        let mut counts = SampleCounts::new(rates.len());
        for first in (0..passes.count).step_by(ROUND as usize) {
            let round = ROUND.min(passes.count - first);
            let number = self.wavelengths.point(passes.number + u64::from(first)).0 / u64::from(round);
            let size = round.div_ceil(round.div_ceil(most));
            let split = |counts: &SampleCounts| -> Vec<(u32, Window)> {
                (0..round).step_by(size as usize).map(|at| (first + at, counts.window(at, size.min(round - at)))).collect()
            };
            counts.begin_round(rates, round, number, splitmix(u64::from(self.seed)));
            let mut of_round = split(&counts);
            if !of_round.iter().all(|(_, window)| fits(window)) {
                // Of a tile with more than its share of the picture's samples; elsewhere by a chance that is next to nothing.
                counts.begin_evenly(round);
                of_round = split(&counts);
            }
            windows.append(&mut of_round);
        }
        windows
    }

    /// Tiles that the picture is rendered in; light paths are traced for each.
    pub fn tile_count(&self) -> usize {
        self.tiles().len()
    }

    pub(super) fn tiles(&self) -> Vec<Tile> {
        tiles(&self.gpu, &self.plan, self.view.bounds, self.learned.halvings)
    }

    pub(super) fn set_budget(&mut self, budget: Budget) {
        // Those that are told go with camera paths of the whole picture, so that a part of it has the same.
        let pixels = if budget.probe.is_some() { self.view.pixels() } else { self.view.pixels_of_picture() };
        self.view.params.light_paths = (pixels * budget.light_paths).round().max(1.0) as u32;
        self.learned.budget = Some(budget);
    }

    /// Has so many light paths go with each camera path of the whole picture, instead of what a probe finds best.
    pub fn set_light_paths(&mut self, for_each_camera_path: f64) {
        self.set_budget(Budget { light_paths: for_each_camera_path, probe: None });
    }

    /// How the work is split, once it is known.
    pub fn budget(&self) -> Option<Budget> {
        self.learned.budget
    }
}

/// The sequence for light paths that pass `number` of a sequence goes on in, so many to a pass, and the pass's number there: there is one for each number of paths, and another one before the
/// numbers of paths outgrow 32 bits.
fn light_sequence(sequence: u32, light_paths: u32, number: u64) -> (u32, u32) {
    let passes = 1u64 << 30u32.saturating_sub(light_paths.max(1).ilog2());
    let key = splitmix(splitmix(u64::from(light_paths) << 32 | u64::from(sequence)) ^ (number / passes));
    ((key >> 32) as u32, (number % passes) as u32)
}

/// Passes in a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Passes {
    /// Their sequence of random numbers.
    pub(super) sequence: u32,
    /// Number of the first one's samples in it.
    pub(super) first_sample: u64,
    /// Number of the first one among all of the render, by which it has its wavelengths.
    pub(super) number: u64,
    pub(super) count: u32,
}

/// Passes over a tile whose last sums are still on the adapter.
pub(super) struct Traced {
    /// Sums of passes before those, if there were more than single precision holds.
    pub(super) earlier: Vec<f64>,
    pub(super) stats: BatchStats,
}

impl GpuIntegrator {
    /// What a budget that is told means for a part of the picture.
    fn of_part(&self, budget: Budget) -> String {
        let share = self.view.pixels_of_picture() / self.view.pixels();
        if share == 1.0 || budget.probe.is_some() {
            return String::new();
        }
        format!(": all those of the whole picture, {:.2} for each of the part", budget.light_paths * share)
    }

    /// [`Integrator::render_ahead`], unguarded. Its state changes at a tile's end alone.
    fn batch(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
        let Batch { first_pass, spp, sequence, first_sample, .. } = batch;
        if self.learned.tiles_done == 0 {
            self.probe(batch, film)?;
        }
        let tiles = self.tiles();
        for &tile in &tiles[self.learned.tiles_done.min(tiles.len())..] {
            let rates = self.learned.adaptive.as_ref().map_or_else(|| even_rates(tile), |a| a.rates(tile, spp));
            let passes = Passes { sequence, first_sample, number: first_pass, count: spp };
            let traced = self.trace_meanwhile(tile, passes, &rates, film)?;
            let sums = self.bring_back(tile, passes, traced.earlier)?;
            self.learned.stats += traced.stats;
            self.learned.tiles_done += 1;
            if let Some((guide, seen)) = self.learned.guide.as_mut().zip(self.learned.seen.as_mut()) {
                guide.brightness.take(seen);
            }
            self.landing.begin(sums, rates, self.learned.tiles_done == tiles.len());
        }
        Ok(self.learned.finish_batch(self.sample_bounds))
    }

    /// Traces passes over a tile while the one before goes into the film.
    fn trace_meanwhile(&mut self, tile: Tile, passes: Passes, rates: &[f64], film: &mut Film) -> Result<Traced> {
        let (mut landing, mut seen, mut adaptive) =
            (take(&mut self.landing), self.learned.seen.take(), self.learned.adaptive.take());
        let (faults, mut cut) = (self.gpu.faults.clone(), 0);
        let traced = rayon::in_place_scope(|scope| {
            scope.spawn(|_| cut = landing.land(film, seen.as_mut(), adaptive.as_mut()));
            // A panic must not take along what was moved out.
            faults.guard(|| self.trace(tile, passes, rates))
        });
        (self.landing, self.learned.seen, self.learned.adaptive) = (landing, seen, adaptive);
        self.learned.stats.dropped_saturated += cut;
        traced
    }

    /// Brings what is left of the tile before into the film.
    pub(super) fn land(&mut self, film: &mut Film) {
        self.learned.stats.dropped_saturated +=
            self.landing.land(film, self.learned.seen.as_mut(), self.learned.adaptive.as_mut());
    }

    /// [`Renderer::aovs`], unguarded.
    fn hits(&self, albedos: &[Albedo], index: u32, samples: u32) -> Result<AovBuffers> {
        let (gpu, plan) = (&self.gpu, &self.plan);
        let constants = plan.constants() + &self.scene.constants;
        let kernel = Kernel::new(gpu, "aov.wgsl", &constants, &plan.aovs.switches())?;
        let pass =
            Pass { kernels: vec![kernel], limit: self.camera.limit, first_time: 0, groups: FIRST_GROUPS.min(self.camera.limit) };
        let albedos = gpu.table("albedos", &aov::table(albedos))?;
        let mut resources: Vec<(&str, &Resource)> = self.scene.resources.iter().map(|(n, b)| (*n, b)).collect();
        resources.push(("albedos", &albedos));
        // A lens bends by its indices.
        let spectra = gpu.table("spectra", &self.spectra(0, 1).0)?;
        resources.push(("spectra", &spectra));
        let params = Params { samples, sequence: index, seed: self.seed, ..self.view.params };
        let tiles = self.tiles();
        let work = (self.view.bounds, tiles.as_slice());
        let behind = plan.aovs.has(Feature::Behind);
        aov::run((gpu, &self.halt), pass, work, &resources, (&self.uniforms, &self.counters), params, behind)
    }
}

impl Integrator for GpuIntegrator {
    fn render_batch(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
        let rendered = self.render_ahead(batch, film);
        let mut stats = self.settle(film);
        stats += rendered?;
        Ok(stats)
    }

    fn render_ahead(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
        let faults = self.gpu.faults.clone();
        faults.guard(|| self.batch(batch, film))
    }

    fn settle(&mut self, film: &mut Film) -> BatchStats {
        self.land(film);
        // What was counted in a batch that is not done stays with it.
        if self.learned.tiles_done == 0 { take(&mut self.learned.stats) } else { BatchStats::default() }
    }

    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()> {
        // Tiles of a state from before memory ran out may be too large: those that are done have become several each.
        let least = self.learned.halvings;
        self.learned.persist(state)?;
        if self.learned.halvings < least {
            let area = |tile: &Tile| u64::from(tile.width) * u64::from(tile.height);
            let done: u64 = self.tiles().iter().take(self.learned.tiles_done).map(area).sum();
            self.learned.halvings = least;
            let up_to = |sum: &mut u64, tile: &Tile| {
                *sum += area(tile);
                Some(*sum)
            };
            self.learned.tiles_done = self.tiles().iter().scan(0, up_to).take_while(|sum| *sum <= done).count();
        }
        if let Some(budget) = self.learned.budget {
            self.set_budget(budget);
        }
        Ok(())
    }

    fn heed(&mut self, halt: &Halt) {
        self.halt = halt.clone();
    }

    fn end_by(&mut self, time: Option<Instant>) {
        self.halt.end_by(time);
    }
}

impl Renderer for GpuIntegrator {
    fn describe(&self) -> String {
        let budget = self.learned.budget.map_or(String::new(), |budget| format!("  budget: {budget}{}\n", self.of_part(budget)));
        let tiles = match self.learned.halvings {
            0 => String::new(),
            _ => format!("  memory: it ran out on the device; {} smaller tiles\n", self.tile_count()),
        };
        format!("{}{budget}{tiles}", self.plan)
    }

    fn halvings(&self) -> u32 {
        self.learned.halvings
    }

    fn aovs(&mut self, albedos: &[Albedo], index: u32, samples: u32) -> Result<AovBuffers> {
        self.gpu.faults.guard(|| self.hits(albedos, index, samples))
    }
}

/// What of a seed keys the random numbers of the GPU; renders of seeds for which it is the same have the same ones.
pub fn fold_seed(seed: u64) -> u32 {
    (seed ^ (seed >> 32)) as u32
}

/// How many samples an invocation may take, if one that took `samples` had `rays`.
fn fitting(samples: u32, rays: u64) -> u32 {
    u32::try_from(u64::from(samples) * RAYS_OF_INVOCATION / rays.max(1)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_light_path_has_the_numbers_of_another() {
        for light_paths in [1, 7, 4096, 100_000, 1 << 24, u32::MAX >> 4] {
            let mut before = light_sequence(0, light_paths, 0);
            assert_ne!(before.0, light_sequence(1, light_paths, 0).0);
            assert_ne!(before.0, light_sequence(0, light_paths + 1, 0).0);
            for pass in 1..100 {
                let (sequence, first) = light_sequence(0, light_paths, pass);
                // It goes on, or another one begins.
                assert!((sequence, first) == (before.0, before.1 + 1) || sequence != before.0 && first == 0);
                // With room for all paths of the pass.
                assert!((u64::from(first) + 1) * u64::from(light_paths) <= 1 << 32);
                before = (sequence, first);
            }
            // And for those of the longest dispatch, where a batch has several passes.
            let far = u64::from(u32::MAX);
            let (_, first) = light_sequence(0, light_paths, far);
            let passes = if light_paths > 1 << 24 { 1 } else { u64::from(PASSES_PER_DISPATCH) };
            assert!((u64::from(first) + passes) * u64::from(light_paths) <= 1 << 32, "{light_paths}");
        }
    }
}
