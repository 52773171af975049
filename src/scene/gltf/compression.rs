//! Compressed meshes and buffers: what they stand for takes their place in the document before anything else looks at it, so that nothing else knows of
//! them. Draco is read by the `draco-core` crate, of which 4,000,000 changed streams brought out no panic.

use super::meshopt::{self, Filter};
use crate::error::{Result, quoted};
use crate::scene::json::Node;
use draco_core::{DecodeLimits, DecoderBuffer, MeshDecoder};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::Path;

/// The extensions that compress views of buffers.
pub(super) const MESHOPT: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];
const DRACO: &str = "KHR_draco_mesh_compression";

/// Triangles that Draco may make of any data, and how many more for each byte: what is all the same takes no room in it.
const TRIANGLES: u64 = 1 << 16;
const TRIANGLES_PER_BYTE: u64 = 256;
/// Bytes of attributes that a triangle explains.
const BYTES_PER_TRIANGLE: u64 = 256;

/// What all of a file may come to: so many times its buffers, but at least and at most so many bytes.
const EXPANSION: u64 = 256;
const LEAST_BYTES: u64 = 64 << 20;
const MOST_BYTES: u64 = 8 << 30;

/// A document whose compressed parts are being replaced.
struct Part<'p> {
    json: &'p mut Value,
    buffers: &'p mut Vec<Option<Vec<u8>>>,
    path: &'p Path,
    /// The mesh that was decoded last, by its view.
    mesh: Option<(u32, draco_core::Mesh)>,
    /// Accessors that were made.
    made: HashMap<Wanted, usize>,
    /// Bytes that may still be made.
    left: u64,
}

/// What of a Draco mesh, by its view, an accessor is to hold.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Wanted {
    Indices(u32),
    Attribute { view: u32, id: u32, components: usize, component_type: u32 },
}

/// Puts plain views, accessors and buffers in the place of compressed ones.
///
/// # Errors
/// Data that is damaged, or that stands for more than its size explains.
pub(super) fn undo(json: &mut Value, buffers: &mut Vec<Option<Vec<u8>>>, path: &Path) -> Result<()> {
    let size: usize = buffers.iter().flatten().map(Vec::len).sum();
    let left = MOST_BYTES.min((EXPANSION * size as u64).max(LEAST_BYTES));
    let mut part = Part { json, buffers, path, mesh: None, made: HashMap::new(), left };
    let count = |value: &Value| value.as_array().map_or(0, Vec::len);
    for i in 0..part.json.get("bufferViews").map_or(0, count) {
        part.view(i)?;
    }
    for mesh in 0..part.json.get("meshes").map_or(0, count) {
        for primitive in 0..part.json["meshes"][mesh].get("primitives").map_or(0, count) {
            part.primitive(mesh, primitive)?;
        }
    }
    Ok(())
}

impl Part<'_> {
    /// Replaces a view that meshoptimizer compressed.
    fn view(&mut self, i: usize) -> Result<()> {
        let root = Node::root(self.json, self.path);
        let Some(view) = root.get("bufferViews").and_then(|views| views.element(i)) else { return Ok(()) };
        let extensions = view.get("extensions");
        let Some(node) = MESHOPT.iter().find_map(|name| extensions.as_ref()?.get(name)) else { return Ok(()) };
        let number = |key: &str| node.need(key)?.integer(0, u32::MAX).map(|n| n as usize);
        let (count, stride) = (number("count")?, number("byteStride")?);
        let offset = node.get("byteOffset").map_or(Ok(0), |n| n.integer(0, u32::MAX))? as usize;
        let data = self.buffers.get(number("buffer")?).and_then(Option::as_deref);
        let data = data.and_then(|data| data.get(offset..offset.checked_add(number("byteLength").ok()?)?));
        let data = data.ok_or_else(|| node.fail("the compressed data reaches beyond its buffer", "export the file again"))?;
        let mode = node.need("mode")?.choice(&["ATTRIBUTES", "TRIANGLES", "INDICES"])?;
        let names = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];
        let filter = match node.get("filter").map_or(Ok("NONE"), |n| n.choice(&names))? {
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            "COLOR" => Filter::Color,
            _ => Filter::None,
        };
        let fits = if mode == "ATTRIBUTES" { filter.fits(stride) } else { filter == Filter::None && [2, 4].contains(&stride) };
        if !fits {
            return Err(node.fail(format!("no such data is of {stride} bytes"), "export the file again"));
        }
        let bytes = match mode {
            "ATTRIBUTES" => meshopt::attributes(data, count, stride).map(|mut elements| {
                filter.undo(&mut elements, stride);
                elements
            }),
            "TRIANGLES" => meshopt::triangles(data, count, stride),
            _ => meshopt::indices(data, count, stride),
        };
        let bytes = bytes.ok_or_else(|| node.fail("the compressed data is damaged", "export the file again"))?;
        self.left = self.left.checked_sub(bytes.len() as u64).ok_or_else(|| too_much(&node))?;
        let (length, buffer) = (bytes.len(), self.add_buffer(bytes));
        let view = &mut self.json["bufferViews"][i];
        view["buffer"] = json!(buffer);
        view["byteOffset"] = json!(0);
        view["byteLength"] = json!(length);
        forget(view, &MESHOPT);
        Ok(())
    }

    /// Replaces the attributes and indices of a primitive that Draco compressed.
    fn primitive(&mut self, mesh: usize, primitive: usize) -> Result<()> {
        let place = self.json["meshes"][mesh]["primitives"][primitive].clone();
        let node = Node { path: format!("$.meshes[{mesh}].primitives[{primitive}]"), ..Node::root(&place, self.path) };
        let Some(draco) = node.get("extensions").and_then(|e| e.get(DRACO)) else { return Ok(()) };
        let view = draco.need("bufferView")?.integer(0, u32::MAX)?;
        let mut attributes = Vec::new();
        for (name, id) in draco.need("attributes")?.entries()? {
            let accessor = node.need("attributes")?.need(name)?.integer(0, u32::MAX)? as usize;
            attributes.push((name, self.attribute(&draco, view, id.integer(0, u32::MAX)?, accessor)?));
        }
        let indices = self.made(&draco, Wanted::Indices(view), json!({"componentType": 5125, "type": "SCALAR"}))?;
        let place = &mut self.json["meshes"][mesh]["primitives"][primitive];
        for (name, accessor) in attributes {
            place["attributes"][name] = json!(accessor);
        }
        place["indices"] = json!(indices);
        // Whatever the mode was, these are triangles.
        place["mode"] = json!(4);
        forget(place, &[DRACO]);
        Ok(())
    }

    /// An accessor as `accessor`, which has no data, of attribute `id` in a Draco mesh.
    fn attribute(&mut self, draco: &Node, view: u32, id: u32, accessor: usize) -> Result<usize> {
        let root = Node::root(self.json, self.path);
        let like = root.need("accessors")?.element(accessor);
        let like = like.ok_or_else(|| draco.fail(format!("there is no accessor {accessor}"), "export the file again"))?;
        let component_type = like.need("componentType")?.integer(0, u32::MAX)?;
        if ![5120, 5121, 5122, 5123, 5125, 5126].contains(&component_type) {
            return Err(draco.fail(format!("{component_type} is no type of numbers"), "export the file again"));
        }
        let kinds = ["SCALAR", "VEC2", "VEC3", "VEC4"];
        let kind = like.need("type")?.choice(&kinds)?;
        let components = 1 + kinds.iter().position(|k| *k == kind).unwrap_or(0);
        let normalized = like.get("normalized").map_or(Ok(false), |n| n.boolean())?;
        let like = json!({"componentType": component_type, "type": kind, "normalized": normalized});
        self.made(draco, Wanted::Attribute { view, id, components, component_type }, like)
    }

    /// The number of an accessor of what is wanted, `like` this one.
    fn made(&mut self, draco: &Node, wanted: Wanted, mut like: Value) -> Result<usize> {
        if let Some(known) = self.made.get(&wanted) {
            return Ok(*known);
        }
        let (count, bytes) = match wanted {
            Wanted::Indices(view) => {
                let faces = self.draco(draco, view)?.faces();
                (3 * faces.len(), faces.iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect())
            }
            Wanted::Attribute { view, id, components, component_type } => {
                let mesh = self.draco(draco, view)?;
                let attribute = mesh.attribute_by_unique_id(id);
                let attribute = attribute
                    .ok_or_else(|| draco.fail(format!("the compressed mesh has no attribute {id}"), "export the file again"))?;
                let numbers = attribute.read_f32s(mesh.num_points(), components);
                (mesh.num_points(), bytes_of(&numbers, component_type))
            }
        };
        if count == 0 {
            return Err(draco.fail("the compressed mesh is empty", "export the file again"));
        }
        let length = bytes.len();
        self.left = self.left.checked_sub(length as u64).ok_or_else(|| too_much(draco))?;
        let buffer = self.add_buffer(bytes);
        let view = self.add("bufferViews", json!({"buffer": buffer, "byteLength": length}));
        like["bufferView"] = json!(view);
        like["count"] = json!(count);
        let accessor = self.add("accessors", like);
        self.made.insert(wanted, accessor);
        Ok(accessor)
    }

    /// The Draco mesh of a view.
    fn draco(&mut self, node: &Node, view: u32) -> Result<&draco_core::Mesh> {
        if self.mesh.as_ref().is_none_or(|(of, _)| *of != view) {
            let root = Node::root(self.json, self.path);
            let range = root.get("bufferViews").and_then(|views| views.element(view as usize)).ok_or_else(|| beyond(node))?;
            let number = |key: &str| range.get(key).map_or(Ok(0), |n| n.integer(0, u32::MAX)).map(|n| n as usize);
            let (offset, length) = (number("byteOffset")?, number("byteLength")?);
            let data = self.buffers.get(number("buffer")?).and_then(Option::as_deref);
            let data = data.and_then(|data| data.get(offset..offset.checked_add(length)?)).ok_or_else(|| beyond(node))?;
            let triangles = TRIANGLES + TRIANGLES_PER_BYTE * data.len() as u64;
            let limits = DecodeLimits::default().with_max_faces(triangles).with_max_decoded_bytes(BYTES_PER_TRIANGLE * triangles);
            let mut mesh = draco_core::Mesh::new();
            let decoded = MeshDecoder::new().decode(&mut DecoderBuffer::new(data).with_limits(limits), &mut mesh);
            decoded
                .map_err(|e| node.fail(format!("the compressed mesh: {}", quoted(&e.to_string())), "export the file again"))?;
            let points = mesh.num_points();
            if mesh.faces().iter().flatten().any(|point| point.0 as usize >= points) || points as u64 > 3 * triangles {
                return Err(node.fail("the compressed mesh is damaged", "export the file again"));
            }
            self.mesh = Some((view, mesh));
        }
        self.mesh.as_ref().map(|(_, mesh)| mesh).ok_or_else(|| beyond(node))
    }

    fn add_buffer(&mut self, bytes: Vec<u8>) -> usize {
        let buffer = self.add("buffers", json!({"byteLength": bytes.len()}));
        self.buffers.resize(buffer, None);
        self.buffers.push(Some(bytes));
        buffer
    }

    /// The number of an item that is added to one of the document's lists.
    fn add(&mut self, list: &str, item: Value) -> usize {
        match self.json[list].as_array_mut() {
            Some(items) => items.push(item),
            None => self.json[list] = json!([item]),
        }
        self.json[list].as_array().map_or(0, Vec::len) - 1
    }
}

fn too_much(node: &Node) -> crate::error::Error {
    node.fail("the compressed data comes to far more than its size explains", "export the file again")
}

fn beyond(node: &Node) -> crate::error::Error {
    node.fail("the compressed data reaches beyond its buffer", "export the file again")
}

/// Takes extensions away.
fn forget(value: &mut Value, names: &[&str]) {
    if let Some(extensions) = value.get_mut("extensions").and_then(Value::as_object_mut) {
        names.iter().for_each(|name| drop(extensions.remove(*name)));
    }
}

/// Numbers as bytes of a component type of glTF.
fn bytes_of(numbers: &[f32], component_type: u32) -> Vec<u8> {
    match component_type {
        5120 => numbers.iter().map(|v| *v as i8 as u8).collect(),
        5121 => numbers.iter().map(|v| *v as u8).collect(),
        5122 => numbers.iter().flat_map(|v| (*v as i16).to_le_bytes()).collect(),
        5123 => numbers.iter().flat_map(|v| (*v as u16).to_le_bytes()).collect(),
        5125 => numbers.iter().flat_map(|v| (*v as u32).to_le_bytes()).collect(),
        _ => numbers.iter().flat_map(|v| v.to_le_bytes()).collect(),
    }
}
