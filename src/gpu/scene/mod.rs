//! The scene as buffers: primitives in BVH order, materials, volumes, lights, tables, and the list of spectra to evaluate per pass.

mod alias;
mod instances;
mod light_grid;
mod lights;
mod materials;
mod placed_lights;
mod primitives;
mod profiles;
mod ranks;
mod rows;
mod targets;
mod textures;

pub use placed_lights::light_grid_pays;
pub use ranks::ranks;
pub use rows::SpectrumRow;
pub use targets::targets;

use crate::error::{Error, Result};
use crate::gpu::layout::{Interior, NO_INDEX};
use crate::gpu::{Gpu, Resource};
use crate::scene::{Scene, bounds_of_all};
use crate::spectrum::Spectrum;
use crate::stage::{self, Stage};
use glam::DVec3;
use ranks::rank;
use rows::Rows;
use textures::Textures;

/// The scene on the GPU.
#[derive(Debug)]
pub struct GpuScene {
    /// Named tables and buffers, as the shaders call them.
    pub resources: Vec<(&'static str, Resource)>,
    /// Rows of the spectral table, in order.
    pub rows: Vec<SpectrumRow>,
    /// What the shaders call the scene's sizes.
    pub constants: String,
    /// Subtracted from world positions: the middle of the scene.
    pub origin: DVec3,
    /// Power of all lights, mean over the film's range, W nm^-1.
    pub power: f64,
    /// Records of lights; a mesh has one for each triangle.
    pub lights: usize,
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
        let targets = targets::build(scene, origin, guiding);
        stage::enter(Stage::Uploading);
        let resources = vec![
            ("bvh", gpu.table("BVH nodes", &geometry.nodes)?),
            ("primitives", gpu.table("primitives", &geometry.primitives)?),
            ("instances", gpu.table("instances", &geometry.instances.table)?),
            ("normals", gpu.table("shading normals", &geometry.normals)?),
            ("materials", gpu.table("materials", &materials)?),
            ("interiors", gpu.table("volumes", &interiors)?),
            ("lights", gpu.table("lights", &records)?),
            ("light_grid", gpu.table("grid of lights", &lights.grid.texels)?),
            ("tables", gpu.storage("energy tables", &tables)?),
            ("targets", gpu.table("targets of light paths", &targets)?),
            ("environment", gpu.table("environment picture", &lights.environment)?),
            ("profiles", gpu.table("profiles of lamps", &lights.profiles)?),
            ("textures", gpu.table("textures", &textures)?),
        ];
        let bytes = resources.iter().map(|(_, r)| r.size()).sum();
        let constants = format!(
            "const BVH_STACK = {}u;\nconst LIGHTS = {}u;\nconst FIRST_DISTANT_LIGHT = {}u;\nconst ENVIRONMENT_LIGHT = {}u;\nconst TARGETS = {}u;\nconst FIRST_UV = {first_uv}u;\nconst FIRST_INSTANCED = {}u;\nconst FIRST_OWNER = {}u;\nconst NEAR_LIGHTS = {}u;\nconst NEAR_SHARE = {:?};\n{}",
            geometry.stack,
            records.len(),
            lights.first_distant,
            lights.environment_light,
            targets.len(),
            geometry.instances.first_number,
            geometry.instances.first_owner,
            lights.first_distant,
            lights.near_share as f32,
            lights.grid.constants,
        );
        let power = lights.power;
        Ok(Self { resources, power, lights: records.len(), rows: rows.all, constants, origin, bytes })
    }
}

fn interiors(scene: &Scene, rows: &mut Rows) -> Vec<Interior> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let mut coefficient = |s: &Spectrum| if s.is_zero() { NO_INDEX } else { rows.spectrum(s) };
    let media: Vec<_> = scene.interiors.iter().map(|i| (coefficient(&i.sigma_a), coefficient(&i.sigma_s))).collect();
    scene
        .interiors
        .iter()
        .zip(media)
        .enumerate()
        .map(|(index, (i, (sigma_a_row, sigma_s_row)))| Interior {
            eta_row: rows.add(SpectrumRow::Ior(i.ior.clone())),
            sigma_a_row,
            sigma_s_row,
            dispersive: u32::from(!i.ior.is_constant_over(lo, hi)),
            g: i.g as f32,
            rank: rank(scene, index),
            ..Default::default()
        })
        .collect()
}
