//! What measures the light of a scene: the film with its wavelength bins, and the sensor in front of it.

use crate::geometry::world::Ray;
use crate::lens::LensCamera;
use crate::spectrum::Bins;
use glam::{DMat3, DVec3, dvec3};
use std::sync::Arc;

/// A rectangle of pixels; `x` to the right and `y` downwards from the upper left corner of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Tile {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The same, counted from the corner of `around`, which it lies in.
    pub fn within(self, around: Tile) -> Tile {
        Tile { x: self.x - around.x, y: self.y - around.y, ..self }
    }

    /// Numbers of its pixels in a picture `width` pixels wide, row by row.
    pub fn numbers(self, width: u32) -> impl Iterator<Item = usize> {
        let of_row = move |y: u32| (self.x..self.x + self.width).map(move |x| y as usize * width as usize + x as usize);
        (self.y..self.y + self.height).flat_map(of_row)
    }
}

/// Resolution, wavelength bins and reconstruction filter of the film.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSettings {
    /// Pixels of the picture across.
    pub width: u32,
    /// Pixels of the picture down.
    pub height: u32,
    /// The part of the picture that is rendered; `None` for all of it.
    pub crop: Option<Tile>,
    /// The wavelength bins.
    pub bins: Bins,
    /// Pixel filter, in pixels.
    pub filter: Filter,
    /// Where in its stratum a path's wavelengths lie.
    pub sampling: WavelengthSampling,
    /// Exposure of the preview picture in stops; `None` chooses it from the picture.
    pub exposure: Option<f64>,
}

impl FilmSettings {
    /// Of a whole picture: a box filter, continuous wavelengths, the exposure chosen from the picture.
    pub fn new(width: u32, height: u32, bins: Bins) -> Self {
        FilmSettings {
            width,
            height,
            crop: None,
            bins,
            filter: Filter::Box,
            sampling: WavelengthSampling::Continuous,
            exposure: None,
        }
    }

    /// The pixels that are rendered and kept, as in pbrt's film.
    pub fn pixel_bounds(&self) -> Tile {
        self.crop.unwrap_or(Tile { x: 0, y: 0, width: self.width, height: self.height })
    }

    /// Number of pixels of the whole picture.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
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
    /// Area of what measures irradiance, m^2; `None` for a camera.
    pub fn area(&self) -> Option<f64> {
        match self {
            Sensor::IrradiancePlane { edge_u, edge_v, .. } => Some(edge_u.cross(*edge_v).length()),
            Sensor::IrradianceSphere { radius, .. } => Some(4.0 * std::f64::consts::PI * radius * radius),
            Sensor::Perspective { .. } | Sensor::Orthographic { .. } => None,
        }
    }

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

impl Sensor {
    /// The ray through the middle of the lens and a place of the picture, from 0 to 1 across and down; `aspect` is the picture's width over its height. `None`
    /// for what is no camera.
    pub fn ray(&self, aspect: f64, place: [f64; 2]) -> Option<Ray> {
        let (x, y) = ((2.0 * place[0] - 1.0) * aspect, 1.0 - 2.0 * place[1]);
        match self {
            Sensor::Perspective { eye, frame, tan_half_vfov, .. } => {
                Some(Ray::new(*eye, (*frame * dvec3(x * tan_half_vfov, y * tan_half_vfov, -1.0)).normalize()))
            }
            Sensor::Orthographic { eye, frame, height } => {
                Some(Ray::new(*eye + *frame * dvec3(0.5 * x * height, 0.5 * y * height, 0.0), -frame.z_axis))
            }
            Sensor::IrradiancePlane { .. } | Sensor::IrradianceSphere { .. } => None,
        }
    }

    /// Whether a place lies before the camera and within its picture, whatever stands between them; `None` for what is no camera.
    pub fn has_in_view(&self, aspect: f64, place: DVec3) -> Option<bool> {
        let (eye, frame, half, is_parallel) = match self {
            Sensor::Perspective { eye, frame, tan_half_vfov, .. } => (eye, frame, *tan_half_vfov, false),
            Sensor::Orthographic { eye, frame, height } => (eye, frame, 0.5 * height, true),
            Sensor::IrradiancePlane { .. } | Sensor::IrradianceSphere { .. } => return None,
        };
        let p = frame.transpose() * (place - *eye);
        let q = p.truncate().abs() / if is_parallel { 1.0 } else { -p.z };
        Some(p.z < 0.0 && q.x < half * aspect && q.y < half)
    }
}
