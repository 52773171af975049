//! What measures the light of a scene: the film with its wavelength bins, and the sensor in front of it.

use crate::lens::LensCamera;
use crate::spectrum::Bins;
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Resolution, wavelength bins and reconstruction filter of the film.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The wavelength bins.
    pub bins: Bins,
    /// Pixel filter, in pixels.
    pub filter: Filter,
    /// Where in its stratum a path's wavelengths lie.
    pub sampling: WavelengthSampling,
    /// Exposure of the preview picture in stops; `None` chooses it from the picture.
    pub exposure: Option<f64>,
}

/// Pixel reconstruction filter; lengths in pixels. All are non-negative and sampled by importance, so a sample belongs to one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// One over the pixel's square.
    Box,
    /// A tent of the given radius.
    Tent {
        /// Where it reaches zero.
        radius: f64,
    },
    /// A Gaussian cut off at three standard deviations.
    Gaussian {
        /// Standard deviation.
        sigma: f64,
    },
}

/// Where in its stratum a path's wavelengths lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WavelengthSampling {
    /// Anywhere: continuous in wavelength.
    Continuous,
    /// At the centres of the strata, for comparison with renderers that know only fixed wavelengths.
    Centres,
}

impl Sensor {
    /// The lens that a camera looks through, if it is one of surfaces.
    pub fn optics(&self) -> Option<&LensCamera> {
        match self {
            Sensor::Perspective { optics, .. } => optics.as_deref(),
            _ => None,
        }
    }
}

/// What measures the light. Image rows run downwards, columns to the right.
#[derive(Debug, Clone, PartialEq)]
pub enum Sensor {
    /// A pinhole, thin-lens or lens camera; pixels are radiance, of a lens camera irradiance on the film over [`LensCamera::axial`].
    Perspective {
        /// Centre of the lens.
        eye: DVec3,
        /// Columns right, up, backward (camera looks along `-z`), orthonormal.
        frame: DMat3,
        /// Tangent of half the full vertical field of view; pixels are square.
        tan_half_vfov: f64,
        /// Radius of the thin lens, 0 for a pinhole.
        lens_radius: f64,
        /// Distance of the plane in focus along the view axis.
        focus_distance: f64,
        /// The lens that rays go through, with [`LensCamera::eye_z`] at the eye; then the thin lens is what it is about.
        optics: Option<Arc<LensCamera>>,
    },
    /// Parallel view rays; pixels are radiance.
    Orthographic {
        /// Centre of the view rectangle, where rays start.
        eye: DVec3,
        /// Columns right, up, backward, orthonormal.
        frame: DMat3,
        /// Height of the view rectangle; pixels are square.
        height: f64,
    },
    /// Irradiance on the front of a rectangle, W m^-2 nm^-1; light passes through it. Row 0 lies at `origin + edge_v`, column 0 at `origin`.
    IrradiancePlane {
        /// Corner.
        origin: DVec3,
        /// Edge along columns (left to right).
        edge_u: DVec3,
        /// Edge along rows (bottom to top). `edge_u x edge_v` points to the front, where light arrives from.
        edge_v: DVec3,
    },
    /// Irradiance on the outside of a sphere, W m^-2 nm^-1; light passes through it. Columns are azimuth about +Y from +X towards -Z over 2 pi,
    /// rows are equal steps of `y` from top (+1) to bottom (-1), so that all pixels have equal area.
    IrradianceSphere {
        /// Centre.
        center: DVec3,
        /// Radius.
        radius: f64,
    },
}
