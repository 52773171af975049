//! glTF materials as Abbe's: transmission becomes glass, metal a conductor, everything else diffuse; emission stays emission.
//!
//! Textures are not read and the glossy coat of non-metals is left out; the notes say so.

use super::json::Node;
use super::load::Loader;
use super::{Emission, Interior, Material};
use crate::color::cie;
use crate::error::Result;
use crate::spectrum::library::Observer;
use crate::spectrum::{Ior, Spectrum, upsample};

/// A material and what it emits.
#[derive(Clone)]
pub(super) struct Look {
    pub material: usize,
    pub emission: Option<Emission>,
}

/// Radiance, intensity or irradiance of a light whose linear RGB is photometric: (1, 1, 1) is D65 of 1 cd m^-2, cd or lx.
pub(super) fn photometric(node: &Node, rgb: [f64; 3], factor: f64) -> Result<Spectrum> {
    let spectrum = upsample::emission_from_linear_srgb(rgb).map_err(|problem| node.fail(problem, "use a colour of 0 or more"))?;
    Ok(spectrum.scaled(factor / cie::xyz_of_unit(Observer::Cie1931)[1]))
}

/// Adds the material that a primitive names (or the default, a grey diffuse one) to the scene.
pub(super) fn material(loader: &mut Loader, node: Option<&Node>) -> Result<Look> {
    let Some(node) = node else {
        loader.scene.materials.push(Material::Diffuse { reflectance: Spectrum::Constant(0.8) });
        return Ok(Look { material: loader.scene.materials.len() - 1, emission: None });
    };
    let extension = |name: &str| node.get("extensions").and_then(|e| e.get(name));
    let factor = |n: Option<Node>, key: &str, default: f64, most: f64| match n.and_then(|n| n.get(key)) {
        Some(v) => v.within(0.0, most),
        None => Ok(default),
    };
    let colour = |n: Option<&Node>, key: &str, default: [f64; 3]| -> Result<[f64; 3]> {
        let Some(value) = n.and_then(|n| n.get(key)) else { return Ok(default) };
        let items = value.array(3)?;
        let mut rgb = [0.0; 3];
        for (c, item) in rgb.iter_mut().zip(&items) {
            *c = item.within(0.0, 1.0)?;
        }
        Ok(rgb)
    };
    let pbr = node.get("pbrMetallicRoughness");
    let base = colour(pbr.as_ref(), "baseColorFactor", [1.0; 3])?;
    let metallic = factor(pbr.clone(), "metallicFactor", 1.0, 1.0)?;
    let roughness = factor(pbr.clone(), "roughnessFactor", 1.0, 1.0)?;
    // glTF's roughness is the square root of the GGX width; below 0.001 a surface is smooth here.
    let alpha = if roughness * roughness < 1e-3 { 0.0 } else { roughness * roughness };
    let transmission = factor(extension("KHR_materials_transmission"), "transmissionFactor", 0.0, 1.0)?;
    let textured =
        ["baseColorTexture", "metallicRoughnessTexture"].iter().any(|t| pbr.as_ref().is_some_and(|p| p.get(t).is_some()));
    if textured || ["normalTexture", "emissiveTexture"].iter().any(|t| node.get(t).is_some()) {
        loader.note(format!("{}: textures are ignored", node.file.display()));
    }
    let reflectance =
        |rgb| upsample::reflectance_from_linear_srgb(rgb).map_err(|problem| node.fail(problem, "use another colour"));
    let material = if transmission >= 0.5 {
        let ior = factor(extension("KHR_materials_ior"), "ior", 1.5, 10.0)?;
        let ior = if ior == 0.0 { 1.5 } else { ior }; // 0 is a glTF idiom for old shading models
        let dispersion = factor(extension("KHR_materials_dispersion"), "dispersion", 0.0, 100.0)?;
        let ior = Ior::from_abbe_number(ior.max(0.1), if dispersion > 0.0 { 20.0 / dispersion } else { f64::INFINITY });
        let (lo, hi) = loader.reader.range;
        ior.check_range(lo, hi).map_err(|problem| node.fail(problem, "use a smaller dispersion"))?;
        if base != [1.0; 3] {
            loader.note(format!(
                "{}: the surface tint of glass is ignored; use KHR_materials_volume to colour it",
                node.file.display()
            ));
        }
        let volume = extension("KHR_materials_volume")
            .filter(|v| v.get("thicknessFactor").is_some_and(|t| t.number().is_ok_and(|t| t > 0.0)));
        match volume {
            None => Material::ThinDielectric { ior },
            Some(volume) => {
                let interior = Interior {
                    ior,
                    priority: 1,
                    sigma_a: absorption(&volume, loader.reader.range, &colour)?,
                    ..Interior::vacuum("glass")
                };
                loader.scene.interiors.push(interior);
                Material::Dielectric { interior: loader.scene.interiors.len() - 1, alpha }
            }
        }
    } else if metallic >= 0.5 {
        // The index of a dielectric with the same reflectance at normal incidence: (n - 1)^2 / (n + 1)^2 = base, k = 0.
        let base = reflectance(base)?;
        let n_of = |f: f64| (1.0 + f.min(0.98).sqrt()) / (1.0 - f.min(0.98).sqrt());
        Material::Conductor { eta: sampled(loader.reader.range, |nm| n_of(base.eval(nm))), k: Spectrum::Constant(0.0), alpha }
    } else {
        Material::Diffuse { reflectance: reflectance(base)? }
    };
    loader.scene.materials.push(material);
    let material = loader.scene.materials.len() - 1;

    let emissive = colour(Some(node), "emissiveFactor", [0.0; 3])?;
    let strength = factor(extension("KHR_materials_emissive_strength"), "emissiveStrength", 1.0, 1e12)?;
    if emissive.iter().all(|v| *v * strength == 0.0) {
        return Ok(Look { material, emission: None });
    }
    let two_sided = node.get("doubleSided").map_or(Ok(false), |n| n.boolean())?;
    Ok(Look { material, emission: Some(Emission { radiance: photometric(node, emissive, strength)?, two_sided }) })
}

/// KHR_materials_volume: transmittance `attenuationColor` over `attenuationDistance` metres, as a coefficient in m^-1.
fn absorption(
    volume: &Node,
    range: (f64, f64),
    colour: &impl Fn(Option<&Node>, &str, [f64; 3]) -> Result<[f64; 3]>,
) -> Result<Spectrum> {
    let rgb = colour(Some(volume), "attenuationColor", [1.0; 3])?;
    let Some(distance) = volume.get("attenuationDistance") else { return Ok(Spectrum::Constant(0.0)) };
    let distance = distance.length()?;
    if rgb == [1.0; 3] {
        return Ok(Spectrum::Constant(0.0));
    }
    let colour = upsample::reflectance_from_linear_srgb(rgb).map_err(|problem| volume.fail(problem, "use another colour"))?;
    Ok(sampled(range, |nm| -colour.eval(nm).max(1e-6).ln() / distance))
}

/// A table every 5 nm.
fn sampled((lo, hi): (f64, f64), f: impl Fn(f64) -> f64) -> Spectrum {
    let steps = ((hi - lo) / 5.0).ceil().max(1.0) as u32;
    let nm: Vec<f64> = (0..=steps).map(|i| lo + (hi - lo) * f64::from(i) / f64::from(steps)).collect();
    let values = nm.iter().map(|&x| f(x)).collect();
    Spectrum::Table { nm, values, extend: true }
}
