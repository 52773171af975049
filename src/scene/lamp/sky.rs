//! The clear sky and the Sun over it by turbidity and elevation: Hosek & Wilkie, "An Analytic Model for Full Spectral Sky-Dome Radiance", 2012, and "Adding a Solar
//! Radiance Function to the Hosek Skylight Model", 2013. The Sun's disc is even: its limb is as bright as its mean, so that its irradiance is the model's.

use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::spectra::SpectrumReader;
use crate::scene::texture::Spectra;
use crate::scene::{EnvironmentMap, EnvironmentTexels, Light};
use crate::spectrum::{Spectrum, library};
use glam::{DMat3, DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Wavelengths of the model, nm: from the first by steps.
const FIRST_NM: f64 = 320.0;
const STEP_NM: f64 = 40.0;
const WAVELENGTHS: usize = 11;
/// Coefficients over elevation, a Bezier curve's; parameters of a radiance.
const CONTROLS: usize = 6;
const PARAMETERS: usize = 9;
/// Pieces of the Sun's radiance over elevation, each a cubic; coefficients of the darkening of its limb.
const SEGMENTS: usize = 45;
const CUBIC: usize = 4;
const DARKENING: usize = 6;
/// Half the angle of the Sun's disc, rad.
const SUN: f64 = 0.5 * 0.5358 * PI / 180.0;
/// Texels of the environment, around and from pole to pole, and its bins, nm.
const SIZE: (u32, u32) = (512, 256);
const BIN_NM: f64 = 10.0;

/// A clear sky at one place of the Sun.
pub struct Sky {
    /// Unit direction to the Sun.
    pub sun: DVec3,
    elevation: f64,
    parameters: [[f64; PARAMETERS]; WAVELENGTHS],
    radiance: [f64; WAVELENGTHS],
    /// Of the Sun's disc, W m^-2 nm^-1.
    irradiance: [f64; WAVELENGTHS],
}

impl Sky {
    /// `turbidity` from 1 to 10, the Sun's `elevation` and `azimuth` (about +Y from +X towards -Z) in rad, the ground's `albedo`.
    pub fn new(turbidity: f64, elevation: f64, azimuth: f64, albedo: f64) -> Sky {
        let [parameters, radiance, sun, darkening] = library::sky_model();
        let low = (turbidity.floor() as usize).clamp(1, 9) - 1;
        let share = turbidity - 1.0 - low as f64;
        // Linear in turbidity and albedo, quintic in the cube root of elevation.
        let x = (elevation / FRAC_PI_2).cbrt();
        let bezier: [f64; CONTROLS] = std::array::from_fn(|i| {
            [1.0, 5.0, 10.0, 10.0, 5.0, 1.0][i] * x.powi(i as i32) * (1.0 - x).powi((CONTROLS - 1 - i) as i32)
        });
        let interpolated = |data: &[f64], size: usize, at: usize| -> f64 {
            let value = |t: usize, a: usize, i: usize| data[((t * 2 + a) * CONTROLS + i) * size + at];
            let of_turbidity = |t: usize| -> f64 {
                bezier.iter().enumerate().map(|(i, b)| b * ((1.0 - albedo) * value(t, 0, i) + albedo * value(t, 1, i))).sum()
            };
            (1.0 - share) * of_turbidity(low) + share * of_turbidity(low + 1)
        };
        let of_sun = |wavelength: usize| {
            let segment = ((x * SEGMENTS as f64) as usize).min(SEGMENTS - 1);
            let from = elevation - FRAC_PI_2 * (segment as f64 / SEGMENTS as f64).powi(3);
            let at = |t: usize| -> f64 {
                let start = ((t * SEGMENTS + segment) * WAVELENGTHS + wavelength) * CUBIC;
                (0..CUBIC).map(|k| sun[start + k] * from.powi(k as i32)).sum()
            };
            // Mean over the disc of the polynomial in the cosine psi to its surface: the integral of 2 psi^(k + 1).
            let limb = &darkening[wavelength * DARKENING..][..DARKENING];
            let mean: f64 = limb.iter().enumerate().map(|(k, a)| 2.0 * a / (k as f64 + 2.0)).sum();
            ((1.0 - share) * at(low) + share * at(low + 1)).max(0.0) * mean * PI * SUN.sin().powi(2)
        };
        let (up, along) = (elevation.sin(), elevation.cos());
        Sky {
            sun: dvec3(along * azimuth.cos(), up, -along * azimuth.sin()),
            elevation,
            parameters: std::array::from_fn(|w| {
                std::array::from_fn(|p| interpolated(parameters, WAVELENGTHS * PARAMETERS, w * PARAMETERS + p))
            }),
            radiance: std::array::from_fn(|w| interpolated(radiance, WAVELENGTHS, w)),
            irradiance: std::array::from_fn(of_sun),
        }
    }

    /// Radiance of the sky from a unit direction at the model's wavelengths, W m^-2 sr^-1 nm^-1; 0 below the horizon.
    fn radiances(&self, to: DVec3) -> [f64; WAVELENGTHS] {
        if to.y < 0.0 {
            return [0.0; WAVELENGTHS];
        }
        let cos_gamma = to.dot(self.sun).clamp(-1.0, 1.0);
        let gamma = to.cross(self.sun).length().atan2(cos_gamma);
        std::array::from_fn(|w| {
            // Equation 8 of 2012.
            let [a, b, c, d, e, f, g, h, i] = self.parameters[w];
            let chi = (1.0 + cos_gamma * cos_gamma) / (1.0 + i * i - 2.0 * i * cos_gamma).powf(1.5);
            let glow = c + d * (e * gamma).exp() + f * cos_gamma * cos_gamma + g * chi + h * to.y.sqrt();
            ((1.0 + a * (b / (to.y + 0.01)).exp()) * glow * self.radiance[w]).max(0.0)
        })
    }

    /// Radiance of the sky from a unit direction at `nm`, W m^-2 sr^-1 nm^-1.
    pub fn radiance(&self, to: DVec3, nm: f64) -> f64 {
        at(&self.radiances(to), nm)
    }

    /// Irradiance of the Sun's disc on a plane that faces it, W m^-2 nm^-1.
    pub fn sun_irradiance(&self) -> Spectrum {
        let nm = (0..WAVELENGTHS).map(|i| FIRST_NM + STEP_NM * i as f64).collect();
        Spectrum::Table { nm, values: self.irradiance.to_vec(), extend: true }
    }

    /// The sky as an environment over [lo, hi] nm.
    fn map(&self, (lo, hi): (f64, f64), scale: f64) -> EnvironmentMap {
        let (first, last) = ((lo / BIN_NM).floor() as usize, (hi / BIN_NM).ceil() as usize);
        let edges: Vec<f64> = (first..=last).map(|i| BIN_NM * i as f64).collect();
        let mut values = Vec::new();
        let (width, height) = SIZE;
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
            let theta = PI * (f64::from(row) + 0.5) / f64::from(height);
            let phi = 2.0 * PI * (f64::from(column) + 0.5) / f64::from(width);
            let radiances = self.radiances(dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()));
            values.extend(edges[1..].iter().map(|edge| at(&radiances, edge - 0.5 * BIN_NM) as f32));
        }
        let texels = EnvironmentTexels::Spectra(Arc::new(Spectra::new(edges, values)));
        EnvironmentMap { width, height, texels, illuminant: Spectrum::Constant(scale), to_local: DMat3::IDENTITY }
    }
}

/// Linear between the model's wavelengths, held beyond them.
fn at(values: &[f64; WAVELENGTHS], nm: f64) -> f64 {
    let x = ((nm - FIRST_NM) / STEP_NM).clamp(0.0, (WAVELENGTHS - 1) as f64);
    let i = (x as usize).min(WAVELENGTHS - 2);
    values[i] + (x - i as f64) * (values[i + 1] - values[i])
}

/// `{"sky": {"turbidity", "elevation_deg", "azimuth_deg", "albedo", "scale", "sun"}}`: the sky, and the Sun's disc as a light of its own.
pub(in crate::scene) fn lights(reader: &SpectrumReader, node: &Node) -> Result<Vec<Light>> {
    let number = |key: &str, default: f64, lo: f64, hi: f64| node.get(key).map_or(Ok(default), |n| n.within(lo, hi));
    let elevation = node.need("elevation_deg")?.within(0.0, 90.0)?.to_radians();
    let azimuth = number("azimuth_deg", 0.0, -360.0, 360.0)?.to_radians();
    let scale = node.get("scale").map_or(Ok(1.0), |n| n.non_negative())?;
    let sky = Sky::new(number("turbidity", 3.0, 1.0, 10.0)?, elevation, azimuth, number("albedo", 0.3, 0.0, 1.0)?);
    let end_nm = FIRST_NM + STEP_NM * (WAVELENGTHS - 1) as f64;
    if reader.range.0 < FIRST_NM || reader.range.1 > end_nm {
        reader.remarks.note(node, &format!("the sky's model reaches from {FIRST_NM} to {end_nm} nm; its ends are held beyond"));
    }
    let mut lights = vec![Light::Image(Arc::new(sky.map(reader.range, scale)))];
    if node.get("sun").map_or(Ok(true), |n| n.boolean())? && sky.elevation > 0.0 {
        let irradiance = sky.sun_irradiance().scaled(scale);
        lights.push(Light::Sun { direction: -sky.sun, cos_angle: SUN.cos(), irradiance });
    }
    Ok(lights)
}
