//! What a scene is made of.

use super::texture::{ImageTexture, Texture};
use super::{FilmSettings, Grain, Profile, Sensor};
use crate::bsdf::film::Stack;
use crate::bsdf::sheen::Sheen;
use crate::geometry::{Bounds, Geometry, bounds};
use crate::spectrum::{Ior, Spectrum};
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

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
    /// Thin films on smooth dielectrics and on conductors, by the index of the material; of a thin dielectric, that it is itself a film.
    pub films: BTreeMap<usize, Film>,
    /// Grain of rough conductors, by the index of the material.
    pub grains: BTreeMap<usize, Grain>,
    /// Volumes with an index and a medium; `interiors[0]` surrounds the scene.
    pub interiors: Vec<Interior>,
    /// Geometry: every instance is its own shape.
    pub shapes: Vec<Shape>,
    /// Lights that are not shapes.
    pub lights: Vec<Light>,
    /// The greatest number of scattering events on a path.
    pub max_depth: u32,
    /// Which plain estimator this scene's GPU render is held to.
    pub reference: Estimator,
    /// What the loader wants the user to know (ignored glTF features, extrapolated glass, ...), one line each.
    pub notes: Vec<String>,
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

    /// The interior that a surface of this material encloses: its own, or that of the material whose normals or roughness vary.
    pub fn interior_of(&self, material: usize) -> Option<usize> {
        match self.materials[material] {
            Material::Dielectric { interior, .. } => Some(interior),
            Material::Boundary { interior } => interior,
            Material::NormalMapped { base, .. } | Material::Graded { first: base, .. } => self.interior_of(base),
            _ => None,
        }
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

/// What a surface does to light.
#[derive(Debug, Clone)]
pub enum Material {
    /// Lambertian, on both sides.
    Diffuse {
        /// Reflectance in [0, 1].
        reflectance: Texture,
    },
    /// The boundary of a transparent solid; smooth for `alpha = 0`, else GGX with energy compensation ([`crate::bsdf`]).
    Dielectric {
        /// What is behind the surface (on the side its normal points away from): an index into `Scene::interiors`.
        interior: usize,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
    },
    /// A thin pane seen as one surface: reflection 2R/(1+R) with all inner bounces, the rest straight through.
    ThinDielectric {
        /// Index of the pane relative to the surroundings.
        ior: Ior,
    },
    /// Metal with complex index `eta + i k`; smooth for `alpha = 0`, else GGX with energy compensation. Reflects on both sides.
    Conductor {
        /// Real part.
        eta: Spectrum,
        /// Imaginary part.
        k: Spectrum,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
    },
    /// Metal of which no index is known, only what it reflects at normal incidence; towards grazing incidence all (Schlick 1994).
    ColoredConductor {
        /// Reflectance in [0, 1].
        reflectance: Texture,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
    },
    /// A material whose roughness varies: of the two levels next to what the picture says, each in proportion ([`super::roughness`]).
    Graded {
        /// Index of the smoothest; the others follow it.
        first: usize,
        /// Which levels there are, two at least.
        levels: std::ops::Range<usize>,
        /// Roughness in [0, 1], the root of the GGX width.
        roughness: Texture,
    },
    /// A clear coat on another material; smooth for `alpha = 0`, else GGX ([`crate::bsdf::coat`]).
    Coated {
        /// Index of what is under it: diffuse, a conductor, or mixtures of such.
        base: usize,
        /// Index of the coat.
        ior: Ior,
        /// GGX width, 0 or in [0.001, 1].
        alpha: f64,
    },
    /// Sheen over another material ([`crate::bsdf::sheen`]).
    Sheen {
        /// Index of what is under it: diffuse, a conductor, a coated material, or mixtures of such.
        base: usize,
        /// Its colour, in [0, 1].
        color: Spectrum,
        /// Width, in [`LEAST`](crate::bsdf::sheen::LEAST) to 1.
        alpha: f64,
    },
    /// `weight` of `a` and `1 - weight` of `b`.
    Mix {
        /// Index of the first material.
        a: usize,
        /// Index of the second material.
        b: usize,
        /// Share of `a`, in [0, 1].
        weight: Texture,
    },
    /// Another material on a surface that looks finer than it is.
    NormalMapped {
        /// Index of that material.
        base: usize,
        /// Normals in tangent space as the first three numbers of texels: x along the picture's width, y up the picture, z outwards.
        normals: Arc<ImageTexture>,
    },
    /// No surface at all: light goes straight through, into or out of the interior where there is one.
    Boundary {
        /// Index into `Scene::interiors`, if crossing it changes the medium.
        interior: Option<usize>,
    },
}

/// A layer so thin that light interferes in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Its index.
    pub ior: Ior,
    /// Its thickness, nm.
    pub thickness_nm: f64,
}

impl Film {
    /// What it makes at `nm` with a medium of index `near` before it and one of index `n + i k` beyond.
    pub fn between(&self, near: f64, far: (f64, f64), nm: f64) -> Stack {
        Stack { near, film: self.ior.eval(nm), waves: self.thickness_nm / nm, far }
    }
}

/// A volume: index of refraction and homogeneous participating medium. Where volumes overlap the greatest `(priority, index)` rules.
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
    /// Emitted light, if any.
    pub emission: Option<Emission>,
}

/// Diffuse emission of a surface.
#[derive(Debug, Clone)]
pub struct Emission {
    /// Radiance, W m^-2 sr^-1 nm^-1.
    pub radiance: Texture,
    /// Emits on both sides instead of along the outward normal only.
    pub two_sided: bool,
}

/// Lights that are not shapes. Directions are unit vectors along which light travels.
#[derive(Debug, Clone)]
pub enum Light {
    /// Isotropic point.
    Point {
        /// Where.
        position: DVec3,
        /// W sr^-1 nm^-1.
        intensity: Spectrum,
    },
    /// Point with a cone; intensity falls smoothly (smoothstep in the cosine) from the inner to the outer cosine.
    Spot {
        /// Where.
        position: DVec3,
        /// Axis.
        direction: DVec3,
        /// On-axis intensity, W sr^-1 nm^-1.
        intensity: Spectrum,
        /// Cosine up to which intensity is full.
        cos_inner: f64,
        /// Cosine beyond which it is zero; less than `cos_inner`.
        cos_outer: f64,
    },
    /// Point with a measured distribution.
    Profile {
        /// Where.
        position: DVec3,
        /// World directions of the lamp's axes: X (azimuth 0), Y, and Z, along which it points.
        axes: DMat3,
        /// In the brightest direction, W sr^-1 nm^-1.
        intensity: Spectrum,
        /// Over that.
        profile: Arc<Profile>,
    },
    /// Parallel light of circular cross-section that starts at a disc; a laser is a narrow one with a line spectrum.
    Beam {
        /// Centre of the starting disc.
        origin: DVec3,
        /// Direction of travel.
        direction: DVec3,
        /// Radius of the beam > 0.
        radius: f64,
        /// Irradiance on a plane across the beam, W m^-2 nm^-1.
        irradiance: Spectrum,
    },
    /// A distant disc; `cos_angle = 1` for parallel light from infinity.
    Sun {
        /// Direction of travel of the light from its centre.
        direction: DVec3,
        /// Cosine of its angular radius.
        cos_angle: f64,
        /// Irradiance on a plane facing it, W m^-2 nm^-1.
        irradiance: Spectrum,
    },
    /// Uniform light from all directions.
    Constant {
        /// W m^-2 sr^-1 nm^-1.
        radiance: Spectrum,
    },
    /// Light from a latitude-longitude picture.
    Image(Arc<EnvironmentMap>),
}

/// A latitude-longitude picture of radiance. Row 0 is +Y; column 0 is centred half a texel past +X and columns run towards +Z
/// (u = atan2(z, x) / 2 pi, v = acos(y) / pi) in the frame `to_local`. Texels are constant (no interpolation).
#[derive(Debug, Clone)]
pub struct EnvironmentMap {
    /// Texels around.
    pub width: u32,
    /// Texels from pole to pole.
    pub height: u32,
    /// Per texel: sigmoid-polynomial coefficients c0, c1, c2 (as [`Spectrum::Sigmoid`]) and a scale.
    pub texels: Vec<[f32; 4]>,
    /// What the upsampled colours are multiplied by ([`crate::color::upsample::white`]).
    pub illuminant: Spectrum,
    /// World to picture rotation.
    pub to_local: DMat3,
}

/// Bounding box of all shapes.
pub fn bounds_of_all(shapes: &[Shape]) -> Bounds {
    shapes.iter().fold(Bounds::EMPTY, |b, s| b.union(bounds(&s.geometry)))
}
