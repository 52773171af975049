//! The reference: two small, plain estimators in double precision that the GPU is held to, and that `--device reference` renders with.
//!
//! [`Estimator::Backward`] follows paths from the sensor and counts the light they meet; it sees lights of non-zero size. [`Estimator::Forward`]
//! follows light from its source and connects it to the sensor wherever it scatters; it sees diffuse and rough surfaces and fog, and no surface
//! behind smooth glass or in a mirror. Lights without size are not themselves visible to cameras. Neither weighs one way of finding a path
//! against another: no multiple importance sampling, no next-event estimation backward, one path at a time.
//!
//! A path carries one wavelength in every bin, all displaced alike. Where dispersion parts them it goes on as one path for each. From the
//! eighth scattering event on it plays Russian roulette with the share of the flux it started with; after `Scene::max_depth` events it is cut,
//! which [`BatchStats::truncated`] counts. Transport is unpolarised. Light from infinity does not reach into a medium that fills the scene.

mod aov;
mod backward;
mod bsdf;
mod forward;
mod interiors;
mod light;
mod material;
mod medium;
mod rng;
mod sensor;
mod start;
mod surface;
mod walk;

use crate::bsdf::energy::{EnergyTable, Facets};
use crate::bsdf::sheen::Sheen;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::aov::{Albedo, AovBuffers};
use crate::geometry::world::World;
use crate::render::{Batch, Halt, Integrator, Renderer};
use crate::scene::{Estimator, Grain, Material, Scene, WavelengthSampling, inside};
use crate::spectrum::library::{self, Cmf, Observer};
use crate::stats::BatchStats;
use light::Emitters;
use rayon::prelude::*;
use rng::Rng;
use std::collections::BTreeMap;
use std::time::Instant;

/// Maximum luminous efficacy, lm / W, that turns watts weighed by the observer into XYZ.
const K_M: f64 = 683.002;

/// Light paths that one task follows, and tasks whose splats are held before they go to the film.
const PATHS_PER_TASK: u64 = 1024;
const TASKS_AT_ONCE: u64 = 64;

/// One of the two plain estimators at work on a scene.
pub struct ReferenceIntegrator {
    stage: Stage,
    estimator: Estimator,
}

/// The scene made ready for paths.
struct Stage {
    scene: Scene,
    world: World,
    emitters: Emitters,
    energy: Vec<(Facets, EnergyTable)>,
    /// By the index of the material.
    sheens: BTreeMap<usize, Sheen>,
    observer: &'static Cmf,
    has_interiors: bool,
    has_environment: bool,
    seed: u64,
    /// Looked at between paths.
    halt: Halt,
}

/// The facets of a material; none of what is smooth or has none.
fn facets(material: &Material, grain: Option<Grain>) -> Option<Facets> {
    let alpha = material.alpha().filter(|&alpha| alpha > 0.0)?;
    Some(match material {
        Material::Dielectric { antireflective, .. } => Facets::Glass { alpha, coated: *antireflective },
        Material::Coated { .. } => Facets::Coat { alpha },
        _ => Facets::of_mirror(alpha, grain.map(|grain| grain.width(alpha))),
    })
}

impl ReferenceIntegrator {
    /// Makes a scene ready. The same `seed` gives the same bits on any number of threads.
    ///
    /// # Errors
    /// [`Error::Usage`] if the backward estimator is asked for a scene with lights that have no size, which it cannot see.
    pub fn new(scene: &Scene, estimator: Estimator, seed: u64) -> Result<Self> {
        if let (Estimator::Backward, Some(light)) = (estimator, scene.lights.iter().find(|light| light.is_delta())) {
            return Err(Error::usage(
                format!("the backward reference cannot see a {}: no path from the sensor can meet it", light.name()),
                "set \"reference\": \"forward\" in the scene, or give the light a size",
            ));
        }
        let mut scene = scene.flattened();
        let world = World::new(scene.shapes.iter().map(|s| &s.geometry));
        scene.sensor = start::off_surfaces(scene.sensor, world.extent);
        let scene = &scene;
        let ball = world.ball_around(&sensor::corners(&scene.sensor));
        let mut energy: Vec<(Facets, EnergyTable)> = Vec::new();
        for (index, material) in scene.materials.iter().enumerate() {
            if let Some(facets) = facets(material, scene.grains.get(&index).copied())
                && energy.iter().all(|(known, _)| *known != facets)
            {
                energy.push((facets, EnergyTable::new(facets)));
            }
        }
        let stage = Stage {
            emitters: Emitters::new(scene, ball),
            observer: library::observer(Observer::Cie1931),
            has_interiors: inside::has_volumes(scene),
            has_environment: scene.lights.iter().any(|l| l.is_distant() && !l.is_delta()),
            scene: scene.clone(),
            world,
            energy,
            sheens: material::sheens(scene),
            seed,
            halt: Halt::default(),
        };
        Ok(Self { stage, estimator })
    }
}

impl Integrator for ReferenceIntegrator {
    fn render_batch(&mut self, batch: Batch, film: &mut Film) -> Result<BatchStats> {
        let (stage, Batch { index, spp, .. }) = (&self.stage, batch);
        let channels = stage.scene.film.bins.count as usize + 3;
        let numbers = stage.kept_pixels();
        let mut sums = vec![0.0; numbers.len() * channels];
        let stats = match self.estimator {
            Estimator::Backward => {
                let pixels = sums.par_chunks_mut(channels).zip(numbers);
                pixels.map(|(sums, pixel)| stage.render_pixel(index, pixel, spp, sums)).reduce(BatchStats::default, add)
            }
            Estimator::Forward => stage.render_light_paths(index, spp, &mut sums),
        };
        stage.halt.check()?;
        film.add_batch_f64(&sums, spp);
        Ok(stats)
    }

    fn heed(&mut self, halt: &Halt) {
        self.stage.halt = halt.clone();
    }

    fn end_by(&mut self, time: Option<Instant>) {
        self.stage.halt.end_by(time);
    }
}

impl Renderer for ReferenceIntegrator {
    fn describe(&self) -> String {
        let from = match self.estimator {
            Estimator::Backward => "the sensor",
            Estimator::Forward => "the lights",
        };
        format!("reference: paths from {from}, nothing compiled")
    }

    fn aovs(&mut self, albedos: &[Albedo], index: u32, samples: u32) -> Result<AovBuffers> {
        Ok(self.stage.aovs(albedos, index, samples))
    }
}

impl Stage {
    /// Pixels of the picture.
    fn pixels(&self) -> usize {
        self.scene.film.pixels()
    }

    /// Numbers of those that are kept of it.
    fn kept_pixels(&self) -> Vec<usize> {
        self.scene.film.pixel_bounds().numbers(self.scene.film.width).collect()
    }

    /// As many light paths as the whole picture takes samples, their splats added in the order of the paths whatever the threads do.
    fn render_light_paths(&self, batch: u32, spp: u32, sums: &mut [f64]) -> BatchStats {
        let channels = self.scene.film.bins.count as usize + 3;
        let paths = self.pixels() as u64 * u64::from(spp);
        let tasks = paths.div_ceil(PATHS_PER_TASK);
        let mut stats = BatchStats::default();
        let kept = self.kept_pixels();
        for first in (0..tasks).step_by(TASKS_AT_ONCE as usize).take_while(|_| !self.halt.is_requested()) {
            let task = |task: u64| {
                let (mut splats, mut stats) = (Vec::new(), BatchStats::default());
                let indices = task * PATHS_PER_TASK..((task + 1) * PATHS_PER_TASK).min(paths);
                for index in indices.take_while(|_| !self.halt.is_requested()) {
                    stats += self.render_light_path(batch, index, &mut splats);
                }
                (splats, stats)
            };
            let done: Vec<_> = (first..(first + TASKS_AT_ONCE).min(tasks)).into_par_iter().map(task).collect();
            for (splats, task_stats) in done {
                stats += task_stats;
                for s in splats {
                    // Numbers rise.
                    let Ok(place) = kept.binary_search(&s.pixel) else { continue };
                    // The film divides by the samples of a pixel; each stands for as many paths as there are pixels.
                    let pixel = &mut sums[place * channels..(place + 1) * channels];
                    self.record(pixel, s.bin, s.nm, s.value / self.pixels() as f64);
                }
            }
        }
        stats
    }

    /// One wavelength per bin.
    fn wavelengths(&self, rng: &mut Rng) -> Vec<f64> {
        let bins = self.scene.film.bins;
        let offset = match self.scene.film.sampling {
            WavelengthSampling::Continuous => rng.next(),
            WavelengthSampling::Centres => 0.5,
        };
        (0..bins.count).map(|i| bins.edge_nm(i) + offset * bins.width_nm()).collect()
    }

    /// Adds a value at one wavelength to a pixel's sums: its bin, and X, Y, Z.
    fn record(&self, sums: &mut [f64], bin: usize, nm: f64, value: f64) {
        let bins = self.scene.film.bins;
        sums[bin] += value;
        for (sum, cmf) in sums[bins.count as usize..].iter_mut().zip(self.observer.eval(nm)) {
            *sum += K_M * bins.width_nm() * cmf * value;
        }
    }

    /// None where they are smooth.
    fn energy(&self, facets: Facets) -> Option<&EnergyTable> {
        self.energy.iter().find(|(known, _)| *known == facets).map(|(_, table)| table)
    }
}

fn add(mut a: BatchStats, b: BatchStats) -> BatchStats {
    a += b;
    a
}

/// The greatest sample that the film takes (`LARGEST_SAMPLE` of the shaders): sums of such are finite in a file of single precision.
const LARGEST_SAMPLE: f64 = 1e26;

/// Whether a value may go to the film; if not, it is counted as dropped.
fn finite(value: f64, stats: &mut BatchStats) -> bool {
    stats.dropped_not_finite += u64::from(!value.is_finite());
    stats.dropped_negative += u64::from(value < 0.0 && value.is_finite());
    stats.dropped_saturated += u64::from(value > LARGEST_SAMPLE && value.is_finite());
    (0.0..=LARGEST_SAMPLE).contains(&value)
}
