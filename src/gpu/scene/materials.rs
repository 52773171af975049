//! Materials as records, with the tables of what they reflect in all.

use super::ranks::ranks;
use super::rows::{Rows, SpectrumRow};
use super::textures::Textures;
use crate::bsdf::energy::{EnergyTable, Facets};
use crate::error::{Error, Result};
use crate::gpu::layout::{self, Material, NO_INDEX};
use crate::scene::{self, CoatNormals, Scene};

/// The record of every material, and the tables that they refer to.
pub(super) fn build(scene: &Scene, rows: &mut Rows, textures: &mut Textures) -> Result<(Vec<Material>, Vec<f32>)> {
    let mut tables = Tables::default();
    let ranks = ranks(scene);
    let interior_index = |interior: Option<usize>| interior.map_or(NO_INDEX, |i| ranks[i]);
    let none = Material { interior: NO_INDEX, texture: NO_INDEX, ..Default::default() };
    let mut materials: Vec<Material> = scene
        .materials
        .iter()
        .enumerate()
        .map(|(index, m)| match m {
            scene::Material::Diffuse { reflectance } => {
                let (a, texture) = textures.add(reflectance, rows);
                Material { kind: layout::MATERIAL_KIND_DIFFUSE, a, texture, ..none }
            }
            scene::Material::DiffuseTransmission { transmittance } => {
                let (a, texture) = textures.add(transmittance, rows);
                Material { kind: layout::MATERIAL_KIND_DIFFUSE_TRANSMISSION, a, texture, ..none }
            }
            scene::Material::Dielectric { interior, alpha, tint, antireflective } => {
                let (b, texture) = tint.as_ref().map_or((NO_INDEX, NO_INDEX), |tint| textures.add(tint, rows));
                let glass = Material { interior: ranks[*interior], a: u32::from(*antireflective), b, texture, ..none };
                if *alpha == 0.0 {
                    return Material { kind: layout::MATERIAL_KIND_SMOOTH_DIELECTRIC, ..glass };
                }
                let table = tables.add(Facets::Glass { alpha: *alpha, coated: *antireflective }, None);
                Material { kind: layout::MATERIAL_KIND_ROUGH_DIELECTRIC, alpha: *alpha as f32, table, ..glass }
            }
            scene::Material::ThinDielectric { ior, alpha, tint, depth } => {
                let (b, texture) = tint.as_ref().map_or((NO_INDEX, NO_INDEX), |tint| textures.add(tint, rows));
                let c = if depth.is_zero() { 0 } else { rows.spectrum(depth) };
                let pane = Material { a: rows.add(SpectrumRow::Ior(ior.clone())), b, c, texture, ..none };
                tables.of_facets(pane, &PANES, *alpha, scene.grains.get(&index))
            }
            scene::Material::Conductor { eta, k, alpha } => {
                let (a, b) = (rows.spectrum(eta), rows.spectrum(k));
                tables.of_facets(Material { a, b, ..none }, &METALS, *alpha, scene.grains.get(&index))
            }
            scene::Material::ColoredConductor { reflectance, alpha } => {
                let (a, texture) = textures.add(reflectance, rows);
                tables.of_facets(Material { a, texture, b: NO_INDEX, ..none }, &METALS, *alpha, scene.grains.get(&index))
            }
            scene::Material::Graded { materials, levels, roughness } => {
                let (a, texture) = textures.add(roughness, rows);
                let table = tables.append(&materials.iter().map(|&m| m as f64).collect::<Vec<_>>());
                let c = levels.start as u32 | (levels.end as u32 - 1) << 16;
                let interior = interior_index(scene.interior_of(index));
                Material { kind: layout::MATERIAL_KIND_GRADED, interior, a, c, table, texture, ..none }
            }
            scene::Material::Coated { base, ior, alpha, seen, normals } => {
                let normals = match normals {
                    CoatNormals::OfBase => 0,
                    CoatNormals::OfShape => 1,
                    CoatNormals::Mapped(normals) => 2 + textures.add(&scene::Texture::Image(normals.clone()), rows).1,
                };
                Material {
                    kind: layout::MATERIAL_KIND_COATED,
                    a: rows.add(SpectrumRow::Ior(ior.clone())),
                    b: *base as u32,
                    c: u32::from(*seen) | normals << 1,
                    alpha: *alpha as f32,
                    table: tables.add(Facets::Coat { alpha: *alpha }, None),
                    ..none
                }
            }
            scene::Material::Sheen { base, color, alpha } => Material {
                kind: layout::MATERIAL_KIND_SHEEN,
                a: rows.spectrum(color),
                b: *base as u32,
                table: tables.append(&scene.sheen(color, *alpha).entries()),
                ..none
            },
            scene::Material::Mix { a, b, weight } => {
                let (b, c, (a, texture)) = (*a as u32, *b as u32, textures.add(weight, rows));
                let interior = interior_index(scene.interior_of(index));
                Material { kind: layout::MATERIAL_KIND_MIX, interior, a, b, c, texture, ..none }
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
        .collect();
    for (&material, film) in &scene.thin_films {
        materials[material].c = thin_film_rows(film, rows)?;
    }
    Ok((materials, tables.entries))
}

/// What of metal and of panes is smooth, rough and brushed.
const METALS: [u32; 3] =
    [layout::MATERIAL_KIND_SMOOTH_CONDUCTOR, layout::MATERIAL_KIND_ROUGH_CONDUCTOR, layout::MATERIAL_KIND_BRUSHED_CONDUCTOR];
const PANES: [u32; 3] = [
    layout::MATERIAL_KIND_THIN_DIELECTRIC,
    layout::MATERIAL_KIND_ROUGH_THIN_DIELECTRIC,
    layout::MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC,
];

fn thin_film_rows(film: &scene::ThinFilm, rows: &mut Rows) -> Result<u32> {
    let [index, waves] = [SpectrumRow::Ior(film.ior.clone()), SpectrumRow::Waves(film.thickness_nm)].map(|row| rows.add(row));
    if index.max(waves) > 0xffff {
        return Err(Error::usage("the scene has too many spectra for its thin films", "share materials between shapes"));
    }
    Ok(index | waves << 16)
}

/// Energy tables one after another.
#[derive(Default)]
struct Tables {
    entries: Vec<f32>,
    /// What was made already, since that takes long: missing and mean energy.
    made: Vec<(Facets, Vec<f64>)>,
    /// Of these facets, turned by the rotation of their grain, the first entry.
    placed: Vec<((Facets, Option<f64>), u32)>,
}

impl Tables {
    /// The first entry of the table of these facets, which is made once; behind it, if they have a grain, what is known of that.
    fn add(&mut self, facets: Facets, grain: Option<f64>) -> u32 {
        if let Some((_, at)) = self.placed.iter().find(|(placed, _)| *placed == (facets, grain)) {
            return *at;
        }
        let known = self.made.iter().position(|(made, _)| *made == facets).unwrap_or_else(|| {
            let table = EnergyTable::new(facets);
            self.made.push((facets, [table.missing, table.mean].concat()));
            self.made.len() - 1
        });
        let mut entries = self.made[known].1.clone();
        if let (Facets::Brushed { width }, Some(rotation)) = (facets, grain) {
            entries.extend([width.x, rotation.cos(), rotation.sin()]);
        }
        let at = self.append(&entries);
        self.placed.push(((facets, grain), at));
        at
    }

    fn append(&mut self, entries: &[f64]) -> u32 {
        let at = self.entries.len() as u32;
        self.entries.extend(entries.iter().map(|&x| x as f32));
        at
    }

    /// `mirror` with its kind (of `kinds`: smooth, rough, brushed), width and table.
    fn of_facets(&mut self, mirror: Material, kinds: &[u32; 3], alpha: f64, grain: Option<&scene::Grain>) -> Material {
        if alpha == 0.0 {
            return Material { kind: kinds[0], ..mirror };
        }
        let kind = kinds[if grain.is_some() { 2 } else { 1 }];
        let facets = Facets::of_mirror(alpha, grain.map(|grain| grain.width(alpha)));
        let table = self.add(facets, grain.map(|grain| grain.rotation));
        Material { kind, alpha: alpha as f32, table, ..mirror }
    }
}
