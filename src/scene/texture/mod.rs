//! Spectra that vary over a surface: pictures whose colours are made into spectra once, texel by texel, when they are read.
//!
//! A colour is the coefficients of a sigmoid ([`crate::spectrum::sigmoid`]) and a factor. Between texels it is the spectra that are interpolated, not their
//! coefficients, so that what is seen from afar is the mean of what is seen from near.

mod cmyk;
pub(in crate::scene) mod decode;
mod exr;
pub(in crate::scene) mod image;
pub(in crate::scene) mod picture;
mod space;
mod texels;

pub use texels::{Image, Packed, Spectra, Texels, channel_at, pack_sigmoid, unpack_sigmoid};

use crate::geometry::Coordinates;
use crate::scene::{Geometry, Material, Mesh, Scene};
use crate::spectrum::{Spectrum, sigmoid};
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::sync::Arc;

/// A spectrum that may vary over a surface.
#[derive(Debug, Clone)]
pub enum Texture {
    /// The same everywhere.
    Uniform(Spectrum),
    /// A picture, placed by the surface's texture coordinates.
    Image(Arc<ImageTexture>),
}

/// A picture on a surface.
#[derive(Debug, Clone)]
pub struct ImageTexture {
    /// Its texels.
    pub image: Arc<Image>,
    /// What lies beside the picture, across and down.
    pub wrap: [Wrap; 2],
    /// The nearest texel alone instead of a bilinear mean of four.
    pub nearest: bool,
    /// From a surface's (u, v, 1) to the picture's coordinates, both with (0, 0) at the upper left corner and (1, 1) at the lower right.
    pub to_image: [[f64; 3]; 2],
    /// What texels are multiplied by: 1, or for light its white.
    pub factor: Spectrum,
    /// Filtered values from here on count as 1, those below as 0.
    pub cutoff: Option<f64>,
    /// Which set of a mesh's texture coordinates places it.
    pub set: usize,
    /// Is it multiplied by the colours of the mesh's vertices?
    pub tinted: bool,
}

/// What lies beside a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// Its mirror image.
    Mirror,
    /// Its edge.
    Clamp,
}

/// Texels that an average looks at, at most.
const AVERAGED: usize = 4096;

impl From<Spectrum> for Texture {
    fn from(spectrum: Spectrum) -> Self {
        Texture::Uniform(spectrum)
    }
}

impl Texture {
    /// Value at `nm` and these coordinates of a surface.
    pub fn eval(&self, nm: f64, at: impl Into<Coordinates>) -> f64 {
        match self {
            Texture::Uniform(spectrum) => spectrum.eval(nm),
            Texture::Image(texture) => texture.eval(nm, &at.into()),
        }
    }

    /// True if it is 0 everywhere.
    pub fn is_zero(&self) -> bool {
        match self {
            Texture::Uniform(spectrum) => spectrum.is_zero(),
            Texture::Image(texture) => texture.factor.is_zero() || texture.image.range()[1] == 0.0,
        }
    }

    /// The mean over the whole picture (4096 texels of it at most) at `nm`, whatever of it a surface shows.
    pub fn average(&self, nm: f64) -> f64 {
        match self {
            Texture::Uniform(spectrum) => spectrum.eval(nm),
            Texture::Image(texture) => texture.average(nm),
        }
    }

    /// Mean of [`Texture::average`] over `[lo, hi]` nm; for pictures from eight wavelengths.
    pub fn mean(&self, lo: f64, hi: f64) -> f64 {
        match self {
            Texture::Uniform(spectrum) => spectrum.mean(lo, hi),
            Texture::Image(texture) => {
                (0..8).map(|i| texture.average(lo + (hi - lo) * (f64::from(i) + 0.5) / 8.0)).sum::<f64>() / 8.0
            }
        }
    }

    /// The spectrum whose breakpoints and lines matter where wavelengths are chosen.
    pub fn shape(&self) -> &Spectrum {
        match self {
            Texture::Uniform(spectrum) => spectrum,
            Texture::Image(texture) => &texture.factor,
        }
    }

    /// The picture, if it is one.
    pub fn image(&self) -> Option<&Arc<ImageTexture>> {
        match self {
            Texture::Uniform(_) => None,
            Texture::Image(texture) => Some(texture),
        }
    }
}

impl ImageTexture {
    /// The mean of `value` over the texels around `uv`, by their weights.
    fn filtered(&self, uv: DVec2, value: impl Fn(usize) -> f64) -> f64 {
        let [u, v] = self.to_image.map(|[a, b, c]| a * uv.x + b * uv.y + c);
        let (width, height) = (self.image.width, self.image.height);
        let texel = |column: u32, row: u32| value(row as usize * width as usize + column as usize);
        if self.nearest {
            let (columns, rows) = (self.wrap[0].around(u, width, 0.0), self.wrap[1].around(v, height, 0.0));
            return texel(columns.0[0], rows.0[0]);
        }
        let ((columns, s), (rows, t)) = (self.wrap[0].around(u, width, 0.5), self.wrap[1].around(v, height, 0.5));
        let row = |r: u32| (1.0 - s) * texel(columns[0], r) + s * texel(columns[1], r);
        (1.0 - t) * row(rows[0]) + t * row(rows[1])
    }

    /// The first three numbers of texels at `uv`, for pictures of vectors.
    pub fn vector(&self, uv: DVec2) -> [f64; 3] {
        std::array::from_fn(|i| self.filtered(uv, |texel| self.image.vector(texel)[i]))
    }

    fn eval(&self, nm: f64, at: &Coordinates) -> f64 {
        let value = self.filtered(at.uv[self.set], |texel| self.image.eval(texel, nm));
        let value = self.cutoff.map_or(value, |cutoff| f64::from(u8::from(value >= cutoff)));
        let of_vertex = |c: &[f32; 4]| f64::from(c[3]) * sigmoid(&[c[0], c[1], c[2]].map(f64::from), nm);
        let tint = match self.tinted {
            true => at.colors.iter().zip(at.shares).map(|(c, share)| share * of_vertex(c)).sum(),
            false => 1.0,
        };
        value * self.factor.eval(nm) * tint
    }

    fn average(&self, nm: f64) -> f64 {
        let count = self.image.count();
        let seen = count.min(AVERAGED);
        let value = |i: usize| {
            let value = self.image.eval(i * count / seen, nm);
            self.cutoff.map_or(value, |cutoff| f64::from(u8::from(value >= cutoff)))
        };
        (0..seen).map(value).sum::<f64>() / seen as f64 * self.factor.eval(nm)
    }
}

impl Wrap {
    /// The two texels around `x` (1 being the size of the picture, texels being centred at `centre`), and the share of the second.
    fn around(self, x: f64, size: u32, centre: f64) -> ([u32; 2], f64) {
        let n = i64::from(size);
        let x = match self {
            Wrap::Repeat => x - x.floor(),
            Wrap::Mirror => x - 2.0 * (0.5 * x).floor(),
            Wrap::Clamp => x.clamp(0.0, 1.0),
        };
        let at = x * f64::from(size) - centre;
        let first = at.floor() as i64;
        let wrapped = |i: i64| {
            let i = match self {
                Wrap::Repeat => i.rem_euclid(n),
                Wrap::Mirror => i.rem_euclid(2 * n).min(2 * n - 1 - i.rem_euclid(2 * n)),
                Wrap::Clamp => i.clamp(0, n - 1),
            };
            i as u32
        };
        ([wrapped(first), wrapped(first + 1)], at - at.floor())
    }
}

impl Mesh {
    /// The unit shading normal `ns` (on the outer side) turned as `normals` says at these coordinates of triangle `t`, whose outer normal is `ng`. The tangent is
    /// the mesh's at the point `p` or, where it has none, that of the triangle, made perpendicular to `ns`. A normal that would look inwards is not turned.
    pub fn mapped_normal(
        &self,
        t: usize,
        p: DVec3,
        at: impl Into<Coordinates>,
        ng: DVec3,
        ns: DVec3,
        normals: &ImageTexture,
    ) -> DVec3 {
        let own = self.tangent(t, p);
        let (along_u, along_v, _) = self.directions_of_picture(t, normals.set);
        let has_own = own.truncate() != DVec3::ZERO;
        let along = if has_own { own.truncate() } else { along_u };
        let tangent = (along - ns * ns.dot(along)).normalize_or_zero();
        let up = ns.cross(tangent);
        let up = if has_own {
            up * own.w
        } else if up.dot(along_v) > 0.0 {
            -up
        } else {
            up
        };
        let [x, y, z] = normals.vector(at.into().uv[normals.set]);
        let turned = (tangent * x + up * y + ns * z).normalize_or_zero();
        if tangent != DVec3::ZERO && turned.dot(ng) > 0.0 { turned } else { ns }
    }
}

/// The pictures on a scene's surfaces: those of materials, then those of lamps.
pub fn of_scene(scene: &Scene) -> impl Iterator<Item = &Arc<ImageTexture>> {
    let of_materials = scene.materials.iter().filter_map(Material::image);
    of_materials.chain(scene.shapes.iter().filter_map(|s| s.emission.as_ref()?.radiance.image()))
}

/// Sets of texture coordinates that a scene's pictures lie on, and whether some are tinted by the colours of vertices.
pub fn coordinates_of(scene: &Scene) -> (usize, bool) {
    (1 + of_scene(scene).map(|texture| texture.set).max().unwrap_or(0), of_scene(scene).any(|texture| texture.tinted))
}

/// Texels of a table, of four numbers each, that a primitive's coordinates take: two for each set, and one for the colour of each vertex.
pub fn coordinate_texels((sets, tinted): (usize, bool)) -> usize {
    2 * sets + if tinted { 3 } else { 0 }
}

/// Bytes of all pictures on a scene's surfaces as an adapter holds them: texels and tables of colours, each once, and texture coordinates.
pub fn bytes(scene: &Scene) -> u64 {
    let mut parts: HashMap<*const u8, usize> = HashMap::new();
    for texture in of_scene(scene) {
        let mut add = |at: *const u8, bytes: usize| parts.insert(at, bytes.next_multiple_of(16));
        match &texture.image.texels {
            Texels::Numbers { stored, .. } | Texels::Vectors { stored, .. } | Texels::Sigmoids { stored } => {
                add(stored.bytes().as_ptr(), stored.bytes().len());
            }
            Texels::Colors { stored, table } => {
                add(stored.bytes().as_ptr(), stored.bytes().len());
                add(table.as_ptr().cast(), size_of_val(&**table));
            }
            Texels::Spectra { stored, .. } => {
                add(stored.values().as_ptr().cast(), 16 * stored.stride() * texture.image.count());
            }
        }
    }
    if parts.is_empty() {
        return 0;
    }
    // Texture coordinates of every primitive, those of shared meshes once.
    let mut shared: HashMap<*const Mesh, usize> = HashMap::new();
    let mut count = 0;
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Mesh(mesh) => count += mesh.triangles.len(),
            Geometry::Instance(instance) => {
                shared.insert(Arc::as_ptr(instance.mesh()), instance.mesh().triangles.len());
            }
            _ => count += 1,
        }
    }
    (parts.values().sum::<usize>() + 16 * coordinate_texels(coordinates_of(scene)) * (count + shared.values().sum::<usize>()))
        as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_wrap_mirror_and_stop_at_the_edge() {
        assert_eq!(Wrap::Repeat.around(-0.25, 4, 0.5).0, [2, 3]);
        assert_eq!(Wrap::Repeat.around(0.0, 4, 0.5), ([3, 0], 0.5));
        assert_eq!(Wrap::Mirror.around(0.0, 4, 0.5), ([0, 0], 0.5));
        assert_eq!(Wrap::Mirror.around(1.375, 4, 0.5), ([2, 1], 0.0));
        assert_eq!(Wrap::Clamp.around(7.0, 4, 0.5), ([3, 3], 0.5));
    }
}
