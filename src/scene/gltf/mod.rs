//! glTF 2.0: as a scene by itself, as a part of a scene with its own materials, or as bare geometry.

mod accessor;
mod animation;
mod camera;
mod check;
mod compression;
mod document;
mod extensions;
mod included;
mod light;
mod material;
mod mesh;
mod meshopt;
mod node;
mod overrides;
mod pose;
mod properties;
mod studio;
mod texture;
mod uri;

use crate::error::Result;
use crate::scene::gltf::camera::framing;
use crate::scene::gltf::document::Asset;
use crate::scene::gltf::included::Document;
use crate::scene::gltf::material::photometric;
use crate::scene::gltf::mesh::triangles;
use crate::scene::gltf::node::{nodes, places, worlds};
use crate::scene::gltf::pose::Pose;
use crate::scene::gltf::studio::studio;
use crate::scene::gltf::texture::UvSets;
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use crate::scene::json::load::{LoadOptions, Loader, crop, film};
use crate::scene::json::shapes::MOST_TRIANGLES;
use crate::scene::mesh as meshes;
use crate::scene::{Interior, Light, Mesh};
use glam::DMat4;
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A glTF file as a scene: with a camera that frames everything where it has none, and daylight from everywhere where it has no light.
pub(in crate::scene) fn scene(path: &Path, bytes: Vec<u8>, files: Files, options: &LoadOptions) -> Result<Loader> {
    let nothing = Value::Null;
    let place = Node::root(&nothing, path);
    let film = film(None, &place, options)?;
    let mut loader = Loader::new(files, film);
    loader.solid_glass = options.solid_glass;
    loader.time = options.seconds(None);
    loader.named_volume(Interior::vacuum("surroundings"));
    loader.scene.max_depth = options.max_depth.unwrap_or(64).clamp(1, 100_000);
    let folder = path.parent().unwrap_or(Path::new("."));
    let files = loader.reader.files.within(folder);
    let at_rest = options.frame.map(|_| bytes.clone());
    let mut document = Document::open(path, bytes, files)?;
    document.add(&mut loader, DMat4::IDENTITY, None)?;
    if loader.scene.shapes.is_empty() {
        return Err(place.fail("the glTF file has no triangles in its scene", "export it with meshes"));
    }
    if let (Some(aspect), None) = (loader.aspect, options.width) {
        let film = &mut loader.scene.film;
        film.width = (f64::from(film.height) * aspect).round().clamp(1.0, 4096.0) as u32;
    }
    crop(&mut loader.scene.film, options)?;
    loader.scene.sensor = match loader.camera.take() {
        Some(camera) => camera,
        None => {
            loader.note("the glTF file has no camera: a default one frames the scene".into());
            match at_rest {
                // What moves does so before a camera that stands still.
                Some(bytes) => {
                    let options = LoadOptions { frame: None, ..options.clone() };
                    scene(path, bytes, Files::new(folder, options.allow_outside), &options)?.scene.sensor
                }
                None => framing(&loader.scene.shapes),
            }
        }
    };
    let glows = loader.scene.shapes.iter().any(|s| s.emission.is_some());
    if loader.scene.lights.is_empty() && !(glows && document.has_lamps()) {
        let glow = if glows { ", in which its emissive surfaces glow (lamps have an emissive strength above 1)" } else { "" };
        let light = if options.studio {
            loader.note(format!("the glTF file has no light: it stands in a soft studio{glow}"));
            studio()
        } else {
            loader.note(format!(
                "the glTF file has no light: daylight comes from everywhere{glow}; gloss shows better with --studio"
            ));
            // As bright as a white surface of emissive factor 1, as in viewers.
            Light::Constant { radiance: photometric(&place, [1.0; 3], 1.0)? }
        };
        loader.scene.lights.push(light);
    }
    Ok(loader)
}

/// The glTF documents that a scene has included so far, by file and what the scene says of them.
pub(in crate::scene) type Included<'a> = HashMap<(PathBuf, String), Document<'a>>;

/// Adds the glTF file that `node` names, with its materials, lights and camera, under `world`. A file that was added before is not read again, and its
/// meshes and materials are those of before.
pub(in crate::scene) fn include<'a>(
    loader: &mut Loader,
    node: &Node<'a>,
    included: &mut Included<'a>,
    world: DMat4,
) -> Result<()> {
    let file = node.need("file")?;
    let key = (loader.reader.files.base.join(file.string()?), node.value.to_string());
    let mut document = match included.remove(&key) {
        Some(known) => known,
        None => {
            let (path, bytes) = loader.reader.files.read(&file)?;
            Document::open(&path, bytes, loader.reader.files.within(path.parent().unwrap_or(Path::new("."))))?
        }
    };
    document.add(loader, world, Some(node))?;
    included.insert(key, document);
    Ok(())
}

/// All triangles of a glTF file's scene as one mesh.
pub(in crate::scene) fn mesh(loader: &mut Loader, file: &Node, path: &Path, bytes: Vec<u8>) -> Result<Mesh> {
    let files = loader.reader.files.within(path.parent().unwrap_or(Path::new(".")));
    let asset = Asset::open(path, bytes, &files)?;
    let root = Node::root(&asset.json, path);
    let mut whole = Mesh::default();
    let (mut smooth, mut textured) = (true, true);
    let all = nodes(loader, &asset, &root, DMat4::IDENTITY)?;
    for (placed, mesh) in all.iter().filter_map(|placed| Some((placed, placed.gltf.mesh()?))) {
        let pose = Pose::of(&asset, &root, placed, &worlds(&all))?;
        let places = places(loader, &asset, &root, placed, &pose)?;
        for (primitive, world) in mesh.primitives().flat_map(|p| places.iter().map(move |world| (p.clone(), world))) {
            let node = mesh::json(&root, &mesh, primitive.index())?;
            let Some(part) = triangles(loader, &asset, &root, &primitive, UvSets::default(), false, false, &pose)? else {
                continue;
            };
            let (part, _) = meshes::place(&part, world).map_err(|(problem, remedy)| node.fail(problem, remedy))?;
            let first = whole.positions.len() as u32;
            smooth &= !part.normals.is_empty();
            if whole.positions.len().max(whole.triangles.len()) > MOST_TRIANGLES {
                return Err(file.fail(format!("the mesh has more than {MOST_TRIANGLES} triangles"), "use a smaller mesh"));
            }
            whole.positions.extend(part.positions);
            textured &= !part.uvs.is_empty();
            whole.normals.extend(part.normals);
            whole.uvs.extend(part.uvs);
            whole.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        }
    }
    if whole.triangles.is_empty() {
        return Err(file.fail("the glTF file has no triangles in its scene", "export it with meshes"));
    }
    if !smooth {
        whole.normals.clear();
    }
    if !textured {
        whole.uvs.clear();
    }
    Ok(whole)
}
