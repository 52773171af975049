//! Abbe: a spectral GPU renderer for dispersive caustics.
//!
//! The way of the data, one direction only:
//! scene file -> [`scene`] -> plan ([`integrator`]) -> [`gpu`] buffers -> passes -> [`film`] -> [`output`] (spectral EXR, picture).
//! [`reference`](mod@reference) renders the same [`scene::Scene`] with two plain double-precision estimators that the GPU is held to.
//!
//! ```
//! use abbe::film::Film;
//! use abbe::reference::ReferenceIntegrator;
//! use abbe::render::{Rendering, Stop};
//! use abbe::scene::{LoadOptions, load_str};
//! use std::{ops::ControlFlow, path::Path};
//!
//! // A grey ball under a sky of radiance 1 W m^-2 sr^-1 nm^-1.
//! let json = r#"{
//!     "film": {"width": 9, "height": 9, "range_nm": [380, 780], "bins": 20},
//!     "camera": {"perspective": {"eye": [0, 0, 3], "target": [0, 0, 0], "vfov_deg": 50}},
//!     "materials": {"grey": {"diffuse": {"reflectance": 0.5}}},
//!     "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "grey"}],
//!     "lights": [{"constant": {"radiance": 1}}]
//! }"#;
//! let scene = load_str(json, Path::new("ball.json"), Path::new("."), &LoadOptions::default())?;
//!
//! let mut rendering = Rendering::new(Film::new(&scene.film));
//! let mut integrator = ReferenceIntegrator::new(&scene, scene.reference, 1)?;
//! let stop = Stop { spp: Some(4), ..Stop::default() };
//! rendering.render(&mut integrator, &stop, &mut |_, _| ControlFlow::Continue(()))?;
//! let film = rendering.film;
//!
//! // The pixel in the middle sees the ball, which reflects half of the sky; the first one sees the sky itself.
//! assert!((film.bin(40, 0) - 0.5).abs() < 1e-9);
//! assert!((film.bin(0, 0) - 1.0).abs() < 1e-9);
//! # Ok::<(), abbe::Error>(())
//! ```
//!
//! # Rooms
//! Each module uses only those above it; a test reads this list and holds the code to it.
//! - [`error`]: what can go wrong, with what to do about it
//! - [`stage`]: what loading and set-up are busy with
//! - [`memory`]: how much memory is held, and a limit to it
//! - [`state`]: what outlives a process, as bytes
//! - [`spectrum`]: functions of wavelength, and the library of measured ones
//! - [`bsdf`]: what surfaces and fog do to light
//! - [`geometry`]: kinds of geometry, and rays against them
//! - [`lens`]: prescriptions of lenses, and what follows from them
//! - [`color`]: from spectra to colours, and back
//! - [`channels`]: the spectral channels of EXR files
//! - [`scene`]: what is rendered, and the files that it is read from
//! - [`gpu`]: adapters, kernels, and the layout of what they share with the host
//! - [`gpu::scene`]: a scene in an adapter's memory
//! - [`stats`]: what batches of samples came to
//! - [`film`]: means and errors of every pixel
//! - [`render`]: the loop of batches, and when it stops
//! - [`develop`]: from XYZ to pictures
//! - [`integrator`]: the GPU's passes, and the plan of what a scene needs of them
//! - [`output`]: files of spectra and pictures, written and read
//! - [`denoise`]: noise off what was rendered, spectra kept
//! - [`compare`]: how far two measurements are apart
//! - [`reference`](mod@reference): two plain estimators in double precision
//! - [`validate`]: renders held to answers known from theory
//! - `view`: a page in the browser that shows a render or files, with the feature `view`
//! - `cli`: the `abbe` command, with the feature `cli`

pub mod bsdf;
pub mod channels;
#[cfg(feature = "cli")]
pub mod cli;
pub mod color;
pub mod compare;
pub mod denoise;
pub mod develop;
pub mod error;
pub mod film;
pub mod geometry;
pub mod gpu;
pub mod integrator;
pub mod lens;
pub mod memory;
pub mod output;
pub mod reference;
pub mod render;
#[cfg(test)]
mod rooms;
pub mod scene;
pub mod spectrum;
pub mod stage;
pub mod state;
pub mod stats;
pub mod validate;
#[cfg(feature = "view")]
pub mod view;

pub use error::{Error, Result};
