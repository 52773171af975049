//! Which extensions of glTF are read, and what is lost with those that are not.

use crate::error::{Result, quoted};
use crate::scene::json::Node;

/// What becomes of an extension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) enum Fate {
    /// It is read; what of it cannot be honoured is noted where a file has it.
    Read,
    /// It changes nothing of a picture of the scene as it stands.
    Harmless,
    /// It is not read, which is noted; a file that needs it is refused, with this remedy.
    Unread(&'static str),
}
use Fate::{Harmless, Read, Unread};

const PNG: &str = "export its pictures as PNG or JPEG";

/// All extensions that Abbe knows: the name, what it stands for, and what becomes of it.
pub(in crate::scene) const EXTENSIONS: &[(&str, &str, Fate)] = &[
    ("KHR_draco_mesh_compression", "meshes compressed by Draco", Read),
    ("EXT_meshopt_compression", "buffers compressed by meshoptimizer", Read),
    ("KHR_meshopt_compression", "buffers compressed by meshoptimizer", Read),
    ("KHR_lights_punctual", "point, spot and directional lights", Read),
    ("KHR_materials_anisotropy", "brushed metal and panes", Read),
    ("KHR_materials_clearcoat", "clear coats", Read),
    ("KHR_materials_diffuse_transmission", "light that comes through diffusely", Read),
    ("KHR_materials_dispersion", "dispersion", Read),
    ("KHR_materials_emissive_strength", "lamps", Read),
    ("KHR_materials_ior", "indices of refraction", Read),
    ("KHR_materials_iridescence", "thin films", Read),
    ("KHR_materials_pbrSpecularGlossiness", "materials by specular colour and glossiness", Read),
    ("KHR_materials_sheen", "sheen of cloth", Read),
    ("KHR_materials_specular", "strength and colour of specular reflection", Read),
    ("KHR_materials_transmission", "glass", Read),
    ("KHR_materials_unlit", "surfaces that are not lit", Read),
    ("KHR_materials_volume", "solid glass, and its absorption", Read),
    ("KHR_mesh_quantization", "positions and directions in whole numbers", Read),
    ("KHR_texture_transform", "pictures scaled, turned and moved", Read),
    ("EXT_texture_webp", "pictures in WebP", Read),
    ("EXT_mesh_gpu_instancing", "copies of meshes by lists of places", Read),
    ("KHR_node_visibility", "nodes that are not seen", Read),
    ("KHR_animation_pointer", "animations of any property", Harmless),
    ("KHR_materials_variants", "variants of materials, of which the first look counts", Harmless),
    ("KHR_node_hoverability", "what a pointer may hover over", Harmless),
    ("KHR_node_selectability", "what a pointer may select", Harmless),
    ("KHR_interactivity", "behaviour", Harmless),
    ("KHR_audio_emitter", "sound", Harmless),
    ("KHR_physics_rigid_bodies", "physics", Harmless),
    ("KHR_implicit_shapes", "shapes for physics", Harmless),
    ("KHR_xmp", "metadata", Harmless),
    ("KHR_xmp_json_ld", "metadata", Harmless),
    ("EXT_mesh_features", "identifiers of features", Harmless),
    ("EXT_instance_features", "identifiers of features", Harmless),
    ("EXT_structural_metadata", "metadata", Harmless),
    ("CESIUM_primitive_outline", "outlines", Harmless),
    ("FB_ngon_encoding", "polygons behind the triangles", Harmless),
    ("MSFT_lod", "levels of detail, of which the finest counts", Harmless),
    ("MSFT_screencoverage", "levels of detail", Harmless),
    ("MSFT_packing_normalRoughnessMetallic", "other packings of the same pictures", Harmless),
    ("MSFT_packing_occlusionRoughnessMetallic", "other packings of the same pictures", Harmless),
    ("KHR_texture_basisu", "pictures in KTX2", Unread(PNG)),
    ("EXT_texture_avif", "pictures in AVIF", Unread(PNG)),
    ("MSFT_texture_dds", "pictures in DDS", Unread(PNG)),
    ("EXT_lights_image_based", "light from pictures", Unread("put the picture into a scene as an \"image\" light")),
];

/// What an extension stands for, and what becomes of it.
pub(in crate::scene) fn about(name: &str) -> (&'static str, Fate) {
    let known = EXTENSIONS.iter().find(|(known, ..)| *known == name);
    known.map_or(("an extension that Abbe does not know", Unread("export it without")), |(_, what, fate)| (what, *fate))
}

/// Refuses a file that needs what cannot be read.
pub(in crate::scene) fn check_required(root: &Node) -> Result<()> {
    for extension in root.get("extensionsRequired").map_or(Ok(Vec::new()), |n| n.array(0))? {
        let name = extension.string()?;
        if let (what, Unread(remedy)) = about(name) {
            return Err(extension.fail(format!("the file needs {}: {what}, which cannot be read", quoted(name)), remedy));
        }
    }
    Ok(())
}

/// What is lost of the extensions that a file uses, a line for each.
pub(in crate::scene) fn losses(root: &Node) -> Result<Vec<String>> {
    let used = root.get("extensionsUsed").map_or(Ok(Vec::new()), |n| n.array(0))?;
    let names = used.iter().map(|n| n.string()).collect::<Result<Vec<_>>>()?;
    let lost = names.into_iter().map(|name| (name, about(name))).filter(|(_, (_, fate))| *fate != Read);
    Ok(lost.map(|(name, (what, _))| format!("{what}: ignored ({})", quoted(name))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::gltf::properties::{KINDS, Use};

    /// What is lost of an extension that is read.
    fn losses_of(kind: &str) -> Vec<&'static str> {
        let (_, known) = KINDS.iter().find(|(name, _)| *name == kind).copied().unwrap_or_default();
        let lost = |fate: &Use| match fate {
            Use::Lost(what) => vec![*what],
            Use::Object(kind) if *kind != "texture" => losses_of(kind),
            _ => Vec::new(),
        };
        known.iter().flat_map(|(_, fate)| lost(fate)).collect()
    }

    /// The table of scenes/README.md.
    fn table() -> String {
        let row = |(name, what, fate): &(&str, &str, Fate)| {
            let losses = losses_of(name).join(", ");
            let read = match fate {
                Read if losses.is_empty() => "yes".to_string(),
                Read => format!("yes, but for {losses}"),
                Harmless => "needs no reading".to_string(),
                Unread(remedy) => format!("no: {remedy}"),
            };
            format!("| `{name}` | {what} | {read} |\n")
        };
        let rows: String = EXTENSIONS.iter().map(row).collect();
        format!("| extension | what it brings | read |\n|---|---|---|\n{rows}")
    }

    #[test]
    fn the_guide_says_what_is_read() {
        let guide = include_str!("../../../scenes/README.md");
        let (_, rest) = guide.split_once("<!-- extensions of glTF -->\n").expect("the table's beginning");
        let (written, _) = rest.split_once("<!-- end of extensions -->").expect("its end");
        assert!(written == table(), "the table in scenes/README.md is to be:\n{}", table());
    }
}
