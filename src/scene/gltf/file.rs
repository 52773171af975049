//! The container of glTF 2.0 (Khronos 2021): .glb or .gltf, its buffers, and accessors into them. Every size is checked before it is believed.

use crate::error::{Error, Result, quoted};
use crate::scene::json::files::Files;
use crate::scene::json::{Node, parse};
use serde_json::Value;
use std::path::Path;

/// An opened glTF file.
pub(in crate::scene) struct Asset {
    /// Its JSON.
    pub json: Value,
    /// The contents of its buffers.
    pub buffers: Vec<Vec<u8>>,
}

/// Reads a .glb or .gltf file and every buffer it names.
pub(in crate::scene) fn open(path: &Path, bytes: &[u8], files: &Files) -> Result<Asset> {
    let (text, mut chunk) = if bytes.starts_with(b"glTF") {
        glb(bytes).ok_or_else(|| Error::file(path, "the .glb container is damaged", "export the file again"))?
    } else {
        (bytes, None)
    };
    let text = std::str::from_utf8(text)
        .map_err(|_| Error::file(path, "the JSON of the glTF file is not UTF-8", "export the file again"))?;
    let json = parse(text.trim_end_matches(['\0', ' ']), path)?;
    let root = Node::root(&json, path);
    let version = root.need("asset")?.need("version")?;
    if !version.string()?.starts_with("2.") {
        return Err(version.fail("only glTF 2 can be read", "export the file as glTF 2.0"));
    }
    let mut buffers = Vec::new();
    for (i, node) in root.get("buffers").map_or(Ok(Vec::new()), |n| n.array(0))?.iter().enumerate() {
        let data = match node.get("uri") {
            Some(uri) => match uri.string()?.strip_prefix("data:") {
                Some(data) => decode_uri(data).ok_or_else(|| uri.fail("the data URI is not base64", "export the file again"))?,
                None => files.read_name(&uri, &percent_decoded(uri.string()?))?.1,
            },
            None if i == 0 => {
                chunk.take().ok_or_else(|| node.fail("the buffer has no data", "export the file again, as .glb"))?.to_vec()
            }
            None => return Err(node.fail("the buffer has no data", "export the file again")),
        };
        let promised = node.need("byteLength")?.integer(0, u32::MAX)? as usize;
        if data.len() < promised {
            return Err(node.fail(format!("{} bytes instead of {promised}", data.len()), "export the file again"));
        }
        buffers.push(data);
    }
    Ok(Asset { json, buffers })
}

/// JSON and binary chunk of a .glb.
fn glb(bytes: &[u8]) -> Option<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    let chunk = |at: usize, kind: &[u8]| -> Option<&[u8]> {
        let length = word(at)? as usize;
        if bytes.get(at + 4..at + 8)? != kind {
            return None;
        }
        bytes.get(at + 8..at.checked_add(8)?.checked_add(length)?)
    };
    if word(4)? != 2 {
        return None;
    }
    let json = chunk(12, b"JSON")?;
    let next = 20 + json.len().next_multiple_of(4);
    Some((json, chunk(next, b"BIN\0")))
}

/// The bytes of a base64 data URI without its `data:`.
pub(in crate::scene) fn decode_uri(data: &str) -> Option<Vec<u8>> {
    let (_, text) = data.split_once(";base64,")?;
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0u32);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    Some(out)
}

/// A URI's path as a file name.
pub(in crate::scene) fn percent_decoded(uri: &str) -> String {
    let mut out = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&byte, tail)) = rest.split_first() {
        let code = (byte == b'%').then(|| tail.get(..2)).flatten().and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(decoded) => {
                out.push(decoded);
                rest = &tail[2..];
            }
            None => {
                out.push(byte);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// The element that `index` names in the root's array `list`.
pub(in crate::scene) fn item<'a>(root: &Node<'a>, list: &str, index: &Node) -> Result<Node<'a>> {
    let i = index.integer(0, u32::MAX)? as usize;
    let found = root.get(list).and_then(|items| items.element(i));
    found.ok_or_else(|| index.fail(format!("there is no element {i} in {list}"), "export the file again"))
}

fn get(node: &Node, key: &str, default: usize) -> Result<usize> {
    node.get(key).map_or(Ok(default), |v| v.integer(0, u32::MAX).map(|v| v as usize))
}

/// A buffer view and its bytes.
pub(in crate::scene) fn view<'r, 'b>(root: &Node<'r>, buffers: &'b [Vec<u8>], index: &Node) -> Result<(Node<'r>, &'b [u8])> {
    let view = item(root, "bufferViews", index)?;
    let buffer_index = view.need("buffer")?;
    let buffer = buffers.get(buffer_index.integer(0, u32::MAX)? as usize);
    let buffer = buffer.ok_or_else(|| buffer_index.fail("there is no such buffer", "export the file again"))?;
    let (start, length) = (get(&view, "byteOffset", 0)?, view.need("byteLength")?.integer(0, u32::MAX)? as usize);
    let data = start.checked_add(length).and_then(|stop| buffer.get(start..stop));
    let data = data.ok_or_else(|| view.fail("the view reaches beyond its buffer", "export the file again"))?;
    Ok((view, data))
}

/// The numbers of an accessor of `N` components, normalised integers as the fractions they stand for.
pub(in crate::scene) fn accessor<const N: usize>(root: &Node, buffers: &[Vec<u8>], index: &Node) -> Result<Vec<[f64; N]>> {
    let node = item(root, "accessors", index)?;
    let wanted = match N {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        _ => "VEC4",
    };
    let kind = node.need("type")?;
    if kind.string()? != wanted {
        return Err(kind.fail(format!("{} where {wanted} is needed", quoted(kind.string()?)), "export the file again"));
    }
    let count = node.need("count")?.integer(0, u32::MAX)? as usize;
    let normalised = node.get("normalized").map_or(Ok(false), |n| n.boolean())?;
    let mut out = elements(root, buffers, &node, &node.need("componentType")?, count, normalised)?;
    if let Some(sparse) = node.get("sparse") {
        let count = sparse.need("count")?.integer(0, u32::MAX)? as usize;
        let (at, values) = (sparse.need("indices")?, sparse.need("values")?);
        let places = elements::<1>(root, buffers, &at, &at.need("componentType")?, count, false)?;
        let values = elements(root, buffers, &values, &node.need("componentType")?, count, normalised)?;
        for ([i], value) in places.into_iter().zip(values) {
            *out.get_mut(i as usize).ok_or_else(|| at.fail(format!("there is no element {i}"), "export the file again"))? = value;
        }
    }
    Ok(out)
}

/// `count` elements of `N` components from the view that `node` names.
fn elements<const N: usize>(
    root: &Node,
    buffers: &[Vec<u8>],
    node: &Node,
    component: &Node,
    count: usize,
    normalised: bool,
) -> Result<Vec<[f64; N]>> {
    let (size, largest) = match component.integer(0, u32::MAX)? {
        5120 => (1, 127.0),
        5121 => (1, 255.0),
        5122 => (2, 32767.0),
        5123 => (2, 65535.0),
        5125 => (4, 1.0),
        5126 => (4, 1.0),
        other => return Err(component.fail(format!("unknown component type {other}"), "export the file again")),
    };
    let read = |b: &[u8]| -> f64 {
        match (component.value.as_u64(), b) {
            (Some(5120), [a]) => f64::from(*a as i8),
            (Some(5121), [a]) => f64::from(*a),
            (Some(5122), [a, b]) => f64::from(i16::from_le_bytes([*a, *b])),
            (Some(5123), [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
            (Some(5125), [a, b, c, d]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (_, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => f64::NAN,
        }
    };
    let view_index = node.get("bufferView").ok_or_else(|| node.fail("the accessor has no data", "export the file again"))?;
    let (view, data) = view(root, buffers, &view_index)?;
    let width = size * N;
    let (offset, stride) = (get(node, "byteOffset", 0)?, get(&view, "byteStride", width)?.max(1));
    // usize is 64 bits wherever the products of two u32 could matter; elsewhere the checks fail safely.
    let end = count.checked_sub(1).map_or(Some(offset), |last| last.checked_mul(stride)?.checked_add(offset)?.checked_add(width));
    if end.is_none_or(|end| end > data.len()) {
        return Err(node.fail("the accessor reaches beyond its buffer", "export the file again"));
    }
    let factor = if normalised { 1.0 / largest } else { 1.0 };
    let element = |i: usize| {
        let at = offset + i * stride;
        std::array::from_fn(|k| {
            (read(&data[at + k * size..at + (k + 1) * size]) * factor).max(if normalised { -1.0 } else { f64::MIN })
        })
    };
    Ok((0..count).map(element).collect())
}
