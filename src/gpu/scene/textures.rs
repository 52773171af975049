//! Pictures on surfaces as one table: a record for each, texture coordinates of all primitives, and then the texels.

use super::primitives::Primitives;
use super::rows::{Rows, SpectrumRow};
use crate::gpu::layout::{NO_INDEX, Texture};
use crate::scene::texture::{Image, ImageTexture, Wrap};
use crate::scene::{self, Geometry, Mesh, Scene};
use glam::Vec4;
use std::collections::HashMap;
use std::sync::Arc;

/// Pictures in use, each texture and each of their images once.
#[derive(Default)]
pub(super) struct Textures {
    records: Vec<Texture>,
    images: Vec<Arc<Image>>,
    /// First texel of each image, from the first of all.
    starts: HashMap<*const Image, u32>,
    texels: u32,
    known: HashMap<*const ImageTexture, u32>,
}

impl Textures {
    /// Row of a texture's spectrum where it is the same everywhere, or of what its texels are multiplied by; and the index of its picture or NO_INDEX.
    pub(super) fn add(&mut self, texture: &scene::Texture, rows: &mut Rows) -> (u32, u32) {
        let row = rows.spectrum(texture.shape());
        let index = texture.image().map_or(NO_INDEX, |image| {
            *self.known.entry(Arc::as_ptr(image)).or_insert_with(|| {
                let first = *self.starts.entry(Arc::as_ptr(&image.image)).or_insert_with(|| {
                    let first = self.texels;
                    self.texels += image.image.texels.len() as u32;
                    self.images.push(image.image.clone());
                    first
                });
                self.records.push(record(image, first, row, rows.add(SpectrumRow::UpsamplingCoordinate)));
                self.records.len() as u32 - 1
            })
        });
        (row, index)
    }

    /// The table, and where in it the texture coordinates begin: two vec4s for each primitive.
    pub(super) fn build(mut self, scene: &Scene, geometry: &Primitives) -> (Vec<Vec4>, usize) {
        if self.records.is_empty() {
            return (Vec::new(), 0);
        }
        let first_uv = self.records.len() * size_of::<Texture>() / size_of::<Vec4>();
        let first_texel = first_uv + 2 * (geometry.primitives.len() / 3);
        self.records.iter_mut().for_each(|r| r.first_texel += first_texel as u32);
        let mut table: Vec<Vec4> = bytemuck::cast_slice(&self.records).to_vec();
        table.resize(first_texel, Vec4::ZERO);
        let mut put = |mesh: &Mesh, places: &[u32]| {
            for (t, &place) in places.iter().enumerate().take(mesh.triangles.len()) {
                let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|corner| mesh.uv(t, corner).as_vec2());
                let at = first_uv + 2 * place as usize;
                table[at] = Vec4::new(a.x, a.y, b.x, b.y);
                table[at + 1] = Vec4::new(c.x, c.y, 0.0, 0.0);
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
        table.extend(self.images.iter().flat_map(|image| &image.texels).map(|t| Vec4::from_array(*t)));
        (table, first_uv)
    }
}

fn record(texture: &ImageTexture, first_texel: u32, factor_row: u32, x_row: u32) -> Texture {
    let [u, v] = texture.to_image.map(|[a, b, c]| Vec4::new(a as f32, b as f32, c as f32, 0.0));
    let wrap = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    Texture {
        first_texel,
        width: texture.image.width,
        height: texture.image.height,
        sampling: wrap[0] | wrap[1] << 2 | u32::from(texture.nearest) << 4,
        factor_row,
        x_row,
        cutoff: texture.cutoff.map_or(f32::NEG_INFINITY, |c| c as f32),
        has_cutoff: u32::from(texture.cutoff.is_some()),
        u,
        v,
    }
}
