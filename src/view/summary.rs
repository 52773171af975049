//! What pages are told of a document: what there is to look at and to change, and no more.

use super::document::{Document, get};
use super::pick::Met;
use super::picture::Picture;
use crate::color::convert::srgb_encode;
use crate::color::upsample::color_of_reflectance;
use crate::scene::{IncludedMaterial, Scene, Sensor};
use serde_json::{Value, json};

/// More lamps, or users of a material, are not listed.
const MOST_LISTED: usize = 200;

/// Of a scene.
pub fn of_scene(document: &Document, scene: &Scene) -> Value {
    let json = document.json();
    let materials: Vec<Value> = members(&json["materials"])
        .enumerate()
        .map(|(i, (name, value))| {
            let users = users(&json, name);
            json!({"name": name, "path": ["materials", name], "value": value, "used_by": users, "rgb": color_of(scene, i)})
        })
        .chain(of_included(scene, &json))
        .collect();
    let lamps: Vec<Value> = shapes(&json)
        .filter(|(_, shape)| shape["emission"].is_object())
        .map(|(i, shape)| {
            let path = ["shapes", &i.to_string(), "emission", "radiance"].map(str::to_string);
            json!({"name": name_of(i, shape), "kind": "surface", "path": path, "value": shape["emission"]["radiance"]})
        })
        .chain(json["lights"].as_array().into_iter().flatten().enumerate().filter_map(|(i, light)| {
            let (kind, inner) = light.as_object()?.iter().find(|(key, _)| !key.starts_with("//"))?;
            let key = ["radiance", "intensity", "irradiance", "power_W"].into_iter().find(|key| !inner[*key].is_null())?;
            let path = ["lights", &i.to_string(), kind, key].map(str::to_string);
            Some(json!({"name": format!("{kind} {}", i + 1), "kind": kind, "path": path, "value": inner[key]}))
        }))
        .take(MOST_LISTED)
        .collect();
    let (edits, undone) = document.edits();
    let is_camera = scene.sensor.area().is_none();
    // A lens says it by its focal length.
    let vfov = match scene.sensor {
        Sensor::Perspective { tan_half_vfov, .. } => Some(2.0 * tan_half_vfov.atan().to_degrees()),
        _ => None,
    };
    json!({
        "kind": "scene",
        "name": scene.name,
        "file": super::engine::file_name(document.path()),
        "film": {"width": scene.film.width, "height": scene.film.height},
        "camera": document.camera(scene),
        "vfov_deg": vfov,
        "movable": is_camera,
        "exposure": scene.film.exposure,
        "materials": materials,
        "lamps": lamps,
        "can_undo": edits > 0,
        "can_redo": undone > 0,
        "changed": document.is_changed(),
        "save_as": document.free_name(),
        "notes": scene.notes.iter().chain(&scene.warnings).collect::<Vec<_>>(),
    })
}

/// What a material looks like under white light, as sRGB.
fn color_of(scene: &Scene, material: usize) -> [f64; 3] {
    color_of_reflectance(|nm| scene.albedo(material, nm)[0]).map(|v| srgb_encode(v.clamp(0.0, 1.0)))
}

/// Of files.
pub fn of_files(pictures: &[Picture]) -> Value {
    let names: Vec<&str> = pictures.iter().map(|picture| picture.name.as_str()).collect();
    let [width, height] = pictures[0].size();
    json!({
        "kind": "files",
        "name": names.join("  ·  "),
        "file": names[0],
        "files": names,
        "film": {"width": width, "height": height},
        "movable": false,
        "exposure": pictures[0].exposure(),
        "materials": [],
        "lamps": [],
        "notes": [],
    })
}

/// What lies at a place of the picture.
pub fn met(json: &Value, scene: &Scene, met: &Met) -> Value {
    let shape = &scene.shapes[met.shape];
    // The scene's materials come first, in the file's order.
    let own = members(&json["materials"]).nth(shape.material).map(|(name, _)| vec!["materials".to_string(), name.clone()]);
    let included = || scene.included.iter().find(|m| m.material == shape.material).and_then(|m| path_of(m, json));
    let material = own.or_else(included);
    let lamp = shapes(json).find(|(i, s)| s["emission"].is_object() && name_of(*i, s) == shape.name).map(|(i, _)| i);
    json!({
        "shape": shape.name,
        "material": material,
        "lamp": lamp.filter(|_| shape.emission.is_some()).map(|i| ["shapes", &i.to_string(), "emission", "radiance"].map(str::to_string)),
        "at": met.at.to_array(),
        "distance": met.distance,
    })
}

/// Members of an object that are no comments.
fn members(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flatten().filter(|(key, _)| !key.starts_with("//"))
}

fn shapes(json: &Value) -> impl Iterator<Item = (usize, &Value)> {
    json["shapes"].as_array().into_iter().flatten().enumerate()
}

/// As the loader names a shape.
fn name_of(i: usize, shape: &Value) -> String {
    shape["name"].as_str().map_or_else(|| format!("shapes[{i}]"), |name| name.chars().filter(|c| !c.is_control()).collect())
}

/// Names of what a material is on, or in.
fn users(json: &Value, material: &str) -> Vec<String> {
    let on = shapes(json).filter(|(_, shape)| shape["material"] == material).map(|(i, shape)| name_of(i, shape));
    let in_groups = members(&json["groups"])
        .filter(|(_, group)| group.as_array().into_iter().flatten().any(|shape| shape["material"] == material))
        .map(|(name, _)| name.clone());
    let in_materials = members(&json["materials"]).filter(|(_, value)| names(value, material)).map(|(name, _)| name.clone());
    on.chain(in_groups).chain(in_materials).take(MOST_LISTED).collect()
}

/// Whether a material is made of another.
fn names(value: &Value, material: &str) -> bool {
    let parts = members(value).flat_map(|(_, inner)| ["of", "a", "b"].map(|key| &inner[key]));
    parts.into_iter().any(|part| part == material)
}

/// Materials of included glTF files, with what replaces them.
fn of_included(scene: &Scene, json: &Value) -> Vec<Value> {
    let mut entries: Vec<Value> = Vec::new();
    for included in &scene.included {
        let Some(path) = path_of(included, json) else { continue };
        if entries.len() < MOST_LISTED && !entries.iter().any(|entry| entry["path"] == json!(path)) {
            let (value, rgb) = (get(json, &path), color_of(scene, included.material));
            entries
                .push(json!({"name": included.name, "path": path, "value": value, "used_by": [], "included": true, "rgb": rgb}));
        }
    }
    entries
}

/// Where the document says what replaces a material of a glTF file; `None` where it may not be edited.
fn path_of(included: &IncludedMaterial, json: &Value) -> Option<Vec<String>> {
    let (i, _) = shapes(json).find(|(i, _)| included.place == format!("$.shapes[{i}].gltf"))?;
    Some(["shapes", &i.to_string(), "gltf", "override", &included.name].map(str::to_string).to_vec())
}
