//! What a scene is made of.

use super::{FilmSettings, Grain, Light, Material, Sensor, Texture};
use crate::bsdf::sheen::Sheen;
use crate::bsdf::thin_film::Stack;
use crate::geometry::{Bounds, Geometry, bounds};
use crate::lens::Prescription;
use crate::spectrum::{Ior, Spectrum};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A complete scene.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Its name, for messages and file headers.
    pub name: String,
    /// Resolution, wavelength bins and filter.
    pub film: FilmSettings,
    /// What measures the light.
    pub sensor: Sensor,
    /// Materials; shapes and mixes refer to them by index.
    pub materials: Vec<Material>,
    /// Thin films on dielectrics, panes (on both their faces) and conductors, by the index of the material; on a pane of the film's own index, that it is
    /// itself a film.
    pub thin_films: BTreeMap<usize, ThinFilm>,
    /// Grain of rough conductors, by the index of the material.
    pub grains: BTreeMap<usize, Grain>,
    /// Materials that shapes of included glTF files have there.
    pub included: Vec<IncludedMaterial>,
    /// Volumes with an index and a medium; `interiors[0]` surrounds the scene.
    pub interiors: Vec<Interior>,
    /// Geometry: every instance is its own shape.
    pub shapes: Vec<Shape>,
    /// Lenses whose faces are among the shapes.
    pub lenses: Vec<Lens>,
    /// Lights that are not shapes.
    pub lights: Vec<Light>,
    /// The greatest number of scattering events on a path.
    pub max_depth: u32,
    /// Which plain estimator this scene's GPU render is held to.
    pub reference: Estimator,
    /// What the loader wants the user to know (ignored glTF features, extrapolated glass, ...), one line each.
    pub notes: Vec<String>,
    /// What the loader found that is probably not meant, one line each; [`super::advice`] has them too.
    pub warnings: Vec<String>,
    /// Hash of the scene file and of all files that it includes, so that a picture can be told from that of a changed scene; 0 for a scene that
    /// was not read from files.
    pub source_hash: u64,
    /// The files that the scene was read from, without links: nothing may be written over them.
    pub sources: Vec<PathBuf>,
}

impl Scene {
    /// The sheen of this width and colour: all of it that does not depend on wavelength.
    pub(crate) fn sheen(&self, color: &Spectrum, alpha: f64) -> Sheen {
        let (lo, hi) = (self.film.bins.min_nm, self.film.bins.max_nm);
        let most = (0..=1000).map(|i| color.eval(lo + (hi - lo) * f64::from(i) / 1000.0)).fold(0.0, f64::max);
        Sheen::new(alpha, most)
    }

    /// Triangles of all shapes; each instance of a mesh has them all.
    pub fn triangles(&self) -> usize {
        let of = |shape: &Shape| match &shape.geometry {
            Geometry::Mesh(mesh) => mesh.triangles.len(),
            Geometry::Instance(instance) => instance.mesh().triangles.len(),
            _ => 0,
        };
        self.shapes.iter().map(of).sum()
    }
}

/// One of the two plain double-precision estimators of [`crate::reference`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// From the sensor towards the lights; sees lights of non-zero size only.
    Backward,
    /// From the lights to the sensor; sees diffuse surfaces and fog only.
    Forward,
}

/// A layer so thin that light interferes in it.
#[derive(Debug, Clone, PartialEq)]
pub struct ThinFilm {
    /// Its index.
    pub ior: Ior,
    /// Its thickness, nm.
    pub thickness_nm: f64,
}

impl ThinFilm {
    /// What it makes at `nm` with a medium of index `near` before it and one of index `n + i k` beyond.
    pub fn between(&self, near: f64, far: (f64, f64), nm: f64) -> Stack {
        Stack { near, film: self.ior.eval(nm), waves: self.thickness_nm / nm, far }
    }
}

/// A volume: index of refraction and homogeneous participating medium. Surfaces bound it, as many as there are; copies of it that overlap count once. Where
/// different volumes overlap, that of the greatest `(priority, depth, index)` rules (Schmidt & Budge, JGT 7(2), 2002, and the depth of nesting).
#[derive(Debug, Clone)]
pub struct Interior {
    /// For messages.
    pub name: String,
    /// Index of refraction.
    pub ior: Ior,
    /// Absorption coefficient, m^-1.
    pub sigma_a: Spectrum,
    /// Scattering coefficient, m^-1.
    pub sigma_s: Spectrum,
    /// Henyey-Greenstein asymmetry in (-1, 1), positive forward.
    pub g: f64,
    /// Rank where volumes overlap (0 to 255).
    pub priority: u8,
    /// How many bodies of this priority, and of other content from one to the next, hold those of this volume (`scene::volumes`).
    pub depth: u32,
}

/// Geometry with a material, and perhaps emission.
#[derive(Debug, Clone)]
pub struct Shape {
    /// For messages.
    pub name: String,
    /// World-space geometry.
    pub geometry: Geometry,
    /// Index into `Scene::materials`.
    pub material: usize,
    /// The volume behind it (on the side its normal points away from) where its material bounds none, an index into `Scene::interiors`: light does not get
    /// there through this shape, but may be there.
    pub interior: Option<usize>,
    /// Emitted light, if any.
    pub emission: Option<Emission>,
}

/// What a material of a glTF file has become in the scene that includes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IncludedMaterial {
    /// Where the scene's file includes the other, as errors name places: `$.shapes[2].gltf`.
    pub place: String,
    /// Its name there.
    pub name: String,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A lens as it was written down, and how many times larger it stands in the scene.
#[derive(Debug, Clone)]
pub struct Lens {
    /// For messages.
    pub name: String,
    /// In its own units of length.
    pub prescription: Prescription,
    /// What those are, m.
    pub scale: f64,
}

/// Diffuse emission of a surface.
#[derive(Debug, Clone)]
pub struct Emission {
    /// Radiance, W m^-2 sr^-1 nm^-1.
    pub radiance: Texture,
    /// Emits on both sides instead of along the outward normal only.
    pub two_sided: bool,
}

/// Bounding box of all shapes.
pub fn bounds_of_all(shapes: &[Shape]) -> Bounds {
    shapes.iter().fold(Bounds::EMPTY, |b, s| b.union(bounds(&s.geometry)))
}
