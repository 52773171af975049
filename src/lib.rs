//! Abbe: a spectral GPU renderer for dispersive caustics.
//!
//! The way of the data, one direction only:
//! scene file -> [`scene`] -> plan ([`integrator`]) -> [`gpu`] buffers -> passes -> [`film`] -> [`output`] (spectral EXR, picture).
//! [`mod@reference`] renders the same [`scene::Scene`] with two plain double-precision estimators that the GPU is held to.

pub mod bsdf;
pub mod cli;
pub mod color;
pub mod error;
pub mod film;
pub mod geometry;
pub mod gpu;
pub mod integrator;
pub mod memory;
pub mod output;
pub mod reference;
pub mod render;
pub mod scene;
pub mod spectrum;
pub mod stage;
pub mod validate;

pub use error::{Error, Result};
