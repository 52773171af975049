//! The scene as every later stage sees it: resolved, in double precision, in world space.
//!
//! A scene file is parsed by [`load`] into a [`Scene`]; nothing after that reads JSON, meshes or spectra files. Both integrators (the GPU's
//! and the reference) take this type and nothing else. Lengths are metres, right-handed, Y up; radiance is W m^-2 sr^-1 nm^-1.

mod advice;
mod bodies;
mod gltf;
mod grain;
pub mod inside;
mod json;
mod lamp;
mod light;
mod matched;
mod material;
mod mesh;
pub mod roughness;
mod sensor;
mod starts;
pub mod texture;
mod types;
pub(crate) mod volumes;
mod walls;
mod weld;

pub use crate::geometry::{Geometry, Instance, Mesh};
pub use crate::spectrum::Bins;
pub use advice::{advice, advice_before_rendering};
pub use grain::{Grain, direction_of_grain};
pub use inside::{initial_interiors, ruling};
pub use json::animate::LAST_FRAME;
pub use json::keys;
pub use json::lens::load_lens;
pub use json::load::{LoadOptions, load, load_str};
pub use json::parse;
pub use json::settings::Setting;
pub use lamp::profile::{Profile, ProfileCell};
pub use lamp::sky::Sky;
pub(crate) use light::spot_solid_angle;
pub use light::{EnvironmentMap, EnvironmentTexels, Falloff, Light, Placement};
pub use material::{CoatNormals, Material, Passage};
pub(crate) use mesh::read as read_mesh;
pub use sensor::{FilmSettings, Filter, Sensor, Tile, WavelengthSampling};
pub(crate) use starts::{SLACK, Starts};
pub use texture::Texture;
pub use types::*;
