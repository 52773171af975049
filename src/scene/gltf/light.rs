//! KHR_lights_punctual: lights of a glTF file, and what a scene says of them instead:
//! `"lights": {"Spot": {"intensity": {"spectrum": {"file": "led.spd"}}, "profile": "lamp.ies"}}`.

use crate::color::cie;
use crate::error::{Result, quoted, suggest};
use crate::scene::gltf::document::item;
use crate::scene::gltf::material::photometric;
use crate::scene::json::load::{Loader, frame};
use crate::scene::json::spectra::Place;
use crate::scene::json::units::Source;
use crate::scene::json::{LARGEST_LENGTH, Node};
use crate::scene::light::spot_solid_angle;
use crate::scene::{Falloff, Light};
use crate::spectrum::library::Observer;
use glam::{DMat3, DMat4, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Least angle of a spot's outer cone, rad.
const NARROWEST: f64 = 2e-3;
/// Least difference of the cosines of a spot's cones that single precision tells apart.
const HARDEST: f64 = 1e-6;

/// The names that a light goes by: its node's and its own.
pub(in crate::scene) type Names<'a> = [Option<&'a str>; 2];

/// The light that a node carries, if it does.
pub(in crate::scene) fn carried<'a>(root: &Node<'a>, node: &Node<'a>) -> Result<Option<(Node<'a>, Names<'a>)>> {
    let punctual = node.get("extensions").and_then(|e| e.get("KHR_lights_punctual"));
    let Some(index) = punctual.and_then(|e| e.get("light")) else { return Ok(None) };
    let list = root.need("extensions")?.need("KHR_lights_punctual")?;
    let light = item(&list, "lights", &index)?;
    let names = [node, &light].map(|n| n.get("name").and_then(|name| name.value.as_str()));
    Ok(Some((light, names)))
}

/// Refuses what `said` says of lights that are not among those of these names.
pub(in crate::scene) fn check_names(said: &Node, names: &[Names]) -> Result<()> {
    let known = || names.iter().flatten().flatten().copied();
    for (name, node) in said.entries()? {
        node.object("relit")?;
        if !known().any(|n| n == name) {
            return Err(node.fail(format!("the file has no light {}", quoted(name)), suggest(name, known())));
        }
    }
    Ok(())
}

/// Where a node stands and which way its axes point.
pub(in crate::scene) fn pose(node: &Node, world: &DMat4) -> Result<(DVec3, DMat3)> {
    let m = DMat3::from_mat4(*world);
    let frame = frame(m.z_axis, m.y_axis)
        .filter(|f| f.is_finite() && world.w_axis.is_finite() && world.w_axis.abs().max_element() <= LARGEST_LENGTH);
    let frame = frame.ok_or_else(|| node.fail("its node has a singular transform", "export the file again"))?;
    Ok((world.w_axis.truncate(), frame))
}

/// A light, in candela or lux and along -Z of its node, with the spectrum, amount and distribution that `said` gives it instead.
pub(in crate::scene) fn light(loader: &Loader, node: &Node, world: &DMat4, said: Option<&Node>) -> Result<Light> {
    let (position, frame) = pose(node, world)?;
    let direction = -frame.z_axis;
    let rgb = node.get("color").map_or(Ok([1.0; 3]), |n| n.numbers())?.map(|c: f64| c.clamp(0.0, 1e12));
    let own = photometric(node, rgb, node.get("intensity").map_or(Ok(1.0), |n| Ok(n.number()?.clamp(0.0, 1e15)))?)?;
    loader.reader.check(node, &own, Place::Light)?;
    let amount = |key: &str, source| match said.filter(|s| s.get(key).is_some()) {
        Some(said) => loader.reader.light_by_file(said, key, source, cie::xyz_of(&own, Observer::Cie1931)[1]),
        None => Ok(own.clone()),
    };
    let kind = node.need("type")?.choice(&["point", "spot", "directional"])?;
    let misplaced: &[&str] = match kind {
        "point" => &["irradiance", "profile", "rotate_deg"],
        "spot" => &["irradiance"],
        _ => &["intensity", "profile", "rotate_deg"],
    };
    if let Some(key) = misplaced.iter().find_map(|key| said?.get(key)) {
        let remedy = "a point light has an intensity, a sun an irradiance, a spot an intensity and a profile";
        return Err(key.fail(format!("the light is of the kind {kind:?}, which has no such thing"), remedy));
    }
    Ok(match kind {
        "point" => Light::Point { position, intensity: amount("intensity", Source::Point(4.0 * PI))? },
        "spot" if let Some(said) = said.filter(|s| s.get("profile").is_some()) => loader.profile(said, position, direction)?,
        "spot" => {
            let angle = |key, default| {
                node.get("spot").and_then(|s| s.get(key)).map_or(Ok(default), |n| Ok(n.number()?.clamp(0.0, FRAC_PI_2)))
            };
            let (inner, outer) = (angle("innerConeAngle", 0.0)?, angle("outerConeAngle", std::f64::consts::FRAC_PI_4)?);
            if outer < NARROWEST {
                return Err(node.fail("the outer cone has no inside", "make outerConeAngle greater"));
            }
            // Cones that are the same have a hard edge.
            let (cos_inner, cos_outer) = (inner.cos().max(outer.cos() + HARDEST), outer.cos());
            let falloff = Falloff::Squared;
            let intensity = amount("intensity", Source::Point(spot_solid_angle(cos_inner, cos_outer, falloff)))?;
            Light::Spot { position, direction, intensity, cos_inner, cos_outer, falloff }
        }
        _ => Light::Sun { direction, cos_angle: 1.0, irradiance: amount("irradiance", Source::Distant)? },
    })
}
