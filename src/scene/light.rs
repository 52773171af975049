//! Lights that are not shapes, and what the rest of the program asks them: where a stage does not handle every kind by itself, it asks here and knows no kinds.

use super::Profile;
use super::texture::Spectra;
use crate::color::cie;
use crate::spectrum::library::Observer;
use crate::spectrum::{Spectrum, sigmoid};
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

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
    /// Point with a cone; intensity falls from the inner to the outer cosine.
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
        /// How it falls between the two.
        falloff: Falloff,
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

/// How a spot's intensity falls, by the share of the way from the outer to the inner cosine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Falloff {
    /// Smoothstep, `x^2 (3 - 2 x)`.
    Smooth,
    /// `x^2` (KHR_lights_punctual).
    Squared,
}

impl Falloff {
    /// Intensity over the greatest at the share `x` of the way.
    pub fn at(self, x: f64) -> f64 {
        let x = x.clamp(0.0, 1.0);
        match self {
            Falloff::Smooth => x * x * (3.0 - 2.0 * x),
            Falloff::Squared => x * x,
        }
    }

    /// Its mean over the cosines between the two cones.
    pub fn mean(self) -> f64 {
        match self {
            Falloff::Smooth => 0.5,
            Falloff::Squared => 1.0 / 3.0,
        }
    }
}

/// Where a light stands that is not distant, and where its light goes.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// Its middle, m.
    pub position: DVec3,
    /// Around its middle, 0 for a point, m.
    pub radius: f64,
    /// Middle of the directions of light.
    pub axis: DVec3,
    /// Light leaves at most a right angle further from `axis` than this, rad.
    pub angle: f64,
}

impl Placement {
    /// True if its light goes to all sides.
    pub fn is_even(&self) -> bool {
        self.angle >= PI
    }
}

impl Light {
    /// What people call it.
    pub fn name(&self) -> &'static str {
        match self {
            Light::Point { .. } => "point light",
            Light::Spot { .. } | Light::Profile { .. } => "spot light",
            Light::Beam { .. } => "parallel beam",
            Light::Sun { cos_angle, .. } if *cos_angle >= 1.0 => "parallel sun",
            Light::Sun { .. } => "sun",
            Light::Constant { .. } => "constant environment",
            Light::Image(_) => "environment picture",
        }
    }

    /// The spectrum of its light, up to a factor.
    pub fn spectrum(&self) -> &Spectrum {
        match self {
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } | Light::Profile { intensity, .. } => intensity,
            Light::Beam { irradiance, .. } | Light::Sun { irradiance, .. } => irradiance,
            Light::Constant { radiance } => radiance,
            Light::Image(map) => &map.illuminant,
        }
    }

    /// True if no ray can meet it by chance: it has no area, or no solid angle.
    pub fn is_delta(&self) -> bool {
        match self {
            Light::Point { .. } | Light::Spot { .. } | Light::Profile { .. } | Light::Beam { .. } => true,
            Light::Sun { cos_angle, .. } => *cos_angle >= 1.0,
            Light::Constant { .. } | Light::Image(_) => false,
        }
    }

    /// Where it stands; `None` for a distant light.
    pub fn placement(&self) -> Option<Placement> {
        let (position, radius, axis, angle) = match self {
            Light::Point { position, .. } => (position, 0.0, DVec3::Z, PI),
            Light::Spot { position, direction, cos_outer, .. } => (position, 0.0, *direction, cos_outer.clamp(-1.0, 1.0).acos()),
            Light::Profile { position, axes, profile, .. } => {
                (position, 0.0, axes.z_axis, (profile.reach() - FRAC_PI_2).max(0.0))
            }
            Light::Beam { origin, direction, radius, .. } => (origin, *radius, *direction, 0.0),
            Light::Sun { .. } | Light::Constant { .. } | Light::Image(_) => return None,
        };
        Some(Placement { position: *position, radius, axis, angle })
    }

    /// Where it stands; `None` for a distant light.
    pub fn position(&self) -> Option<DVec3> {
        self.placement().map(|p| p.position)
    }

    /// True if its light comes from infinity.
    pub fn is_distant(&self) -> bool {
        self.placement().is_none()
    }

    /// Power over [`Light::spectrum`] of a light that has a place: a solid angle (sr), or the area of a beam (m^2).
    fn extent(&self) -> Option<f64> {
        match self {
            Light::Point { .. } => Some(4.0 * PI),
            Light::Spot { cos_inner, cos_outer, falloff, .. } => Some(spot_solid_angle(*cos_inner, *cos_outer, *falloff)),
            Light::Profile { profile, .. } => Some(profile.solid_angle()),
            Light::Beam { radius, .. } => Some(PI * radius * radius),
            Light::Sun { .. } | Light::Constant { .. } | Light::Image(_) => None,
        }
    }

    /// Mean power over `[lo, hi]` nm, of a distant light through a sphere of this radius (m), W nm^-1.
    pub fn power(&self, radius: f64, lo: f64, hi: f64) -> f64 {
        let extent = match self {
            Light::Sun { .. } => PI * radius * radius,
            Light::Constant { .. } => PI * PI * radius * radius,
            Light::Image(map) => PI * PI * radius * radius * map.mean(),
            placed => placed.extent().unwrap_or(0.0),
        };
        extent * self.spectrum().mean(lo, hi)
    }

    /// True if it sends nothing at `[lo, hi]` nm.
    pub fn is_dark(&self, lo: f64, hi: f64) -> bool {
        let is_black = matches!(self, Light::Image(map) if map.brightest() == 0.0);
        is_black || self.spectrum().mean(lo, hi) == 0.0
    }

    /// Luminous flux of a light that has a place, lm.
    pub fn luminous_flux_lm(&self) -> Option<f64> {
        Some(self.extent()? * cie::xyz_of(self.spectrum(), Observer::Cie1931)[1])
    }
}

/// Integral of a spot's intensity over directions, the greatest being 1, sr.
pub(crate) fn spot_solid_angle(cos_inner: f64, cos_outer: f64, falloff: Falloff) -> f64 {
    2.0 * PI * (1.0 - cos_inner + falloff.mean() * (cos_inner - cos_outer))
}

/// A latitude-longitude picture of radiance. Row 0 is +Y; column 0 is centred half a texel past +X and columns run towards +Z
/// (u = atan2(z, x) / 2 pi, v = acos(y) / pi) in the frame `to_local`. Texels are constant (no interpolation).
#[derive(Debug, Clone)]
pub struct EnvironmentMap {
    /// Texels around.
    pub width: u32,
    /// Texels from pole to pole.
    pub height: u32,
    /// What is in it.
    pub texels: EnvironmentTexels,
    /// What that is multiplied by: for upsampled colours [`crate::color::upsample::white`].
    pub illuminant: Spectrum,
    /// World to picture rotation.
    pub to_local: DMat3,
}

/// Texels of an environment, row by row.
#[derive(Debug, Clone)]
pub enum EnvironmentTexels {
    /// Upsampled colours: sigmoid-polynomial coefficients c0, c1, c2 (as [`Spectrum::Sigmoid`]) and a scale.
    Colors(Vec<[f32; 4]>),
    /// Spectra; it is dark outside their bins.
    Spectra(Arc<Spectra>),
}

impl EnvironmentMap {
    /// Number of texels.
    pub fn count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Radiance of a texel over [`EnvironmentMap::illuminant`].
    pub fn eval(&self, texel: usize, nm: f64) -> f64 {
        match &self.texels {
            EnvironmentTexels::Colors(texels) => {
                let [c0, c1, c2, scale] = texels[texel].map(f64::from);
                scale * sigmoid(&[c0, c1, c2], nm)
            }
            EnvironmentTexels::Spectra(spectra) => spectra.eval(texel, nm, false),
        }
    }

    /// What no texel is brighter than at any wavelength, over [`EnvironmentMap::illuminant`].
    pub fn brightest(&self) -> f64 {
        match &self.texels {
            // Twice its largest component, of which the sigmoid takes a half off there.
            EnvironmentTexels::Colors(texels) => 0.5 * texels.iter().map(|t| f64::from(t[3])).fold(0.0, f64::max),
            EnvironmentTexels::Spectra(spectra) => spectra.greatest(),
        }
    }

    /// Solid angle of a texel of this row, sr.
    pub fn solid_angle(&self, row: usize) -> f64 {
        let edge = |r: usize| (PI * r as f64 / f64::from(self.height)).cos();
        2.0 * PI / f64::from(self.width) * (edge(row) - edge(row + 1))
    }

    /// World-space direction to the middle of a texel.
    pub fn direction(&self, texel: usize) -> DVec3 {
        let width = self.width as usize;
        let theta = PI * ((texel / width) as f64 + 0.5) / f64::from(self.height);
        let phi = 2.0 * PI * ((texel % width) as f64 + 0.5) / f64::from(self.width);
        let (r, y) = theta.sin_cos();
        self.to_local.transpose() * DVec3::new(r * phi.cos(), y, r * phi.sin())
    }

    /// Radiance of every texel over [`EnvironmentMap::illuminant`], the mean of three wavelengths or over all bins, times its solid angle.
    pub fn weights(&self) -> Vec<f64> {
        let radiance = |texel: usize| match &self.texels {
            EnvironmentTexels::Colors(_) => [450.0, 550.0, 650.0].iter().map(|&nm| self.eval(texel, nm)).sum::<f64>() / 3.0,
            EnvironmentTexels::Spectra(spectra) => spectra.mean(texel),
        };
        (0..self.count()).map(|texel| radiance(texel) * self.solid_angle(texel / self.width as usize)).collect()
    }

    /// Mean radiance over the sphere, over [`EnvironmentMap::illuminant`].
    pub fn mean(&self) -> f64 {
        self.weights().iter().sum::<f64>() / (4.0 * PI)
    }
}
