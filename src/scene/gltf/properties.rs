//! Every property of glTF that Abbe knows, and what becomes of it. What a file has beyond them is said, and so is what is lost.

use crate::error::quoted;
use crate::scene::gltf::extensions::{Fate, about};
use crate::scene::json::Node;
use crate::scene::json::THICKEST_FILM;
use serde_json::Value;

/// What becomes of a property.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) enum Use {
    /// It is read; what of it cannot be honoured is noted by who reads it.
    Value,
    /// Likewise a number, or several, between these; what is beyond counts as the nearest.
    Within(f64, f64),
    /// An object of this kind, or several.
    Object(&'static str),
    /// It changes nothing of a picture.
    Nothing,
    /// It is lost: what it stands for.
    Lost(&'static str),
}
use Use::{Lost, Nothing, Object, Value as Read, Within};

const SHARE: Use = Within(0.0, 1.0);
const PICTURE: Use = Object("texture");

/// Kinds of objects, those of extensions by their names, and their properties but for `name`, `extensions` and `extras`.
pub(in crate::scene) const KINDS: &[(&str, &[(&str, Use)])] = &[
    (
        "material",
        &[
            ("pbrMetallicRoughness", Object("pbrMetallicRoughness")),
            ("normalTexture", PICTURE),
            ("occlusionTexture", Lost("pictures of occlusion (light finds out by itself)")),
            ("emissiveTexture", PICTURE),
            ("emissiveFactor", Within(0.0, 1e12)),
            ("alphaMode", Read),
            ("alphaCutoff", Within(0.0, 1e3)),
            ("doubleSided", Read),
        ],
    ),
    (
        "pbrMetallicRoughness",
        &[
            ("baseColorFactor", SHARE),
            ("baseColorTexture", PICTURE),
            ("metallicFactor", SHARE),
            ("roughnessFactor", SHARE),
            ("metallicRoughnessTexture", PICTURE),
        ],
    ),
    ("texture", &[("index", Read), ("texCoord", Read), ("scale", Read)]),
    ("KHR_texture_transform", &[("offset", Read), ("rotation", Read), ("scale", Read), ("texCoord", Read)]),
    ("KHR_materials_anisotropy", &[("anisotropyStrength", SHARE), ("anisotropyRotation", Read), ("anisotropyTexture", PICTURE)]),
    (
        "KHR_materials_clearcoat",
        &[
            ("clearcoatFactor", SHARE),
            ("clearcoatTexture", PICTURE),
            ("clearcoatRoughnessFactor", SHARE),
            ("clearcoatRoughnessTexture", PICTURE),
            ("clearcoatNormalTexture", PICTURE),
        ],
    ),
    (
        "KHR_materials_diffuse_transmission",
        &[
            ("diffuseTransmissionFactor", SHARE),
            ("diffuseTransmissionTexture", PICTURE),
            ("diffuseTransmissionColorFactor", SHARE),
            ("diffuseTransmissionColorTexture", PICTURE),
        ],
    ),
    ("KHR_materials_dispersion", &[("dispersion", Within(0.0, 100.0))]),
    ("KHR_materials_emissive_strength", &[("emissiveStrength", Within(0.0, 1e12))]),
    ("KHR_materials_ior", &[("ior", Read)]),
    (
        "KHR_materials_iridescence",
        &[
            ("iridescenceFactor", SHARE),
            ("iridescenceTexture", PICTURE),
            ("iridescenceIor", Within(1.0, 5.0)),
            ("iridescenceThicknessMinimum", Nothing), // without a picture of thickness
            ("iridescenceThicknessMaximum", Within(0.0, THICKEST_FILM)),
            ("iridescenceThicknessTexture", PICTURE),
        ],
    ),
    (
        "KHR_materials_pbrSpecularGlossiness",
        &[
            ("diffuseFactor", SHARE),
            ("diffuseTexture", PICTURE),
            ("specularFactor", SHARE),
            ("glossinessFactor", SHARE),
            ("specularGlossinessTexture", PICTURE),
        ],
    ),
    (
        "KHR_materials_sheen",
        &[
            ("sheenColorFactor", SHARE),
            ("sheenColorTexture", PICTURE),
            ("sheenRoughnessFactor", SHARE),
            ("sheenRoughnessTexture", PICTURE),
        ],
    ),
    (
        "KHR_materials_specular",
        &[
            ("specularFactor", SHARE),
            ("specularTexture", PICTURE),
            ("specularColorFactor", Read),
            ("specularColorTexture", PICTURE),
        ],
    ),
    ("KHR_materials_transmission", &[("transmissionFactor", SHARE), ("transmissionTexture", PICTURE)]),
    ("KHR_materials_unlit", &[]),
    (
        "KHR_materials_volume",
        &[
            ("thicknessFactor", Read),
            ("thicknessTexture", Nothing), // for renderers that do not trace the other side
            ("attenuationDistance", Read),
            ("attenuationColor", SHARE),
        ],
    ),
    (
        "light",
        &[
            ("color", Within(0.0, 1e12)),
            ("intensity", Within(0.0, 1e15)),
            ("type", Read),
            ("range", Lost("ranges of lights (light has none)")),
            ("spot", Object("spot")),
        ],
    ),
    ("spot", &[("innerConeAngle", Read), ("outerConeAngle", Read)]),
    ("KHR_lights_punctual", &[("light", Read), ("lights", Object("light"))]),
    (
        "node",
        &[
            ("camera", Read),
            ("children", Read),
            ("skin", Read),
            ("matrix", Read),
            ("mesh", Read),
            ("rotation", Read),
            ("scale", Read),
            ("translation", Read),
            ("weights", Read),
        ],
    ),
    ("KHR_node_visibility", &[("visible", Read)]),
    ("EXT_mesh_gpu_instancing", &[("attributes", Object("copies"))]),
    ("copies", &[("TRANSLATION", Read), ("ROTATION", Read), ("SCALE", Read)]),
    ("camera", &[("type", Nothing), ("perspective", Object("perspective")), ("orthographic", Object("orthographic"))]),
    ("perspective", &[("aspectRatio", Read), ("yfov", Read), ("znear", Nothing), ("zfar", Nothing)]),
    ("orthographic", &[("xmag", Read), ("ymag", Read), ("znear", Nothing), ("zfar", Nothing)]),
    ("mesh", &[("primitives", Object("primitive")), ("weights", Read)]),
    (
        "primitive",
        &[
            ("attributes", Object("attributes")),
            ("indices", Read),
            ("material", Read),
            ("mode", Read),
            ("targets", Object("target")),
        ],
    ),
    (
        "attributes",
        &[
            ("POSITION", Read),
            ("NORMAL", Read),
            ("TANGENT", Read),
            ("TEXCOORD_0", Read),
            ("TEXCOORD_1", Read),
            ("TEXCOORD_2", Read),
            ("TEXCOORD_3", Read),
            ("COLOR_0", Read),
            ("JOINTS_0", Read),
            ("WEIGHTS_0", Read),
            ("JOINTS_1", Read),
            ("WEIGHTS_1", Read),
        ],
    ),
    ("target", &[("POSITION", Read), ("NORMAL", Read), ("TANGENT", Read)]),
];

/// Members of the root whose elements are looked at as a whole; materials only where they are used.
const LISTS: &[(&str, &str)] = &[("nodes", "node"), ("cameras", "camera"), ("meshes", "mesh")];

/// Members of any object, of which nothing is lost.
const COMMON: &[&str] = &["name", "extensions", "extras"];

/// What is lost of a document but for its materials.
pub(in crate::scene) fn of_document(root: &Node) -> Vec<String> {
    let mut losses = Losses::default();
    for (list, kind) in LISTS {
        for node in root.get(list).and_then(|n| n.array(0).ok()).into_iter().flatten() {
            losses.object(&node, kind);
        }
    }
    losses.extensions(root);
    losses.0
}

/// What is lost of a material.
pub(in crate::scene) fn of_material(material: &Node) -> Vec<String> {
    let mut losses = Losses::default();
    losses.object(material, "material");
    losses.0
}

/// Lines that say what is lost, each once.
#[derive(Default)]
struct Losses(Vec<String>);

impl Losses {
    fn say(&mut self, line: String) {
        if !self.0.contains(&line) {
            self.0.push(line);
        }
    }

    fn object(&mut self, node: &Node, kind: &str) {
        let Some((_, known)) = KINDS.iter().find(|(name, _)| *name == kind) else { return };
        for (key, member) in node.entries().unwrap_or_default() {
            match known.iter().find(|(name, _)| *name == key).map(|(_, fate)| *fate) {
                // What begins with an underscore is the application's own.
                None if COMMON.contains(&key) || key.starts_with('_') => {}
                None => self.say(format!("{} in {kind}: ignored, Abbe does not know it", quoted(key))),
                Some(Lost(what)) => self.say(format!("{what}: ignored ({key})")),
                Some(Within(lo, hi)) => self.range(&member, key, lo, hi),
                Some(Object(kind)) if member.value.is_array() => {
                    member.array(0).unwrap_or_default().iter().for_each(|m| self.object(m, kind));
                }
                Some(Object(kind)) => self.object(&member, kind),
                Some(Read | Nothing) => {}
            }
        }
        self.extensions(node);
    }

    fn extensions(&mut self, node: &Node) {
        for (name, member) in node.get("extensions").and_then(|n| n.entries().ok()).into_iter().flatten() {
            match about(name) {
                (_, Fate::Read) => self.object(&member, name),
                (what, _) => self.say(format!("{what}: ignored ({})", quoted(name))),
            }
        }
    }

    /// Says which numbers are beyond `lo` to `hi` by more than rounding.
    fn range(&mut self, node: &Node, key: &str, lo: f64, hi: f64) {
        let numbers = match node.value {
            Value::Array(items) => items.iter().filter_map(Value::as_f64).collect(),
            value => Vec::from_iter(value.as_f64()),
        };
        let beyond = |v: &&f64| **v < lo - 1e-5 || **v > hi + 1e-5 * hi.abs();
        if let Some(v) = numbers.iter().find(beyond) {
            self.say(format!("{key}: {v} is beyond {lo} to {hi} and counts as the nearest"));
        }
        if key == "emissiveFactor" && numbers.iter().any(|v| *v > 1.0 + 1e-5) {
            self.say(format!("{key}: a factor above 1 counts as it is"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, Scene, load};
    use serde_json::json;
    use std::path::Path;

    /// For properties of a kind, where in the file of the tests an object of it stands, and another value for each than it has there.
    fn changes() -> Vec<(&'static str, &'static str, Value)> {
        let picture = json!({"index": 0});
        vec![
            (
                "material",
                "/materials/0",
                json!({"pbrMetallicRoughness": null, "normalTexture": null, "occlusionTexture": picture, "emissiveTexture": null,
                    "emissiveFactor": [1, 0, 0], "alphaMode": "BLEND", "alphaCutoff": 0.9, "doubleSided": null}),
            ),
            (
                "pbrMetallicRoughness",
                "/materials/0/pbrMetallicRoughness",
                json!({"baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": null, "metallicFactor": 0.7, "roughnessFactor": 0.2,
                    "metallicRoughnessTexture": null}),
            ),
            ("texture", "/materials/0/normalTexture", json!({"index": 1, "texCoord": 1, "scale": 1})),
            (
                "KHR_texture_transform",
                "/materials/0/normalTexture/extensions/KHR_texture_transform",
                json!({"offset": [0.5, 0], "rotation": 0.1, "scale": [2, 3], "texCoord": 1}),
            ),
            (
                "KHR_materials_anisotropy",
                "/materials/1/extensions/KHR_materials_anisotropy",
                json!({"anisotropyStrength": 0.7, "anisotropyRotation": 1, "anisotropyTexture": picture}),
            ),
            (
                "KHR_materials_clearcoat",
                "/materials/1/extensions/KHR_materials_clearcoat",
                json!({"clearcoatFactor": 0.5, "clearcoatTexture": picture, "clearcoatRoughnessFactor": 0.3, "clearcoatRoughnessTexture": picture,
                    "clearcoatNormalTexture": picture}),
            ),
            (
                "KHR_materials_diffuse_transmission",
                "/materials/3/extensions/KHR_materials_diffuse_transmission",
                json!({"diffuseTransmissionFactor": 0.5, "diffuseTransmissionTexture": picture, "diffuseTransmissionColorFactor": [1, 0, 0],
                    "diffuseTransmissionColorTexture": picture}),
            ),
            ("KHR_materials_dispersion", "/materials/2/extensions/KHR_materials_dispersion", json!({"dispersion": 0.6})),
            (
                "KHR_materials_emissive_strength",
                "/materials/0/extensions/KHR_materials_emissive_strength",
                json!({"emissiveStrength": 4}),
            ),
            ("KHR_materials_ior", "/materials/2/extensions/KHR_materials_ior", json!({"ior": 1.7})),
            (
                "KHR_materials_iridescence",
                "/materials/1/extensions/KHR_materials_iridescence",
                json!({"iridescenceFactor": 0.3, "iridescenceTexture": picture, "iridescenceIor": 1.5, "iridescenceThicknessMinimum": 50,
                    "iridescenceThicknessMaximum": 250, "iridescenceThicknessTexture": picture}),
            ),
            (
                "KHR_materials_pbrSpecularGlossiness",
                "/materials/4/extensions/KHR_materials_pbrSpecularGlossiness",
                json!({"diffuseFactor": [0.5, 0.3, 0.2, 1], "diffuseTexture": null, "specularFactor": [0.6, 0.5, 0.1], "glossinessFactor": 0.2,
                    "specularGlossinessTexture": null}),
            ),
            (
                "KHR_materials_sheen",
                "/materials/3/extensions/KHR_materials_sheen",
                json!({"sheenColorFactor": [0.5, 0.5, 0.5], "sheenColorTexture": picture, "sheenRoughnessFactor": 0.7, "sheenRoughnessTexture": picture}),
            ),
            (
                "KHR_materials_specular",
                "/materials/3/extensions/KHR_materials_specular",
                json!({"specularFactor": 0.7, "specularTexture": picture, "specularColorFactor": [1, 0, 0], "specularColorTexture": picture}),
            ),
            (
                "KHR_materials_transmission",
                "/materials/2/extensions/KHR_materials_transmission",
                json!({"transmissionFactor": 0.5, "transmissionTexture": picture}),
            ),
            (
                "KHR_materials_volume",
                "/materials/2/extensions/KHR_materials_volume",
                json!({"thicknessFactor": 0, "thicknessTexture": picture, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.5]}),
            ),
            (
                "light",
                "/extensions/KHR_lights_punctual/lights/1",
                json!({"color": [1, 0, 0], "intensity": 2, "type": "point", "range": 3, "spot": null}),
            ),
            ("spot", "/extensions/KHR_lights_punctual/lights/1/spot", json!({"innerConeAngle": 0.1, "outerConeAngle": 0.7})),
            ("KHR_lights_punctual", "/nodes/11/extensions/KHR_lights_punctual", json!({"light": 0})),
            ("KHR_lights_punctual", "/extensions/KHR_lights_punctual", json!({"lights": [{"type": "point"}, {"type": "point"}]})),
            (
                "node",
                "/nodes/1",
                json!({"mesh": 0, "rotation": [0, 0, 0, 1], "scale": [2, 2, 2], "translation": [9, 0, 0], "weights": [0.25]}),
            ),
            ("node", "/nodes/4", json!({"camera": 1})),
            ("node", "/nodes/2", json!({"skin": null})),
            ("node", "/nodes/0", json!({"children": []})),
            ("node", "/nodes/3", json!({"matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]})),
            ("KHR_node_visibility", "/nodes/9/extensions/KHR_node_visibility", json!({"visible": true})),
            ("EXT_mesh_gpu_instancing", "/nodes/3/extensions/EXT_mesh_gpu_instancing", json!({"attributes": null})),
            (
                "copies",
                "/nodes/3/extensions/EXT_mesh_gpu_instancing/attributes",
                json!({"TRANSLATION": null, "ROTATION": null, "SCALE": null}),
            ),
            ("camera", "/cameras/0", json!({"type": "orthographic", "perspective": {"yfov": 0.3}})),
            ("perspective", "/cameras/0/perspective", json!({"aspectRatio": 1, "yfov": 0.7, "znear": 0.2, "zfar": 3})),
            ("mesh", "/meshes/1", json!({"primitives": [{"attributes": {"POSITION": 0}}]})),
            (
                "primitive",
                "/meshes/1/primitives/0",
                json!({"attributes": {"POSITION": 0}, "indices": null, "material": null, "mode": 4, "targets": null}),
            ),
            (
                "attributes",
                "/meshes/0/primitives/0/attributes",
                json!({"POSITION": 1, "NORMAL": null, "TANGENT": null, "TEXCOORD_0": null}),
            ),
        ]
    }

    fn scene_of(document: &Value, name: &str) -> crate::error::Result<Scene> {
        // Tests of one process run side by side.
        let own = format!("{}-{:?}", std::process::id(), std::thread::current().id());
        let path = std::env::temp_dir().join(format!("abbe-property-{name}-{own}.gltf"));
        std::fs::write(&path, document.to_string()).expect("a place for the file");
        let scene = load(&path, &LoadOptions::default());
        std::fs::remove_file(&path).expect("the file");
        scene.map(|scene| Scene { source_hash: 0, sources: Vec::new(), name: String::new(), ..scene })
    }

    /// The scene without what is said of it, and what is said.
    fn seen(document: &Value) -> (String, String) {
        let scene = scene_of(document, "walk").unwrap_or_else(|e| panic!("{e}"));
        let said = [scene.notes.clone(), scene.warnings.clone()].concat().join("\n");
        (format!("{:?}", Scene { notes: Vec::new(), warnings: Vec::new(), ..scene }), said)
    }

    #[test]
    fn no_property_is_lost_without_a_note() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scenes/everything.gltf");
        let document: Value = serde_json::from_slice(&std::fs::read(path).expect("a file that ships")).expect("JSON");
        let (before, said_before) = seen(&document);
        let (mut tried, mut lost) = (Vec::new(), Vec::new());
        for (kind, place, values) in changes() {
            let (_, known) = KINDS.iter().find(|(name, _)| *name == kind).unwrap_or_else(|| panic!("{kind} is unknown"));
            for (key, value) in values.as_object().expect("an object") {
                let fate =
                    known.iter().find(|(name, _)| name == key).map(|(_, fate)| *fate).unwrap_or_else(|| panic!("{kind} {key}"));
                let mut changed = document.clone();
                let object = changed.pointer_mut(place).unwrap_or_else(|| panic!("{place}")).as_object_mut().expect("an object");
                object.insert(key.clone(), value.clone());
                let (after, said) = seen(&changed);
                let (used, noted) = (after != before, said != said_before || said.contains(&format!("ignored ({kind})")));
                let kept = match fate {
                    Nothing => !used,
                    Lost(_) => !used && said.contains(key.as_str()),
                    _ => used || noted,
                };
                if !kept {
                    lost.push(format!("{kind} {key}, {fate:?}: used {used}, noted {noted}"));
                }
                tried.push((kind, key.clone()));
            }
        }
        assert!(lost.is_empty(), "{lost:#?}");
        for (kind, known) in KINDS.iter().filter(|(kind, _)| !["orthographic", "target"].contains(kind)) {
            for (key, _) in *known {
                // Vertices' other sets, and weights of meshes, have tests of their own.
                let elsewhere = *kind == "attributes" && !["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0"].contains(key)
                    || [("mesh", "weights"), ("camera", "orthographic")].contains(&(kind, key));
                assert!(elsewhere || tried.contains(&(kind, key.to_string())), "{kind}: {key} was not tried");
            }
        }
    }

    #[test]
    fn what_abbe_does_not_know_is_said() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/scenes/everything.gltf");
        let document: Value = serde_json::from_slice(&std::fs::read(path).expect("a file that ships")).expect("JSON");
        for (place, key, value, says) in [
            (
                "/materials/2/extensions/KHR_materials_volume",
                "scatterFactor",
                json!(1),
                "\"scatterFactor\" in KHR_materials_volume: ignored",
            ),
            ("/materials/2/extensions", "VENDOR_new", json!({}), "does not know: ignored (\"VENDOR_new\")"),
            ("/nodes/0", "speed", json!(1), "\"speed\" in node: ignored"),
            ("/materials/1/pbrMetallicRoughness", "metallicFactor", json!(1.5), "metallicFactor: 1.5 is beyond 0 to 1"),
            ("/materials/0", "emissiveFactor", json!([2, 2, 2]), "a factor above 1 counts as it is"),
        ] {
            let mut changed = document.clone();
            let object = changed.pointer_mut(place).expect("a place").as_object_mut().expect("an object");
            object.insert(key.into(), value);
            let (_, said) = seen(&changed);
            assert_eq!(said.matches(says).count(), 1, "{key}: {said}");
        }
    }
}
