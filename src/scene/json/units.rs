//! Amounts of light: a spectrum as it is, or a spectrum's shape with a radiant or photometric amount.
//!
//! Photometry is the CIE 1931 observer with K_m = 683.002 lm/W; watts are counted over the film's range.

use crate::color::cie;
use crate::color::upsample;
use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::spectra::{Place, SpectrumReader};
use crate::spectrum::{Spectrum, library::Observer};
use std::f64::consts::PI;

/// The units an amount may be given in.
const UNITS: &[&str] =
    &["luminance_cd_m2", "illuminance_lx", "luminous_flux_lm", "luminous_intensity_cd", "irradiance_W_m2", "power_W"];

/// What the amount is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// Radiance of surfaces of so many m^2, counting both sides if both emit.
    Surface(f64),
    /// Radiance from everywhere.
    Everywhere,
    /// Intensity into so many sr (of the full intensity).
    Point(f64),
    /// Irradiance of a beam of so many m^2.
    Beam(f64),
    /// Irradiance from a distance.
    Distant,
}

impl Source {
    /// Spectral quantity (of this source's own unit) -> the amount in `unit`: `(factor, photometric)`, none if the unit does not fit.
    fn amount(self, unit: &str) -> Option<(f64, bool)> {
        use Source::*;
        match (self, unit) {
            (Surface(_) | Everywhere, "luminance_cd_m2") => Some((1.0, true)),
            (Everywhere, "illuminance_lx") => Some((PI, true)),
            (Everywhere, "irradiance_W_m2") => Some((PI, false)),
            (Surface(area), "luminous_flux_lm") => Some((PI * area, true)),
            (Surface(area), "power_W") => Some((PI * area, false)),
            (Point(_), "luminous_intensity_cd") => Some((1.0, true)),
            (Point(solid_angle), "luminous_flux_lm") => Some((solid_angle, true)),
            (Point(solid_angle), "power_W") => Some((solid_angle, false)),
            (Beam(_) | Distant, "illuminance_lx") => Some((1.0, true)),
            (Beam(_) | Distant, "irradiance_W_m2") => Some((1.0, false)),
            (Beam(area), "luminous_flux_lm") => Some((area, true)),
            (Beam(area), "power_W") => Some((area, false)),
            _ => None,
        }
    }
}

impl SpectrumReader {
    /// Emitted light: a spectrum in the source's own unit, or `{"spectrum": shape, UNIT: amount}`, which scales the shape.
    pub fn light(&self, node: &Node, source: Source) -> Result<Spectrum> {
        if node.get("spectrum").is_none() {
            return self.spectrum(node, Place::Light);
        }
        node.object("quantity")?;
        let shape = self.spectrum(&node.need("spectrum")?, Place::Light)?;
        let (unit, amount) = node.one_of(UNITS)?;
        let Some((factor, photometric)) = source.amount(unit) else {
            let fitting: Vec<&str> = UNITS.iter().copied().filter(|u| source.amount(u).is_some()).collect();
            return Err(amount.fail(format!("{unit} does not fit this light"), format!("use one of {}", fitting.join(", "))));
        };
        self.scaled(node, shape, amount.non_negative()?, factor, photometric)
    }

    /// The amount under `key` of a light with a profile: as [`SpectrumReader::light`], or with no unit given (D65 if there is no such key at all) the
    /// `candela` of its file.
    pub(in crate::scene) fn light_by_file(&self, light: &Node, key: &str, source: Source, candela: f64) -> Result<Spectrum> {
        let Some(node) = light.get(key) else { return self.scaled(light, upsample::white(), candela, 1.0, true) };
        if node.get("spectrum").is_none() || UNITS.iter().any(|unit| node.get(unit).is_some()) {
            return self.light(&node, source);
        }
        node.object("quantity")?;
        let shape = self.spectrum(&node.need("spectrum")?, Place::Light)?;
        self.scaled(&node, shape, candela, 1.0, true)
    }

    /// `shape` times what makes `factor` of it come to `amount`, in photometric units or watts.
    fn scaled(&self, node: &Node, shape: Spectrum, amount: f64, factor: f64, photometric: bool) -> Result<Spectrum> {
        let total =
            if photometric { cie::xyz_of(&shape, Observer::Cie1931)[1] } else { shape.integral(self.range.0, self.range.1) };
        let scaled = shape.scaled(amount / (factor * total));
        if !(total > 0.0 && factor > 0.0) {
            return Err(
                node.fail("the spectrum is dark where it is measured", "use a spectrum that shines within the film's range")
            );
        }
        self.check(node, &scaled, Place::Light)?;
        Ok(scaled)
    }
}
