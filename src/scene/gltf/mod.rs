//! glTF 2.0: as a scene by itself, as a part of a scene with its own materials, or as bare geometry.

mod file;
mod light;
mod material;
mod overrides;
mod texture;

use crate::error::{Result, quoted};
use crate::scene::bounds_of_all;
use crate::scene::gltf::file::{Asset, accessor, item, open};
use crate::scene::gltf::light::{carried, check_names, light, pose};
use crate::scene::gltf::material::{Look, material, photometric};
use crate::scene::gltf::overrides::Overrides;
use crate::scene::gltf::texture::Textures;
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use crate::scene::json::load::{LoadOptions, Loader, film};
use crate::scene::json::shapes::MOST_TRIANGLES;
use crate::scene::mesh as meshes;
use crate::scene::{Geometry, Interior, Light, Mesh, Sensor, Shape};
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Extensions that are honoured, or whose loss is noted where a material has them.
const EXTENSIONS: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];
/// Extensions that are not honoured: what they stand for, and what to do where the file needs them.
const UNREAD: &[(&str, &str, &str)] = &[
    ("KHR_draco_mesh_compression", "meshes compressed by Draco", "export it without compression"),
    ("EXT_meshopt_compression", "buffers compressed by meshoptimizer", "export it without compression"),
    ("KHR_meshopt_compression", "buffers compressed by meshoptimizer", "export it without compression"),
    ("KHR_texture_basisu", "pictures in KTX2", "export its pictures as PNG or JPEG"),
    ("EXT_texture_webp", "pictures in WebP", "export its pictures as PNG or JPEG"),
    ("EXT_texture_avif", "pictures in AVIF", "export its pictures as PNG or JPEG"),
    ("EXT_mesh_gpu_instancing", "copies of meshes by lists of places", "export it with a node for each copy"),
    ("KHR_materials_variants", "variants of materials, of which the first look counts", "export it with one look"),
    (
        "KHR_materials_pbrSpecularGlossiness",
        "materials by specular colour and glossiness",
        "export it with metallic and roughness",
    ),
];

/// What an extension that is not honoured stands for, and the remedy.
fn unread(extension: &str) -> (&'static str, &'static str) {
    let known = UNREAD.iter().find(|(name, ..)| *name == extension);
    known.map_or(("an extension that Abbe does not know", "export it without"), |(_, what, remedy)| (what, remedy))
}

/// Nodes may be nested this deep.
const DEEPEST_NODE: usize = 100;

/// A glTF file as a scene: with a camera that frames everything where it has none, and daylight from everywhere where it has no light.
pub(in crate::scene) fn scene(path: &Path, bytes: &[u8], files: Files, options: &LoadOptions) -> Result<Loader> {
    let nothing = Value::Null;
    let place = Node::root(&nothing, path);
    let film = film(None, &place, options)?;
    let mut loader = Loader::new(files, film);
    loader.named_volume(Interior::vacuum("surroundings"));
    loader.scene.max_depth = options.max_depth.unwrap_or(64).clamp(1, 100_000);
    let files = loader.reader.files.within(path.parent().unwrap_or(Path::new(".")));
    let mut document = Document::open(path, bytes, files)?;
    document.add(&mut loader, DMat4::IDENTITY, None)?;
    if loader.scene.shapes.is_empty() {
        return Err(place.fail("the glTF file has no triangles in its scene", "export it with meshes"));
    }
    if let (Some(aspect), None) = (loader.aspect, options.width) {
        let film = &mut loader.scene.film;
        film.width = (f64::from(film.height) * aspect).round().clamp(1.0, 4096.0) as u32;
    }
    loader.scene.sensor = match loader.camera.take() {
        Some(camera) => camera,
        None => {
            loader.note("the glTF file has no camera: a default one frames the scene".into());
            framing(&loader.scene.shapes)
        }
    };
    let glows = loader.scene.shapes.iter().any(|s| s.emission.is_some());
    if loader.scene.lights.is_empty() && !(glows && document.has_lamps()) {
        let glow = if glows { ", in which its emissive surfaces glow (lamps have an emissive strength above 1)" } else { "" };
        loader.note(format!("the glTF file has no light: daylight comes from everywhere{glow}"));
        // As bright as a white surface of emissive factor 1, as in viewers.
        loader.scene.lights.push(Light::Constant { radiance: photometric(&place, [1.0; 3], 1.0)? });
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
            Document::open(&path, &bytes, loader.reader.files.within(path.parent().unwrap_or(Path::new("."))))?
        }
    };
    document.add(loader, world, Some(node))?;
    included.insert(key, document);
    Ok(())
}

/// All triangles of a glTF file's scene as one mesh.
pub(in crate::scene) fn mesh(loader: &mut Loader, file: &Node, path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let files = loader.reader.files.within(path.parent().unwrap_or(Path::new(".")));
    let asset = open(path, bytes, &files)?;
    let root = Node::root(&asset.json, path);
    let mut whole = Mesh::default();
    let (mut smooth, mut textured) = (true, true);
    for placed in nodes(loader, &root, DMat4::IDENTITY)? {
        let Some(mesh) = placed.node.get("mesh") else { continue };
        for primitive in item(&root, "meshes", &mesh)?.need("primitives")?.array(1)? {
            let Some(part) = triangles(loader, &asset, &root, &primitive, 0)? else { continue };
            let (part, _) = meshes::place(&part, &placed.world).map_err(|(problem, remedy)| primitive.fail(problem, remedy))?;
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

/// A glTF document with what was made of it already.
pub(in crate::scene) struct Document<'a> {
    path: PathBuf,
    files: Files,
    asset: Asset,
    overrides: Option<Overrides<'a>>,
    looks: HashMap<Option<u32>, Look>,
    /// Triangles of a mesh's primitive.
    meshes: HashMap<(u32, usize), Option<Arc<Mesh>>>,
}

impl<'a> Document<'a> {
    fn open(path: &Path, bytes: &[u8], files: Files) -> Result<Self> {
        let asset = open(path, bytes, &files)?;
        let (looks, meshes) = (HashMap::new(), HashMap::new());
        Ok(Document { path: path.to_path_buf(), files, asset, overrides: None, looks, meshes })
    }

    /// Notes what is ignored, and refuses what cannot be.
    fn check(&self, loader: &mut Loader, root: &Node) -> Result<()> {
        for extension in root.get("extensionsRequired").map_or(Ok(Vec::new()), |n| n.array(0))? {
            let name = extension.string()?;
            if !EXTENSIONS.contains(&name) {
                let (what, remedy) = unread(name);
                return Err(extension.fail(format!("the file needs {}: {what}, which cannot be read", quoted(name)), remedy));
            }
        }
        for extension in root.get("extensionsUsed").map_or(Ok(Vec::new()), |n| n.array(0))? {
            let name = extension.string()?;
            if !EXTENSIONS.contains(&name) {
                loader.note(format!("{}: {}: ignored ({})", self.path.display(), unread(name).0, quoted(name)));
            }
        }
        for ignored in ["animations", "skins"] {
            if root.get(ignored).is_some() {
                loader.note(format!("{}: {ignored} are ignored", self.path.display()));
            }
        }
        let any_material_has = |key| (0..).map_while(|i| root.get("materials")?.element(i)).any(|m| m.get(key).is_some());
        if any_material_has("occlusionTexture") {
            loader.note(format!("{}: pictures of occlusion are ignored: light finds out by itself", self.path.display()));
        }
        Ok(())
    }

    /// Has it a material of an emissive strength above 1? Without one it was made for viewers that bring their own light.
    fn has_lamps(&self) -> bool {
        let strength = |m: &Value| m.pointer("/extensions/KHR_materials_emissive_strength/emissiveStrength")?.as_f64();
        let materials = self.asset.json.get("materials").and_then(Value::as_array);
        materials.is_some_and(|list| list.iter().any(|m| strength(m).is_some_and(|s| s > 1.0)))
    }

    /// Adds the document's scene under `world`; `said` is what the scene that includes it says of it, each time the same.
    fn add(&mut self, loader: &mut Loader, world: DMat4, said: Option<&Node<'a>>) -> Result<()> {
        let root = Node::root(&self.asset.json, &self.path);
        self.check(loader, &root)?;
        let mut textures = Textures::new(&self.asset, &root, &self.files);
        let overrides = match self.overrides.take() {
            Some(known) => known,
            None => {
                said.and_then(|s| s.get("override")).map(|o| Overrides::read(loader, &o, &root)).transpose()?.unwrap_or_default()
            }
        };
        let relit = said.and_then(|s| s.get("lights"));
        let (mut flat, mut light_names) = (0, Vec::new());
        for placed in nodes(loader, &root, world)? {
            if let Some(index) = placed.node.get("mesh") {
                let mesh = item(&root, "meshes", &index)?;
                let index = index.integer(0, u32::MAX)?;
                for (i, primitive) in mesh.need("primitives")?.array(1)?.into_iter().enumerate() {
                    let mut look = look(loader, &root, &primitive, &mut textures, &mut self.looks)?;
                    let part = match self.meshes.get(&(index, i)) {
                        Some(known) => known.clone(),
                        None => {
                            let part = part(loader, &self.asset, &root, &primitive, &look)?.map(Arc::new);
                            self.meshes.insert((index, i), part.clone());
                            part
                        }
                    };
                    let Some(part) = part else { continue };
                    let (geometry, dropped) = loader.place(&primitive, &placed.world, &Geometry::Mesh(part))?;
                    flat += dropped;
                    if let Some(index) = primitive.get("material") {
                        overrides.apply(loader, index.integer(0, u32::MAX)?, &mut look, &geometry)?;
                    }
                    let name = mesh.get("name").and_then(|n| n.value.as_str()).unwrap_or(&mesh.path);
                    let name = name.chars().filter(|c| !c.is_control()).collect();
                    loader.push(
                        &primitive,
                        Shape { name, geometry, material: look.material, interior: None, emission: look.emission },
                    )?;
                }
            }
            if let Some(camera) = placed.node.get("camera") {
                let camera = item(&root, "cameras", &camera)?;
                let seen = sensor(&camera, &placed.world)?;
                if loader.camera.is_none() {
                    let aspect = camera.get("perspective").and_then(|p| p.get("aspectRatio"));
                    loader.aspect = aspect.map(|a| a.within(1e-3, 1e3)).transpose()?;
                    loader.camera = Some(seen);
                }
            }
            if let Some((node, names)) = carried(&root, &placed.node)? {
                if node.get("range").is_some() {
                    loader.note(format!("{}: ranges of lights are ignored: light has none", self.path.display()));
                }
                let said = names.iter().flatten().find_map(|name| relit.as_ref()?.get(name));
                let light = light(loader, &node, &placed.world, said.as_ref())?;
                loader.scene.lights.push(light);
                light_names.push(names);
            }
        }
        if let Some(relit) = &relit {
            check_names(relit, &light_names)?;
        }
        if flat > 0 {
            loader.note(format!("{}: {flat} triangles of no area were dropped", self.path.display()));
        }
        self.overrides = Some(overrides);
        Ok(())
    }
}

/// The triangles of a primitive that looks like this, with texture coordinates if it has a picture.
fn part(loader: &mut Loader, asset: &Asset, root: &Node, primitive: &Node, look: &Look) -> Result<Option<Mesh>> {
    let Some(mut part) = triangles(loader, asset, root, primitive, look.uv_set)? else { return Ok(None) };
    if let (true, Some(node)) = (loader.scene.has_grain(look.material), primitive.need("attributes")?.get("TANGENT")) {
        part.tangents = accessor::<4>(root, &asset.buffers, &node)?.into_iter().map(DVec4::from_array).collect();
    }
    if part.uvs.is_empty() && loader.has_image(look.material, look.emission.as_ref()) {
        loader.note(format!("{}: a textured mesh without texture coordinates shows one texel", root.file.display()));
        part.uvs = vec![DVec2::ZERO; part.positions.len()];
    }
    Ok(Some(part))
}

struct Placed<'a> {
    node: Node<'a>,
    world: DMat4,
}

/// The nodes of the default scene with their transforms.
fn nodes<'a>(loader: &mut Loader, root: &Node<'a>, world: DMat4) -> Result<Vec<Placed<'a>>> {
    let all = root.get("nodes").map_or(Ok(Vec::new()), |n| n.array(0))?;
    let Some(scenes) = root.get("scenes") else { return Ok(Vec::new()) };
    let scene = match root.get("scene") {
        Some(index) => item(root, "scenes", &index)?,
        None => scenes.array(1)?.swap_remove(0),
    };
    let mut out = Vec::new();
    let mut seen = vec![false; all.len()];
    let mut waiting: Vec<(Node, DMat4, usize)> = Vec::new();
    for index in scene.get("nodes").map_or(Ok(Vec::new()), |n| n.array(0))?.into_iter().rev() {
        waiting.push((index, world, 0));
    }
    while let Some((index, parent, depth)) = waiting.pop() {
        loader.visit(&index)?;
        let i = index.integer(0, u32::MAX)? as usize;
        let (Some(node), Some(seen)) = (all.get(i), seen.get_mut(i)) else {
            return Err(index.fail(format!("{i} is not among the {} nodes", all.len()), "export the file again"));
        };
        if std::mem::replace(seen, true) || depth > DEEPEST_NODE {
            return Err(index.fail(format!("node {i} is reached twice, or nested too deeply"), "export a tree of nodes"));
        }
        let world = parent * local(node)?;
        for child in node.get("children").map_or(Ok(Vec::new()), |n| n.array(0))?.into_iter().rev() {
            waiting.push((child, world, depth + 1));
        }
        out.push(Placed { node: node.clone(), world });
    }
    Ok(out)
}

fn local(node: &Node) -> Result<DMat4> {
    if let Some(matrix) = node.get("matrix") {
        return Ok(DMat4::from_cols_array(&matrix.numbers()?));
    }
    let vector = |key, default| node.get(key).map_or(Ok(default), |n| n.numbers().map(DVec3::from_array));
    let rotation = node.get("rotation").map_or(Ok(DQuat::IDENTITY), |n| n.numbers().map(DQuat::from_array))?;
    let length = rotation.length();
    let rotation = if length > 0.0 && length.is_finite() { rotation / length } else { DQuat::IDENTITY };
    Ok(DMat4::from_scale_rotation_translation(vector("scale", DVec3::ONE)?, rotation, vector("translation", DVec3::ZERO)?))
}

/// The triangles of a primitive in its own space, with texture coordinates of this set; none for points and lines.
fn triangles(loader: &mut Loader, asset: &Asset, root: &Node, primitive: &Node, uv_set: u32) -> Result<Option<Mesh>> {
    let mode = primitive.get("mode").map_or(Ok(4), |n| n.integer(0, 6))?;
    if mode < 4 {
        loader.note(format!("{}: points and lines are ignored", root.file.display()));
        return Ok(None);
    }
    let attributes = primitive.need("attributes")?;
    let vectors = |node: &Node| -> Result<Vec<DVec3>> {
        Ok(accessor::<3>(root, &asset.buffers, node)?.into_iter().map(DVec3::from_array).collect())
    };
    let positions = vectors(&attributes.need("POSITION")?)?;
    let normals = attributes.get("NORMAL").map_or(Ok(Vec::new()), |n| vectors(&n))?;
    let uvs = match attributes.get(&format!("TEXCOORD_{uv_set}")) {
        Some(node) => accessor::<2>(root, &asset.buffers, &node)?.into_iter().map(DVec2::from_array).collect(),
        None => Vec::new(),
    };
    if attributes.get("COLOR_0").is_some() {
        loader.note(format!("{}: colours of vertices are ignored", root.file.display()));
    }
    let indices: Vec<u32> = match primitive.get("indices") {
        Some(node) => accessor::<1>(root, &asset.buffers, &node)?.into_iter().map(|[i]| i as u32).collect(),
        None => (0..positions.len() as u32).collect(),
    };
    let triangles = match mode {
        4 => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        5 => indices
            .windows(3)
            .enumerate()
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
            .collect(),
        _ => (2..indices.len()).map(|i| [indices[0], indices[i - 1], indices[i]]).collect(),
    };
    if primitive.get("targets").is_some() {
        loader.note(format!("{}: morph targets are ignored", root.file.display()));
    }
    Ok(Some(Mesh { positions, normals, uvs, tangents: Vec::new(), triangles }))
}

fn look(
    loader: &mut Loader,
    root: &Node,
    primitive: &Node,
    textures: &mut Textures,
    looks: &mut HashMap<Option<u32>, Look>,
) -> Result<Look> {
    let index = primitive.get("material");
    let key = index.as_ref().map(|n| n.integer(0, u32::MAX)).transpose()?;
    if let Some(look) = looks.get(&key) {
        return Ok(look.clone());
    }
    let node = index.map(|index| item(root, "materials", &index)).transpose()?;
    let look = material(loader, textures, node.as_ref())?;
    for note in textures.notes.drain(..) {
        loader.note(format!("{}: {note}", root.file.display()));
    }
    looks.insert(key, look.clone());
    Ok(look)
}

fn sensor(node: &Node, world: &DMat4) -> Result<Sensor> {
    let (eye, frame) = pose(node, world)?;
    if let Some(perspective) = node.get("perspective") {
        let half = 0.5 * perspective.need("yfov")?.within(1e-6, 3.13)?;
        return Ok(Sensor::Perspective { eye, frame, tan_half_vfov: half.tan(), lens_radius: 0.0, focus_distance: 1.0 });
    }
    let height = 2.0 * node.need("orthographic")?.need("ymag")?.length()?;
    Ok(Sensor::Orthographic { eye, frame, height })
}

/// A camera of 40 degrees, a little from above and the side, that sees all shapes (which here are meshes).
fn framing(shapes: &[Shape]) -> Sensor {
    let bounds = bounds_of_all(shapes);
    let (lo, hi) = (bounds.min, bounds.max);
    let radius = (0.5 * (hi - lo).length()).max(1e-9);
    let half = 20f64.to_radians();
    let backward = DVec3::new(0.4, 0.35, 1.0).normalize();
    let distance = 1.05 * radius / half.sin();
    let right = DVec3::Y.cross(backward).normalize();
    Sensor::Perspective {
        eye: 0.5 * (lo + hi) + backward * distance,
        frame: DMat3::from_cols(right, backward.cross(right), backward),
        tan_half_vfov: half.tan(),
        lens_radius: 0.0,
        focus_distance: distance,
    }
}
