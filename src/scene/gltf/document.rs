//! The container and document of glTF 2.0 (Khronos 2021), and its buffers. The JSON is checked before the `gltf` crate sees it; of the crate's views
//! those of nodes, meshes, skins, accessors and samplers are used, all else is read from the JSON.

use crate::error::{Error, Result};
use crate::scene::gltf::{check, compression, extensions, uri};
use crate::scene::json::files::Files;
use crate::scene::json::{Node, parse};
use gltf::binary::{self, Glb};
use serde::Deserialize;
use serde::de::value::MapDeserializer;
use serde_json::Value;
use std::path::Path;

/// The members of the root that the crate gets to see.
const MEMBERS: &[&str] =
    &["asset", "accessors", "buffers", "bufferViews", "meshes", "nodes", "samplers", "scene", "scenes", "skins"];

/// An opened glTF file.
pub(in crate::scene) struct Asset {
    /// Its JSON, but for data URIs of buffers.
    pub json: Value,
    /// The same as the crate sees it.
    pub gltf: gltf::Document,
    /// The contents of its buffers; `None` for those that extensions fill.
    buffers: Vec<Option<Vec<u8>>>,
}

impl Asset {
    /// Reads a .glb or .gltf file and every buffer that it names.
    ///
    /// # Errors
    /// A damaged container, another version, a required extension that is not read, whatever [`check`] refuses, wrong types, buffers that are missing.
    pub(in crate::scene) fn open(path: &Path, mut bytes: Vec<u8>, files: &Files) -> Result<Self> {
        let (text, chunk) = split(path, &bytes)?;
        let text = std::str::from_utf8(text)
            .map_err(|_| Error::file(path, "the JSON of the glTF file is not UTF-8", "export the file again"))?;
        let mut json = parse(text.trim_end_matches(['\0', ' ']), path)?;
        // The text is not needed beside what it says: of a large file that is much.
        match &chunk {
            Some(chunk) => {
                bytes.truncate(chunk.end);
                bytes.drain(..chunk.start);
            }
            None => bytes = Vec::new(),
        }
        check::normalize(&mut json);
        let root = Node::root(&json, path);
        check::version(&root)?;
        extensions::check_required(&root)?;
        check::document(&root)?;
        let mut buffers = buffers(&root, chunk.map(|_| bytes), files)?;
        for buffer in json.get_mut("buffers").and_then(Value::as_array_mut).into_iter().flatten() {
            buffer.as_object_mut().and_then(|b| b.remove("uri"));
        }
        compression::undo(&mut json, &mut buffers, path)?;
        let gltf = document(&Node::root(&json, path))?;
        Ok(Asset { json, gltf, buffers })
    }

    /// The contents of a buffer.
    pub(in crate::scene) fn buffer(&self, buffer: &gltf::Buffer) -> Option<&[u8]> {
        self.buffers.get(buffer.index())?.as_deref()
    }

    /// The bytes of the buffer view that `index` names.
    pub(in crate::scene) fn bytes_of_view(&self, root: &Node, index: &Node) -> Result<&[u8]> {
        item(root, "bufferViews", index)?;
        let view = self.gltf.views().nth(index.integer(0, u32::MAX)? as usize);
        self.view(root, &view.ok_or_else(|| index.fail("there is no such view", "export the file again"))?)
    }

    /// The bytes of a buffer view.
    pub(in crate::scene) fn view(&self, root: &Node, view: &gltf::buffer::View) -> Result<&[u8]> {
        let node = element(root, "bufferViews", view.index())?;
        let buffer = self.buffer(&view.buffer());
        let buffer = buffer.ok_or_else(|| node.fail("its buffer has no data", "export the file again, as .glb"))?;
        let end = view.offset().checked_add(view.length());
        let bytes = end.and_then(|end| buffer.get(view.offset()..end));
        bytes.ok_or_else(|| node.fail("the view reaches beyond its buffer", "export the file again"))
    }
}

/// The JSON of a file, and where its binary chunk lies.
fn split<'b>(path: &Path, bytes: &'b [u8]) -> Result<(&'b [u8], Option<std::ops::Range<usize>>)> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let damaged = |problem: String| Error::file(path, problem, "export the file again");
    let length = bytes.get(8..12).and_then(|b| Some(u32::from_le_bytes(b.try_into().ok()?)));
    // The crate takes the header's own 12 bytes off the length.
    if length.is_none_or(|length| length < 12) {
        return Err(damaged("the .glb container is damaged".into()));
    }
    let glb = Glb::from_slice(bytes).map_err(|e| match e {
        gltf::Error::Binary(binary::Error::Version(version)) => {
            let problem = format!("only glTF 2 can be read, and this is a .glb of version {version}");
            Error::file(path, problem, "export the file as glTF 2.0")
        }
        other => damaged(format!("the .glb container is damaged ({other})")),
    })?;
    // Both are slices of the file.
    let at = |part: &[u8]| part.as_ptr() as usize - bytes.as_ptr() as usize;
    let part = |cow: &std::borrow::Cow<[u8]>| at(cow)..at(cow) + cow.len();
    Ok((&bytes[part(&glb.json)], glb.bin.as_ref().map(part)))
}

/// The contents of all buffers, the first of which may be the container's chunk.
fn buffers(root: &Node, mut chunk: Option<Vec<u8>>, files: &Files) -> Result<Vec<Option<Vec<u8>>>> {
    let mut buffers = Vec::new();
    for (i, node) in root.get("buffers").map_or(Ok(Vec::new()), |n| n.array(0))?.iter().enumerate() {
        // What is to stand in for compressed data is not needed.
        let extensions = node.get("extensions");
        let is_fallback =
            |name: &&str| extensions.as_ref().is_some_and(|e| e.get(name).is_some_and(|n| n.get("fallback").is_some()));
        let data = match node.get("uri").filter(|_| !compression::MESHOPT.iter().any(is_fallback)) {
            Some(uri) => Some(uri::read(&uri, files)?),
            None if i == 0 => chunk.take(),
            None => None,
        };
        let promised = node.need("byteLength")?.integer(0, u32::MAX)? as usize;
        if let Some(data) = data.as_ref().filter(|data| data.len() < promised) {
            return Err(node.fail(format!("{} bytes instead of {promised}", data.len()), "export the file again"));
        }
        buffers.push(data);
    }
    Ok(buffers)
}

/// The crate's view of a checked document.
fn document(root: &Node) -> Result<gltf::Document> {
    let members = root.value.as_object().into_iter().flatten().filter(|(key, _)| MEMBERS.contains(&key.as_str()));
    let members = MapDeserializer::new(members.map(|(key, value)| (key.as_str(), value)));
    let mut track = serde_path_to_error::Track::new();
    let read = gltf::json::Root::deserialize(serde_path_to_error::Deserializer::new(members, &mut track));
    let read: std::result::Result<_, serde_json::Error> = read;
    let json = read.map_err(|e| {
        let place = Node { path: format!("$.{}", track.path()), ..root.clone() };
        place.fail(e.to_string().replace('\n', " "), "export the file again")
    })?;
    Ok(gltf::Document::from_json_without_validation(json))
}

/// Element `i` of the root's array `list`.
pub(in crate::scene) fn element<'a>(root: &Node<'a>, list: &str, i: usize) -> Result<Node<'a>> {
    let found = root.get(list).and_then(|items| items.element(i));
    found.ok_or_else(|| root.fail(format!("there is no element {i} in {list}"), "export the file again"))
}

/// The element that `index` names in the root's array `list`.
pub(in crate::scene) fn item<'a>(root: &Node<'a>, list: &str, index: &Node) -> Result<Node<'a>> {
    let i = index.integer(0, u32::MAX)? as usize;
    let found = root.get(list).and_then(|items| items.element(i));
    found.ok_or_else(|| index.fail(format!("there is no element {i} in {list}"), "export the file again"))
}
