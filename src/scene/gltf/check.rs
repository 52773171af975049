//! What a glTF document must hold before the `gltf` crate may look at it: its accessors take indices, words and counts on trust. All is looked at in the
//! JSON, so that an error names its place.

use crate::error::Result;
use crate::scene::json::Node;
use serde_json::{Number, Value};

/// Where indices stand (`*` for every element or member), and which of the root's arrays they count in.
const INDICES: &[(&str, &str)] = &[
    ("accessors/*/bufferView", "bufferViews"),
    ("accessors/*/sparse/indices/bufferView", "bufferViews"),
    ("accessors/*/sparse/values/bufferView", "bufferViews"),
    ("bufferViews/*/buffer", "buffers"),
    ("bufferViews/*/extensions/EXT_meshopt_compression/buffer", "buffers"),
    ("bufferViews/*/extensions/KHR_meshopt_compression/buffer", "buffers"),
    ("meshes/*/primitives/*/attributes/*", "accessors"),
    ("meshes/*/primitives/*/indices", "accessors"),
    ("meshes/*/primitives/*/targets/*/*", "accessors"),
    ("meshes/*/primitives/*/material", "materials"),
    ("meshes/*/primitives/*/extensions/KHR_draco_mesh_compression/bufferView", "bufferViews"),
    ("nodes/*/camera", "cameras"),
    ("nodes/*/children/*", "nodes"),
    ("nodes/*/mesh", "meshes"),
    ("nodes/*/skin", "skins"),
    ("nodes/*/extensions/EXT_mesh_gpu_instancing/attributes/*", "accessors"),
    ("scene", "scenes"),
    ("scenes/*/nodes/*", "nodes"),
    ("skins/*/inverseBindMatrices", "accessors"),
    ("skins/*/joints/*", "nodes"),
    ("skins/*/skeleton", "nodes"),
    ("textures/*/sampler", "samplers"),
    ("textures/*/source", "images"),
    ("images/*/bufferView", "bufferViews"),
];

/// Whole numbers, and from where to where they go.
const COUNTS: &[(&str, [u32; 2])] = &[
    ("accessors/*/count", [1, u32::MAX]),
    ("accessors/*/byteOffset", [0, u32::MAX]),
    ("accessors/*/sparse/count", [1, u32::MAX]),
    ("accessors/*/sparse/indices/byteOffset", [0, u32::MAX]),
    ("accessors/*/sparse/values/byteOffset", [0, u32::MAX]),
    ("bufferViews/*/byteLength", [0, u32::MAX]),
    ("bufferViews/*/byteOffset", [0, u32::MAX]),
    ("bufferViews/*/byteStride", [0, u32::MAX]),
    ("buffers/*/byteLength", [0, u32::MAX]),
    ("meshes/*/primitives/*/mode", [0, 6]),
];

/// Numbers that stand for words, what they are, and which there are.
const WORDS: &[(&str, &str, &[u32])] = &[
    ("accessors/*/componentType", "component type", &[5120, 5121, 5122, 5123, 5125, 5126]),
    ("accessors/*/sparse/indices/componentType", "component type of indices", &[5121, 5123, 5125]),
    ("samplers/*/magFilter", "filter", &[9728, 9729]),
    ("samplers/*/minFilter", "filter", &[9728, 9729, 9984, 9985, 9986, 9987]),
    ("samplers/*/wrapS", "wrapping mode", &[33071, 33648, 10497]),
    ("samplers/*/wrapT", "wrapping mode", &[33071, 33648, 10497]),
];

/// Types of accessors.
const TYPES: &[&str] = &["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"];

/// Members that are null count as absent, whole numbers may be written with a fraction of 0.
pub(in crate::scene) fn normalize(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|_, v| !v.is_null());
            map.values_mut().for_each(normalize);
        }
        Value::Array(items) => items.iter_mut().for_each(normalize),
        Value::Number(n) => {
            if let Some(v) =
                n.as_f64().filter(|v| n.is_f64() && v.fract() == 0.0 && v.abs() < 1e15 && (*v != 0.0 || v.is_sign_positive()))
            {
                *n = Number::from(v as i64);
            }
        }
        _ => {}
    }
}

/// Refuses other versions than 2.0.
pub(in crate::scene) fn version(root: &Node) -> Result<()> {
    let asset = root.need("asset")?;
    let version = asset.need("version")?;
    let word = |n: &Node| n.value.as_str().map_or_else(|| n.value.to_string(), str::to_string);
    let remedy = "export the file as glTF 2.0";
    if !word(&version).starts_with("2.") && word(&version) != "2" {
        let number: String = word(&version).chars().filter(|c| c.is_ascii_digit() || *c == '.').take(8).collect();
        return Err(version.fail(format!("only glTF 2 can be read, and this is glTF {number}"), remedy));
    }
    if let Some(least) = asset.get("minVersion").filter(|n| !["2.0", "2"].contains(&word(n).as_str())) {
        return Err(least.fail("the file needs a newer reader than one of glTF 2.0", remedy));
    }
    Ok(())
}

/// Checks what indices, counts and words stand in the document.
pub(in crate::scene) fn document(root: &Node) -> Result<()> {
    for (path, list) in INDICES {
        let length = root.get(list).and_then(|l| l.value.as_array().map(Vec::len)).unwrap_or(0);
        each(root, path, &mut |node| {
            let i = node.integer(0, u32::MAX)?;
            if i as usize >= length {
                return Err(node.fail(format!("there is no element {i} in {list}"), "export the file again"));
            }
            Ok(())
        })?;
    }
    for (path, [least, most]) in COUNTS {
        each(root, path, &mut |node| node.integer(*least, *most).map(|_| ()))?;
    }
    for (path, what, known) in WORDS {
        each(root, path, &mut |node| {
            let word = node.integer(0, u32::MAX)?;
            if known.contains(&word) { Ok(()) } else { Err(node.fail(format!("unknown {what} {word}"), "export the file again")) }
        })?;
    }
    each(root, "accessors/*/type", &mut |node| node.choice(TYPES).map(|_| ()))?;
    tree(root)
}

/// Refuses nodes that are reached twice: in circles, from two parents, or as a root and a child.
fn tree(root: &Node) -> Result<()> {
    let mut seen = vec![false; root.get("nodes").and_then(|n| n.value.as_array().map(Vec::len)).unwrap_or(0)];
    let mut once = |node: Node| {
        let i = node.integer(0, u32::MAX)? as usize;
        if seen.get_mut(i).is_none_or(|seen| std::mem::replace(seen, true)) {
            return Err(node.fail(format!("node {i} is reached twice"), "export a tree of nodes"));
        }
        Ok(())
    };
    let scene = root.get("scene").map_or(Ok(0), |n| n.integer(0, u32::MAX))? as usize;
    if let Some(scene) = root.get("scenes").and_then(|s| s.element(scene)) {
        each(&scene, "nodes/*", &mut once)?;
    }
    each(root, "nodes/*/children/*", &mut once)
}

/// Calls `f` with every node that `path` leads to.
fn each<'a>(node: &Node<'a>, path: &str, f: &mut dyn FnMut(Node<'a>) -> Result<()>) -> Result<()> {
    let (step, rest) = path.split_once('/').map_or((path, None), |(step, rest)| (step, Some(rest)));
    let next = match (step, node.value) {
        ("*", Value::Object(_)) => node.entries()?.into_iter().map(|(_, n)| n).collect(),
        ("*", _) => node.array(0)?,
        (_, Value::Object(_)) => Vec::from_iter(node.get(step)),
        // The crate would take an array for an object's members in their order.
        _ => node.entries().map(|_| Vec::new())?,
    };
    next.into_iter().try_for_each(|n| match rest {
        Some(rest) => each(&n, rest, f),
        None => f(n),
    })
}
