//! Meshes of a glTF file: a primitive's triangles in its own space.

use crate::color::upsample;
use crate::error::Result;
use crate::scene::Mesh;
use crate::scene::gltf::document::{Asset, element};
use crate::scene::gltf::pose::{Pose, check_count};
use crate::scene::gltf::texture::UvSets;
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use glam::{DVec2, DVec3, DVec4};
use gltf::accessor::Dimensions;
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};

/// The JSON of a mesh's primitive.
pub(in crate::scene) fn json<'a>(root: &Node<'a>, mesh: &gltf::Mesh, primitive: usize) -> Result<Node<'a>> {
    let mesh = element(root, "meshes", mesh.index())?;
    let found = mesh.need("primitives")?.element(primitive);
    found.ok_or_else(|| mesh.fail(format!("there is no primitive {primitive}"), "export the file again"))
}

/// The triangles of a primitive in its own space and in this pose, as a look needs it: with its sets of texture coordinates, with colours of
/// vertices if `coloured`, and with tangents if `combed`; none for points and lines.
pub(in crate::scene) fn triangles(
    loader: &mut Loader,
    asset: &Asset,
    root: &Node,
    primitive: &Primitive,
    uv_sets: UvSets,
    coloured: bool,
    combed: bool,
    pose: &Pose,
) -> Result<Option<Mesh>> {
    let mode = primitive.mode();
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        loader.note(format!("{}: points and lines are ignored", root.file.display()));
        return Ok(None);
    }
    let Some(positions) = primitive.get(&Semantic::Positions) else {
        loader.note(format!("{}: meshes without positions are ignored", root.file.display()));
        return Ok(None);
    };
    let vector = DVec3::from_array;
    let positions: Vec<DVec3> = asset.numbers(root, &positions)?.into_iter().map(vector).collect();
    let of_vertices = |semantic| {
        let accessor = primitive.get(&semantic);
        accessor.map(|accessor| check_count(root, &accessor, positions.len()).map(|()| accessor)).transpose()
    };
    let normals = match of_vertices(Semantic::Normals)? {
        Some(accessor) => asset.numbers(root, &accessor)?.into_iter().map(vector).collect(),
        None => Vec::new(),
    };
    let uvs = |set: u32| -> Result<Vec<DVec2>> {
        let Some(accessor) = of_vertices(Semantic::TexCoords(set))? else { return Ok(Vec::new()) };
        Ok(asset.numbers(root, &accessor)?.into_iter().map(DVec2::from_array).collect())
    };
    let more_uvs = if uv_sets.are_two() { uvs(uv_sets.0[1])? } else { Vec::new() };
    let uvs = uvs(uv_sets.0[0])?;
    let colors = match of_vertices(Semantic::Colors(0))?.filter(|_| coloured) {
        Some(accessor) => colors(loader, asset, root, &accessor)?,
        None => Vec::new(),
    };
    // Without normals, tangents do not count (glTF 2.0, 3.7.2.1).
    let tangents = match of_vertices(Semantic::Tangents)?.filter(|_| combed && !normals.is_empty()) {
        Some(accessor) => asset.numbers(root, &accessor)?.into_iter().map(DVec4::from_array).collect(),
        None => Vec::new(),
    };
    let indices: Vec<u32> = match primitive.indices() {
        Some(accessor) => {
            let indices = asset.indices(root, &accessor)?;
            if let Some(i) = indices.iter().find(|i| **i as usize >= positions.len()) {
                let node = element(root, "accessors", accessor.index())?;
                return Err(node.fail(format!("{i} is not among the {} vertices", positions.len()), "export the mesh again"));
            }
            indices
        }
        None => (0..positions.len() as u32).collect(),
    };
    let triangles = match mode {
        Mode::Triangles => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        Mode::TriangleStrip => {
            let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            indices.windows(3).enumerate().map(turned).collect()
        }
        _ => (2..indices.len()).map(|i| [indices[0], indices[i - 1], indices[i]]).collect(),
    };
    let mut mesh = Mesh { positions, normals, uvs, more_uvs, colors, tangents, triangles };
    pose.bend(&mut mesh, asset, root, primitive)?;
    Ok(Some(mesh))
}

/// Colours of vertices as spectra: coefficients of a sigmoid and a factor.
fn colors(loader: &mut Loader, asset: &Asset, root: &Node, accessor: &gltf::Accessor) -> Result<Vec<[f32; 4]>> {
    let rgb: Vec<[f64; 3]> = match accessor.dimensions() {
        Dimensions::Vec4 => {
            let rgba = asset.numbers::<4>(root, accessor)?;
            if rgba.iter().any(|c| c[3] < 1.0) {
                loader.note(format!("{}: the alpha of vertices is ignored", root.file.display()));
            }
            rgba.into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
        }
        _ => asset.numbers::<3>(root, accessor)?,
    };
    let texel = |rgb: [f64; 3]| {
        let ([c0, c1, c2], factor) = upsample::reflectance_texel(rgb.map(|v| if v.is_finite() { v } else { 1.0 }));
        [c0, c1, c2, factor].map(|v| v as f32)
    };
    Ok(rgb.into_iter().map(texel).collect())
}
