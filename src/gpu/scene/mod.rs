//! The scene as buffers: primitives in BVH order, materials, volumes, lights, tables, and the list of spectra to evaluate per pass.

mod alias;
mod highlights;
mod instances;
mod lens;
mod light_grid;
mod lights;
mod materials;
mod placed_lights;
mod primitives;
mod profiles;
mod ranks;
mod rows;
mod seen;
mod targets;
mod textures;

pub use placed_lights::light_grid_pays;
pub use ranks::{SLOTS, volume_stack};
pub use rows::{HERO_ROWS, SpectrumRow};
pub use targets::Targets;

use crate::error::{Error, Result};
use crate::gpu::layout::{Interior, Light, NO_INDEX, Params};
use crate::gpu::{Gpu, Resource};
use crate::scene::{self, Scene, bounds_of_all};
use crate::spectrum::{LINE_D_NM, Spectrum};
use crate::stage::{self, Stage};
use glam::DVec3;
use ranks::by_rank;
use rows::Rows;
use textures::Textures;

/// Least entries of a traversal's stack: as many as nearly all scenes need.
const LEAST_STACK: u32 = 32;

/// The scene on the GPU.
#[derive(Debug)]
pub struct GpuScene {
    /// Named tables and buffers, as the shaders call them.
    pub resources: Vec<(&'static str, Resource)>,
    /// Rows of the spectral table, in order.
    pub rows: Vec<SpectrumRow>,
    /// The scene's sizes; the rest is zero.
    pub params: Params,
    /// What is left of its sizes to kernels: the length of the traversal's stack, in coarse steps, since scenes of one length share compiled kernels.
    pub constants: String,
    /// Subtracted from world positions: the middle of the scene.
    pub origin: DVec3,
    /// What light paths are aimed at.
    pub targets: Targets,
    /// Power of all lights, mean over the film's range, W nm^-1.
    pub power: f64,
    /// Bytes in all of them.
    pub bytes: u64,
}

impl GpuScene {
    /// Builds and uploads everything; with `guiding` light paths are aimed at what bends them.
    ///
    /// # Errors
    /// [`Error`] if the scene exceeds what the shaders can index or the adapter can bind.
    pub fn new(gpu: &Gpu, scene: &Scene, guiding: bool) -> Result<Self> {
        if scene.interiors.len() > 0xffff {
            return Err(Error::usage("the scene has more than 65535 transparent volumes", "share materials between shapes"));
        }
        let mut rows = Rows::new();
        let bounds = bounds_of_all(&scene.shapes);
        let origin = if bounds.is_empty() { DVec3::ZERO } else { 0.5 * (bounds.min + bounds.max) };
        let interiors = interiors(scene, &mut rows);
        let mut textures = Textures::default();
        let (materials, tables) = materials::build(scene, &mut rows, &mut textures)?;
        let (lens, lens_constants) = lens::build(gpu, scene, &mut rows);
        stage::enter(Stage::Lights);
        let lights = lights::build(scene, &mut rows, &mut textures, bounds, origin)?;
        stage::enter(Stage::Hierarchies);
        let geometry = primitives::build(scene, bounds, origin, &lights.of_primitive)?;
        let (textures, first_uv) = textures.build(scene, &geometry);
        let mut records = lights.records;
        for light in &mut records {
            if light.primitive != NO_INDEX {
                light.primitive = geometry.place[light.primitive as usize];
            }
        }
        let number_of_lights = records.len() as u32;
        let highlights = highlights::brightest(scene, bounds, origin);
        records.extend(highlights.iter().map(|&p0| Light { p0, ..Default::default() }));
        let targets = Targets::new(scene, guiding);
        stage::enter(Stage::Uploading);
        let mut resources = vec![
            ("bvh", gpu.table("BVH nodes", &geometry.nodes)?),
            ("primitives", gpu.table("primitives", &geometry.primitives)?),
            ("instances", gpu.table("instances", &geometry.instances.table)?),
            ("normals", gpu.table("shading normals", &geometry.normals)?),
            ("materials", gpu.table("materials", &materials)?),
            ("interiors", gpu.table("volumes", &interiors)?),
            ("lights", gpu.table("lights", &records)?),
            ("light_grid", gpu.table("grid of lights", &lights.grid.texels)?),
            ("tables", gpu.storage("energy tables", &tables)?),
            ("targets", gpu.table("targets of light paths", &targets.records(origin))?),
            ("environment", gpu.table("environment picture", &lights.environment)?),
            ("profiles", gpu.table("profiles of lamps", &lights.profiles)?),
            ("textures", gpu.table("textures", &textures)?),
        ];
        resources.extend(lens);
        let bytes = resources.iter().map(|(_, r)| r.size()).sum();
        let params = Params {
            lights: number_of_lights,
            highlights: highlights.len() as u32,
            first_distant_light: lights.first_distant as u32,
            environment_light: lights.environment_light as u32,
            first_uv: first_uv as u32,
            first_instanced: geometry.instances.first_number,
            first_owner: geometry.instances.first_owner,
            near_share: lights.near_share as f32,
            ..lights.grid.params
        };
        let stack = geometry.stack.next_power_of_two().max(LEAST_STACK);
        // The loop over targets, mostly of one turn, is in every light path: as a parameter it cost 3 % of the time.
        let constants = format!(
            "const BVH_STACK = {stack}u;\nconst TARGETS = {}u;\nconst TARGETS_NESTED = {};\n{lens_constants}",
            targets.spheres.len(),
            targets.nested
        );
        let power = lights.power;
        Ok(Self { resources, power, rows: rows.all, params, constants, origin, targets, bytes })
    }
}

/// Their records by rank.
fn interiors(scene: &Scene, rows: &mut Rows) -> Vec<Interior> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let mut coefficient = |s: &Spectrum| if s.is_zero() { NO_INDEX } else { rows.spectrum(s) };
    let order: Vec<&scene::Interior> = by_rank(scene).into_iter().map(|i| &scene.interiors[i]).collect();
    let media: Vec<_> = order.iter().map(|i| (coefficient(&i.sigma_a), coefficient(&i.sigma_s))).collect();
    let parts_wavelengths = order.iter().any(|i| !i.ior.is_constant_over(lo, hi));
    order
        .iter()
        .zip(media)
        .map(|(i, (sigma_a_row, sigma_s_row))| Interior {
            eta_row: rows.volume(&i.ior, parts_wavelengths),
            sigma_a_row,
            sigma_s_row,
            dispersive: u32::from(!i.ior.is_constant_over(lo, hi)),
            g: i.g as f32,
            eta_d: i.ior.eval(scene.film.bins.nearest_nm(LINE_D_NM)) as f32,
            ..Default::default()
        })
        .collect()
}
