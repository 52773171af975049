//! Pictures on surfaces as one table: a record for each, texture coordinates of all primitives, and then the texels.

use super::primitives::Primitives;
use super::rows::{Rows, SpectrumRow};
use crate::gpu::layout::{self, NO_INDEX, Texture};
use crate::scene::texture::{ImageTexture, Packed, Spectra, Texels, Wrap, coordinate_texels, coordinates_of};
use crate::scene::{self, Geometry, Mesh, Scene};
use glam::{DVec2, Vec4};
use std::collections::HashMap;
use std::sync::Arc;

/// Pictures in use, each texture and each of what their images are stored in once.
#[derive(Default)]
pub(super) struct Textures {
    records: Vec<Texture>,
    parts: Vec<Part>,
    /// First texel of each part, from the first of all.
    starts: HashMap<*const u8, u32>,
    texels: u32,
    known: HashMap<*const ImageTexture, u32>,
}

/// What images are stored in.
enum Part {
    Packed(Arc<Packed>),
    Colors(Arc<[[f32; 4]]>),
    Spectra(Arc<Spectra>),
}

impl Part {
    fn bytes(&self) -> &[u8] {
        match self {
            Part::Packed(packed) => packed.bytes(),
            Part::Colors(table) => bytemuck::cast_slice(table),
            Part::Spectra(spectra) => bytemuck::cast_slice(spectra.values()),
        }
    }

    fn texels(&self) -> usize {
        match self {
            Part::Spectra(spectra) => spectra.values().len() / spectra.channels() * spectra.stride(),
            part => part.bytes().len().div_ceil(size_of::<Vec4>()),
        }
    }

    fn append(&self, table: &mut Vec<Vec4>) {
        match self {
            Part::Spectra(spectra) => table.extend(spectra.padded().map(Vec4::from_array)),
            part => {
                let first = table.len();
                table.resize(first + part.texels(), Vec4::ZERO);
                bytemuck::cast_slice_mut(&mut table[first..])[..part.bytes().len()].copy_from_slice(part.bytes());
            }
        }
    }
}

impl Textures {
    /// Row of a texture's spectrum where it is the same everywhere, or of what its texels are multiplied by; and the index of its picture or NO_INDEX.
    pub(super) fn add(&mut self, texture: &scene::Texture, rows: &mut Rows) -> (u32, u32) {
        let row = rows.spectrum(texture.shape());
        let Some(image) = texture.image() else { return (row, NO_INDEX) };
        if let Some(&known) = self.known.get(&Arc::as_ptr(image)) {
            return (row, known);
        }
        let texels = &image.image.texels;
        let (form, scale, stored) = match texels {
            Texels::Numbers { stored, scale } => (layout::TEXELS_NUMBERS, *scale, Part::Packed(stored.clone())),
            Texels::Vectors { stored, scale } => (layout::TEXELS_VECTORS, *scale, Part::Packed(stored.clone())),
            Texels::Colors { stored, .. } => (layout::TEXELS_COLORS, 1.0, Part::Packed(stored.clone())),
            Texels::Sigmoids { stored } => (layout::TEXELS_SIGMOIDS, 1.0, Part::Packed(stored.clone())),
            Texels::Spectra { stored, .. } => (layout::TEXELS_SPECTRA, 1.0, Part::Spectra(stored.clone())),
        };
        let size = if let Part::Packed(packed) = &stored { packed.size() } else { size_of::<Vec4>() };
        let x_row = match texels {
            Texels::Spectra { stored, hold } => SpectrumRow::Channel(stored.clone(), *hold),
            _ => SpectrumRow::UpsamplingCoordinate,
        };
        let first_color = match texels {
            Texels::Colors { table, .. } => self.start(Part::Colors(table.clone())),
            Texels::Spectra { stored, .. } => stored.stride() as u32,
            _ => 0,
        };
        let sampling = sampling_of(image) | form << 6 | (size.ilog2() & 3) << 9;
        let (first_texel, x_row) = (self.start(stored), rows.add(x_row));
        self.records.push(Texture { first_texel, first_color, sampling, factor_row: row, x_row, ..record(image, scale) });
        let index = self.records.len() as u32 - 1;
        self.known.insert(Arc::as_ptr(image), index);
        (row, index)
    }

    /// First texel of a part, from the first of all.
    fn start(&mut self, part: Part) -> u32 {
        *self.starts.entry(part.bytes().as_ptr()).or_insert_with(|| {
            let first = self.texels;
            self.texels += part.texels() as u32;
            self.parts.push(part);
            first
        })
    }

    /// The table, and where in it the texture coordinates begin, which are followed by the colours of vertices where pictures are tinted by them.
    pub(super) fn build(mut self, scene: &Scene, geometry: &Primitives) -> (Vec<Vec4>, usize) {
        if self.records.is_empty() {
            return (Vec::new(), 0);
        }
        let first_uv = self.records.len() * size_of::<Texture>() / size_of::<Vec4>();
        let (sets, tinted) = coordinates_of(scene);
        let stride = coordinate_texels((sets, tinted));
        let first_texel = first_uv + stride * (geometry.primitives.len() / 3);
        for record in &mut self.records {
            record.first_texel += first_texel as u32;
            if (record.sampling >> 6 & 7) == layout::TEXELS_COLORS {
                record.first_color += first_texel as u32;
            }
        }
        let mut table: Vec<Vec4> = bytemuck::cast_slice(&self.records).to_vec();
        table.resize(first_texel, Vec4::ZERO);
        let mut put = |mesh: &Mesh, places: &[u32]| {
            for (t, &place) in places.iter().enumerate().take(mesh.triangles.len()) {
                let at = first_uv + stride * place as usize;
                for set in 0..sets {
                    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|corner| mesh.uv(t, set, corner));
                    // Far coordinates have few digits in single precision: their whole part is apart.
                    let whole = corners.into_iter().reduce(DVec2::min).map_or(DVec2::ZERO, DVec2::floor);
                    let [a, b, c] = corners.map(|corner| (corner - whole).as_vec2());
                    table[at + 2 * set] = Vec4::new(a.x, a.y, b.x, b.y);
                    table[at + 2 * set + 1] = Vec4::new(c.x, c.y, whole.x as f32, whole.y as f32);
                }
                if tinted {
                    table[at + 2 * sets..at + stride]
                        .copy_from_slice(&mesh.coordinates(t, [0.0; 2]).colors.map(Vec4::from_array));
                }
            }
        };
        let mut places = geometry.place.as_slice();
        for shape in &scene.shapes {
            let count = if let Geometry::Mesh(mesh) = &shape.geometry {
                put(mesh, places);
                mesh.triangles.len()
            } else {
                1
            };
            places = &places[count..];
        }
        geometry.instances.meshes.iter().for_each(|(mesh, places)| put(mesh, places));
        table.reserve_exact(self.texels as usize);
        self.parts.iter().for_each(|part| part.append(&mut table));
        (table, first_uv)
    }
}

/// Where the picture lies on a surface; what repeats or mirrors moves by its period at most.
fn record(texture: &ImageTexture, scale: f64) -> Texture {
    let [u, v] = std::array::from_fn(|i| {
        let [a, b, c] = texture.to_image[i];
        let c = if texture.wrap[i] == Wrap::Clamp { c } else { c.rem_euclid(2.0) };
        Vec4::new(a as f32, b as f32, c as f32, scale as f32)
    });
    let cutoff = texture.cutoff.map_or(0.0, |c| c as f32);
    Texture { width: texture.image.width, height: texture.image.height, cutoff, u, v, ..Default::default() }
}

fn sampling_of(texture: &ImageTexture) -> u32 {
    let wrap = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    wrap[0]
        | wrap[1] << 2
        | u32::from(texture.nearest) << 4
        | u32::from(texture.cutoff.is_some()) << 5
        | (texture.set as u32) << 11
        | u32::from(texture.tinted) << 12
}
