//! Lights that are not shapes.

use crate::error::Result;
use crate::scene::json::Node;
use crate::scene::json::keys::Keys;
use crate::scene::json::load::Loader;
use crate::scene::json::units::Source;
use crate::scene::lamp;
use crate::scene::lamp::environment;
use crate::scene::lamp::profile::lamp_axes;
use crate::scene::lamp::sky;
use crate::scene::light::spot_solid_angle;
use crate::scene::{Falloff, Light};
use crate::spectrum::Spectrum;
use glam::DVec3;
use std::f64::consts::PI;

/// Kinds of light that are not shapes.
const LIGHTS: &[&str] = &["point", "spot", "beam", "laser", "sun", "constant", "image", "sky"];

/// Lasers of a greater radius were probably given in millimetres; m.
const WIDEST_LASER: f64 = 0.25;

/// The keys of lights.
pub(super) const KEYS: Keys = &[
    ("light", LIGHTS),
    ("point", &["position", "intensity"]),
    ("spot", &["position", "direction", "intensity", "inner_deg", "outer_deg", "profile", "rotate_deg"]),
    ("beam", &["origin", "direction", "radius", "irradiance"]),
    ("laser", &["origin", "direction", "radius", "power_W", "wavelength_nm", "width_nm"]),
    ("sun", &["direction", "angle_deg", "irradiance"]),
    ("constant", &["radiance"]),
    ("image", &["file", "scale", "bands", "transform"]),
    ("sky", &["turbidity", "elevation_deg", "azimuth_deg", "albedo", "scale", "sun"]),
];

impl Loader {
    /// Reads `lights`.
    pub(in crate::scene) fn lights(&mut self, root: &Node) -> Result<()> {
        let Some(lights) = root.get("lights") else { return Ok(()) };
        for node in lights.array(0)? {
            let lights = self.light(&node)?;
            self.scene.lights.extend(lights);
        }
        Ok(())
    }

    /// One light, or a sky with its Sun.
    fn light(&mut self, node: &Node) -> Result<Vec<Light>> {
        node.object("light")?;
        let (kind, inner) = node.one_of(LIGHTS)?;
        inner.object(kind)?;
        let amount = |key: &str, source| self.reader.light(&inner.need(key)?, source);
        Ok(vec![match kind {
            "sky" => return sky::lights(&self.reader, &inner),
            "point" => Light::Point {
                position: inner.need("position")?.point()?,
                intensity: amount("intensity", Source::Point(4.0 * PI))?,
            },
            "spot" if inner.get("profile").is_some() => {
                self.profile(&inner, inner.need("position")?.point()?, inner.need("direction")?.direction()?)?
            }
            "spot" => {
                let outer = inner.need("outer_deg")?;
                let outer_deg = outer.within(1e-3, 90.0)?;
                let inner_deg = inner.get("inner_deg").map_or(Ok(0.0), |n| n.within(0.0, 90.0))?;
                let [cos_inner, cos_outer] = [inner_deg, outer_deg].map(|d| d.to_radians().cos());
                if cos_inner <= cos_outer {
                    return Err(outer.fail(
                        format!("the cone ends at {outer_deg} degrees, and is full up to {inner_deg}"),
                        "give an outer_deg greater than inner_deg",
                    ));
                }
                Light::Spot {
                    position: inner.need("position")?.point()?,
                    direction: inner.need("direction")?.direction()?,
                    intensity: amount("intensity", Source::Point(spot_solid_angle(cos_inner, cos_outer, Falloff::Smooth)))?,
                    cos_inner,
                    cos_outer,
                    falloff: Falloff::Smooth,
                }
            }
            "beam" => {
                let radius = inner.need("radius")?.length()?;
                Light::Beam {
                    origin: inner.need("origin")?.point()?,
                    direction: inner.need("direction")?.direction()?,
                    radius,
                    irradiance: amount("irradiance", Source::Beam(PI * radius * radius))?,
                }
            }
            "laser" => {
                let radius = inner.need("radius")?.length()?;
                if radius > WIDEST_LASER {
                    let text =
                        format!("a laser beam {} m wide; lengths are metres: one of 1 mm has a radius of 0.0005", 2.0 * radius);
                    self.reader.remarks.warn(&inner, &text);
                }
                let width_nm = inner.get("width_nm").map_or(Ok(0.1), |n| n.within(1e-3, 1000.0))?;
                let wavelength = inner.need("wavelength_nm")?;
                let center_nm = wavelength.wavelength()?;
                let (lo, hi) = self.reader.range;
                if center_nm + 0.5 * width_nm <= lo || center_nm - 0.5 * width_nm >= hi {
                    return Err(wavelength.fail(
                        format!("the line at {center_nm} nm lies outside the film's {lo} to {hi} nm"),
                        "widen film.range_nm or choose another line",
                    ));
                }
                let irradiance = inner.need("power_W")?.non_negative()? / (PI * radius * radius);
                let irradiance = Spectrum::Band { center_nm, width_nm, height: irradiance / width_nm };
                self.reader.check(&inner, &irradiance, crate::scene::json::spectra::Place::Light)?;
                Light::Beam {
                    origin: inner.need("origin")?.point()?,
                    direction: inner.need("direction")?.direction()?,
                    radius,
                    irradiance,
                }
            }
            "sun" => {
                // The full apparent diameter; the cosine of a half-angle below 1e-8 rad rounds to 1, which means parallel light.
                let angle = inner.get("angle_deg").map_or(Ok(0.53), |n| n.within(0.0, 179.0))?;
                Light::Sun {
                    direction: inner.need("direction")?.direction()?,
                    cos_angle: (0.5 * angle).to_radians().cos(),
                    irradiance: amount("irradiance", Source::Distant)?,
                }
            }
            "constant" => Light::Constant { radiance: amount("radiance", Source::Everywhere)? },
            _ => environment::image(&self.reader, &inner)?,
        }])
    }
}

impl Loader {
    /// A spot whose distribution comes from a file, and with it the amount of its light unless the scene gives one.
    pub(in crate::scene) fn profile(&self, node: &Node, position: DVec3, direction: DVec3) -> Result<Light> {
        if let Some(angle) = node.get("inner_deg").or_else(|| node.get("outer_deg")) {
            return Err(angle.fail("the profile says how far the light spreads", "leave out inner_deg and outer_deg"));
        }
        let profile = lamp::read(&self.reader, &node.need("profile")?, direction)?;
        let rotation = node.get("rotate_deg").map_or(Ok(0.0), |n| n.within(-360.0, 360.0))?.to_radians();
        let source = Source::Point(profile.solid_angle());
        Ok(Light::Profile {
            position,
            axes: lamp_axes(direction, rotation),
            intensity: self.reader.light_by_file(node, "intensity", source, profile.peak_cd())?,
            profile,
        })
    }
}
