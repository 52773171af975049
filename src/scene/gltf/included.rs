//! A glTF document as a part of a scene: its shapes, lights and camera.

use crate::error::Result;
use crate::scene::gltf::camera::sensor;
use crate::scene::gltf::document::{Asset, element, item};
use crate::scene::gltf::light::{Names, carried, check_names, light};
use crate::scene::gltf::material::{Look, material};
use crate::scene::gltf::mesh::{json, triangles};
use crate::scene::gltf::node::{Placed, is_flat, nodes, places, worlds};
use crate::scene::gltf::overrides::Overrides;
use crate::scene::gltf::pose::Pose;
use crate::scene::gltf::texture::Textures;
use crate::scene::gltf::{extensions, properties};
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use crate::scene::json::load::Loader;
use crate::scene::mesh::volume;
use crate::scene::{Geometry, IncludedMaterial, Mesh, Shape};
use glam::{DMat4, DVec2};
use gltf::{Primitive, Semantic};
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A glTF document with what was made of it already.
pub(in crate::scene) struct Document<'a> {
    path: PathBuf,
    files: Files,
    asset: Asset,
    overrides: Option<Overrides<'a>>,
    known: Known,
}

/// A glTF material or none, whether its glass is solid whatever the file says, and whether colours of vertices tint it.
type Key = (Option<usize>, bool, bool);

/// What of a document is read once, whatever refers to it.
#[derive(Default)]
struct Known {
    /// Looks of materials.
    looks: HashMap<Key, Look>,
    /// Triangles of a mesh's primitive, and the node whose pose they have if no other has it.
    meshes: HashMap<(usize, usize, Option<usize>), Option<Arc<Mesh>>>,
}

impl<'a> Document<'a> {
    pub(in crate::scene) fn open(path: &Path, bytes: Vec<u8>, files: Files) -> Result<Self> {
        let asset = Asset::open(path, bytes, &files)?;
        Ok(Document { path: path.to_path_buf(), files, asset, overrides: None, known: Known::default() })
    }

    /// Has it a material of an emissive strength above 1? Without one it was made for viewers that bring their own light.
    pub(in crate::scene) fn has_lamps(&self) -> bool {
        let strength = |m: &Value| m.pointer("/extensions/KHR_materials_emissive_strength/emissiveStrength")?.as_f64();
        let materials = self.asset.json.get("materials").and_then(Value::as_array);
        materials.is_some_and(|list| list.iter().any(|m| strength(m).is_some_and(|s| s > 1.0)))
    }

    /// Adds the document's scene under `world`; `said` is what the scene that includes it says of it, each time the same.
    pub(in crate::scene) fn add(&mut self, loader: &mut Loader, world: DMat4, said: Option<&Node<'a>>) -> Result<()> {
        let root = Node::root(&self.asset.json, &self.path);
        note_losses(loader, &root)?;
        let overrides = match self.overrides.take() {
            Some(known) => known,
            None => {
                said.and_then(|s| s.get("override")).map(|o| Overrides::read(loader, &o, &root)).transpose()?.unwrap_or_default()
            }
        };
        let relit = said.and_then(|s| s.get("lights"));
        let (asset, textures) = (&self.asset, Textures::new(&self.asset, &root, &self.files));
        let all = nodes(loader, asset, &root, world)?;
        let worlds = worlds(&all);
        let place = said.map(|node| node.path.clone());
        let mut part =
            Part { loader, asset, root: &root, place, textures, overrides: &overrides, known: &mut self.known, flat: 0 };
        let mut lights = Vec::new();
        for placed in &all {
            part.mesh(placed, &worlds)?;
            part.camera(placed)?;
            lights.extend(part.light(placed, relit.as_ref())?);
        }
        if let Some(relit) = &relit {
            check_names(relit, &lights)?;
        }
        if part.flat > 0 {
            part.note(&format!("{} triangles of no area were dropped", part.flat));
        }
        self.overrides = Some(overrides);
        Ok(())
    }
}

/// Notes what is ignored of the document as a whole.
fn note_losses(loader: &mut Loader, root: &Node) -> Result<()> {
    for lost in extensions::losses(root)?.into_iter().chain(properties::of_document(root)) {
        loader.note(format!("{}: {lost}", root.file.display()));
    }
    if root.get("animations").is_some() && loader.time.is_none() {
        loader.note(format!("{}: animations: all stands as the file has it at rest; --frames has it move", root.file.display()));
    }
    Ok(())
}

/// A document while it is being added to a scene.
struct Part<'r, 'd, 'a> {
    loader: &'r mut Loader,
    asset: &'d Asset,
    root: &'r Node<'d>,
    /// Where a scene includes it.
    place: Option<String>,
    textures: Textures<'r>,
    overrides: &'r Overrides<'a>,
    known: &'r mut Known,
    /// Triangles of no area so far.
    flat: usize,
}

impl<'d> Part<'_, 'd, '_> {
    fn note(&mut self, text: &str) {
        self.loader.note(format!("{}: {text}", self.root.file.display()));
    }

    /// Adds a shape for every primitive of a node's mesh, in every place where it is seen.
    fn mesh(&mut self, placed: &Placed, worlds: &HashMap<usize, DMat4>) -> Result<()> {
        let Some(mesh) = placed.gltf.mesh() else { return Ok(()) };
        let pose = Pose::of(self.asset, self.root, placed, worlds)?;
        let places = places(self.loader, self.asset, self.root, placed, &pose)?;
        // The mesh of a pose of its own is no other node's.
        let own = (pose.is_skinned() || placed.gltf.weights().is_some()).then_some(placed.gltf.index());
        for primitive in mesh.primitives().take(if places.is_empty() { 0 } else { usize::MAX }) {
            let node = json(self.root, &mesh, primitive.index())?;
            let index = node.get("material").map(|n| n.integer(0, u32::MAX)).transpose()?.map(|i| i as usize);
            let coloured = primitive.get(&Semantic::Colors(0)).is_some();
            let look = self.look((index, false, coloured))?;
            let key = (mesh.index(), primitive.index(), own);
            let triangles = match self.known.meshes.get(&key) {
                Some(known) => known.clone(),
                None => {
                    let read = self.triangles(&primitive, &look, &pose)?.map(Arc::new);
                    if own.is_none() {
                        self.known.meshes.insert(key, read.clone());
                    }
                    read
                }
            };
            let Some(triangles) = triangles else { continue };
            let look = self.thick(look, (index, true, coloured), &node, &triangles)?;
            let name = mesh.name().map_or_else(|| format!("$.meshes[{}]", mesh.index()), str::to_string);
            let name: String = name.chars().filter(|c| !c.is_control()).collect();
            for world in &places {
                let (geometry, dropped) = self.loader.place(&node, world, &Geometry::Mesh(triangles.clone()))?;
                self.flat += dropped;
                if matches!(&geometry, Geometry::Mesh(mesh) if mesh.triangles.is_empty()) {
                    continue;
                }
                let emission = match index.and_then(|i| self.overrides.emission(i)) {
                    Some(node) => Some(self.loader.emission(node, std::slice::from_ref(&geometry))?),
                    None => look.emission.clone(),
                };
                let shape = Shape { name: name.clone(), geometry, material: look.material, interior: None, emission };
                self.loader.push(&node, shape)?;
            }
        }
        Ok(())
    }

    /// The look of a material, or of none.
    fn look(&mut self, key: Key) -> Result<Look> {
        let (index, solid, coloured) = key;
        if let Some(look) = self.known.looks.get(&key) {
            return Ok(look.clone());
        }
        let default = Value::Object(Map::new());
        let node = match index {
            Some(index) => element(self.root, "materials", index)?,
            None => Node { file: self.root.file, path: "$.materials[default]".into(), value: &default },
        };
        let given = index.and_then(|i| self.overrides.material(i));
        let look = material(self.loader, &mut self.textures, &node, given, solid, coloured)?;
        let lost = if given.is_none() { properties::of_material(&node) } else { Vec::new() };
        if let (Some(place), Some(name)) = (&self.place, node.get("name").and_then(|n| n.value.as_str())) {
            let included = IncludedMaterial { place: place.clone(), name: name.into(), material: look.material };
            self.loader.scene.included.push(included);
        }
        for note in std::mem::take(&mut self.textures.notes).into_iter().chain(lost) {
            self.note(&note);
        }
        self.known.looks.insert(key, look.clone());
        Ok(look)
    }

    /// The look of a closed mesh of glass that has no thickness, as Blender writes it: solid if that was asked for, else it is warned of.
    fn thick(&mut self, look: Look, solid: Key, node: &Node, triangles: &Mesh) -> Result<Look> {
        let Some(name) = look.pane.as_ref().filter(|_| volume(triangles) != 0.0) else { return Ok(look) };
        if self.loader.solid_glass {
            return self.look(solid);
        }
        let text = format!(
            "the glass {name:?} on a closed mesh has no thickness (KHR_materials_volume), so that each face is a thin pane that refracts nothing; if the \
             body is solid, use --solid-glass, or set a thickness in the exporter (in Blender: Thickness of glTF Material Output)"
        );
        self.loader.reader.remarks.warn(node, &text);
        Ok(look)
    }

    /// The triangles of a primitive that looks like this, with texture coordinates if it has a picture.
    fn triangles(&mut self, primitive: &Primitive, look: &Look, pose: &Pose) -> Result<Option<Mesh>> {
        let coloured = primitive.get(&Semantic::Colors(0)).is_some();
        let combed = self.loader.scene.follows_tangents(look.material);
        let mesh = triangles(self.loader, self.asset, self.root, primitive, look.uv_sets, coloured, combed, pose)?;
        let Some(mut mesh) = mesh else { return Ok(None) };
        if self.loader.has_image(look.material, look.emission.as_ref()) {
            if mesh.uvs.is_empty() {
                mesh.uvs = vec![DVec2::ZERO; mesh.positions.len()];
                // Colours of vertices are a picture of one texel.
                if !coloured {
                    self.note("a textured mesh without texture coordinates shows one texel");
                }
            }
            if look.uv_sets.are_two() && mesh.more_uvs.is_empty() {
                mesh.more_uvs = vec![DVec2::ZERO; mesh.positions.len()];
                self.note("a textured mesh without texture coordinates shows one texel");
            }
        }
        Ok(Some(mesh))
    }

    /// Takes a node's camera, if there is none yet.
    fn camera(&mut self, placed: &Placed) -> Result<()> {
        let Some(camera) = placed.node.get("camera").filter(|_| !is_flat(&placed.world)) else { return Ok(()) };
        let (seen, aspect) = sensor(&item(self.root, "cameras", &camera)?, &placed.world)?;
        if self.loader.camera.is_none() {
            (self.loader.camera, self.loader.aspect) = (Some(seen), aspect);
        }
        Ok(())
    }

    /// Adds a node's light, of which a scene may say other things; the names it goes by.
    fn light(&mut self, placed: &Placed<'d>, relit: Option<&Node>) -> Result<Option<Names<'d>>> {
        let Some((lamp, names)) = carried(self.root, &placed.node)? else { return Ok(None) };
        if placed.hidden || is_flat(&placed.world) {
            self.note("lights that are hidden, or scaled to nothing, are left out");
            return Ok(Some(names));
        }
        let said = names.iter().flatten().find_map(|name| relit?.get(name));
        let light = light(self.loader, &lamp, &placed.world, said.as_ref())?;
        self.loader.scene.lights.push(light);
        Ok(Some(names))
    }
}
