//! The scene as buffers: primitives in BVH order, materials, volumes, lights, tables, and the list of spectra to evaluate per pass.

mod alias;
mod instances;
mod light_grid;
mod lights;
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

use crate::bsdf::energy::EnergyTable;
use crate::error::{Error, Result};
use crate::gpu::layout::{self, Interior, Material, NO_INDEX};
use crate::gpu::{Gpu, Resource};
use crate::scene::{self, Scene, bounds_of_all};
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
        let mut tables = Tables::default();
        let mut textures = Textures::default();
        let mut materials = materials(scene, &mut rows, &mut textures, &mut tables);
        for (&material, film) in &scene.films {
            materials[material].c = film_rows(film, &mut rows)?;
        }
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
            ("tables", gpu.storage("energy tables", &tables.entries)?),
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

fn film_rows(film: &scene::Film, rows: &mut Rows) -> Result<u32> {
    let [index, waves] = [SpectrumRow::Ior(film.ior.clone()), SpectrumRow::Waves(film.thickness_nm)].map(|row| rows.add(row));
    if index.max(waves) > 0xffff {
        return Err(Error::usage("the scene has too many spectra for its thin films", "share materials between shapes"));
    }
    Ok(index | waves << 16)
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

fn interior_index(interior: Option<usize>) -> u32 {
    interior.map_or(NO_INDEX, |i| i as u32)
}

/// Energy tables one after another.
#[derive(Default)]
struct Tables {
    entries: Vec<f32>,
    /// What was made already, and its first entry.
    made: Vec<(Table, u32)>,
}

/// A table, of a GGX width.
#[derive(Clone, Copy, PartialEq)]
enum Table {
    Dielectric(f64),
    Coat(f64),
    Conductor(f64),
    /// And of a grain.
    Brushed(f64, scene::Grain),
}

impl Table {
    fn entries(self) -> Vec<f64> {
        let flat = |table: EnergyTable| [table.missing, table.mean].concat();
        match self {
            Table::Dielectric(alpha) => flat(EnergyTable::dielectric(alpha)),
            Table::Coat(alpha) => flat(EnergyTable::coat(alpha)),
            Table::Conductor(alpha) => flat(EnergyTable::conductor(alpha)),
            Table::Brushed(alpha, grain) => {
                let (width, (sin, cos)) = (grain.width(alpha), grain.rotation.sin_cos());
                [flat(EnergyTable::brushed(width)), vec![width.x, cos, sin]].concat()
            }
        }
    }
}

impl Tables {
    /// The first entry of this table, which is made once.
    fn add(&mut self, table: Table) -> u32 {
        if let Some((_, at)) = self.made.iter().find(|(made, _)| *made == table) {
            return *at;
        }
        let at = self.append(&table.entries());
        self.made.push((table, at));
        at
    }

    fn append(&mut self, entries: &[f64]) -> u32 {
        let at = self.entries.len() as u32;
        self.entries.extend(entries.iter().map(|&x| x as f32));
        at
    }

    /// `metal` with its kind, width and table.
    fn of_metal(&mut self, metal: Material, alpha: f64, grain: Option<&scene::Grain>) -> Material {
        let (kind, table) = match grain {
            _ if alpha == 0.0 => return Material { kind: layout::MATERIAL_KIND_SMOOTH_CONDUCTOR, ..metal },
            Some(grain) => (layout::MATERIAL_KIND_BRUSHED_CONDUCTOR, Table::Brushed(alpha, *grain)),
            None => (layout::MATERIAL_KIND_ROUGH_CONDUCTOR, Table::Conductor(alpha)),
        };
        Material { kind, alpha: alpha as f32, table: self.add(table), ..metal }
    }
}

fn materials(scene: &Scene, rows: &mut Rows, textures: &mut Textures, tables: &mut Tables) -> Vec<Material> {
    let none = Material { interior: NO_INDEX, texture: NO_INDEX, ..Default::default() };
    scene
        .materials
        .iter()
        .enumerate()
        .map(|(index, m)| match m {
            scene::Material::Diffuse { reflectance } => {
                let (a, texture) = textures.add(reflectance, rows);
                Material { kind: layout::MATERIAL_KIND_DIFFUSE, a, texture, ..none }
            }
            scene::Material::Dielectric { interior, alpha } if *alpha == 0.0 => {
                Material { kind: layout::MATERIAL_KIND_SMOOTH_DIELECTRIC, interior: *interior as u32, ..none }
            }
            scene::Material::Dielectric { interior, alpha } => Material {
                kind: layout::MATERIAL_KIND_ROUGH_DIELECTRIC,
                interior: *interior as u32,
                alpha: *alpha as f32,
                table: tables.add(Table::Dielectric(*alpha)),
                ..none
            },
            scene::Material::ThinDielectric { ior } => {
                Material { kind: layout::MATERIAL_KIND_THIN_DIELECTRIC, a: rows.add(SpectrumRow::Ior(ior.clone())), ..none }
            }
            scene::Material::Conductor { eta, k, alpha } => {
                let (a, b) = (rows.spectrum(eta), rows.spectrum(k));
                tables.of_metal(Material { a, b, ..none }, *alpha, scene.grains.get(&index))
            }
            scene::Material::ColoredConductor { reflectance, alpha } => {
                let (a, texture) = textures.add(reflectance, rows);
                tables.of_metal(Material { a, texture, b: NO_INDEX, ..none }, *alpha, scene.grains.get(&index))
            }
            scene::Material::Graded { first, levels, roughness } => {
                let (a, texture) = textures.add(roughness, rows);
                // Level 0 need not be there: the index wraps around, and back.
                let b = (*first as u32).wrapping_sub(levels.start as u32);
                let c = levels.start as u32 | (levels.end as u32 - 1) << 16;
                let interior = interior_index(scene.interior_of(*first));
                Material { kind: layout::MATERIAL_KIND_GRADED, interior, a, b, c, texture, ..none }
            }
            scene::Material::Coated { base, ior, alpha } => Material {
                kind: layout::MATERIAL_KIND_COATED,
                a: rows.add(SpectrumRow::Ior(ior.clone())),
                b: *base as u32,
                alpha: *alpha as f32,
                table: tables.add(Table::Coat(*alpha)),
                ..none
            },
            scene::Material::Sheen { base, color, alpha } => Material {
                kind: layout::MATERIAL_KIND_SHEEN,
                a: rows.spectrum(color),
                b: *base as u32,
                table: tables.append(&scene.sheen(color, *alpha).entries()),
                ..none
            },
            scene::Material::Mix { a, b, weight } => {
                let (b, c, (a, texture)) = (*a as u32, *b as u32, textures.add(weight, rows));
                Material { kind: layout::MATERIAL_KIND_MIX, a, b, c, texture, ..none }
            }
            scene::Material::NormalMapped { base, normals } => {
                let (_, texture) = textures.add(&scene::Texture::Image(normals.clone()), rows);
                let interior = interior_index(scene.interior_of(*base));
                Material { kind: layout::MATERIAL_KIND_NORMAL_MAPPED, interior, b: *base as u32, texture, ..none }
            }
            scene::Material::Boundary { interior } => {
                Material { kind: layout::MATERIAL_KIND_BOUNDARY, interior: interior_index(*interior), ..none }
            }
        })
        .collect()
}
