//! The nodes of a glTF scene: where they stand, and what of them is there.

use crate::error::Result;
use crate::scene::gltf::animation::{Moved, motion};
use crate::scene::gltf::document::{Asset, element};
use crate::scene::gltf::pose::Pose;
use crate::scene::json::Node;
use crate::scene::json::load::Loader;
use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::scene::Transform;
use std::collections::HashMap;

/// A node in the world.
pub(in crate::scene) struct Placed<'a> {
    /// As the crate sees it.
    pub gltf: gltf::Node<'a>,
    /// Its JSON.
    pub node: Node<'a>,
    /// From its space to the world.
    pub world: DMat4,
    /// It, or a node above it, is not to be seen (KHR_node_visibility).
    pub hidden: bool,
}

/// The nodes of the default scene under `world`, each after its parent.
pub(in crate::scene) fn nodes<'a>(
    loader: &mut Loader,
    asset: &'a Asset,
    root: &Node<'a>,
    world: DMat4,
) -> Result<Vec<Placed<'a>>> {
    let scene = asset.gltf.default_scene().or_else(|| asset.gltf.scenes().next());
    let Some(scene) = scene else { return Ok(Vec::new()) };
    let motion = loader.time.map(|seconds| motion(asset, root, seconds)).transpose()?.unwrap_or_default();
    motion.notes.iter().for_each(|note| loader.note(format!("{}: {note}", root.file.display())));
    let mut waiting: Vec<(gltf::Node, DMat4, bool)> = scene.nodes().map(|n| (n, world, false)).collect();
    waiting.reverse();
    let mut out = Vec::new();
    while let Some((gltf, parent, hidden)) = waiting.pop() {
        let node = element(root, "nodes", gltf.index())?;
        loader.visit(&node)?;
        let world = parent * local(&gltf, motion.nodes.get(&gltf.index()));
        if !world.is_finite() {
            return Err(node.fail("its place in the world is not finite", "export the file again"));
        }
        let visibility = node.get("extensions").and_then(|e| e.get("KHR_node_visibility")?.get("visible"));
        let hidden = hidden || !visibility.map_or(Ok(true), |v| v.boolean())?;
        let first = waiting.len();
        waiting.extend(gltf.children().map(|child| (child, world, hidden)));
        waiting[first..].reverse();
        out.push(Placed { gltf, node, world, hidden });
    }
    Ok(out)
}

/// Where nodes stand, by their numbers.
pub(in crate::scene) fn worlds(all: &[Placed]) -> HashMap<usize, DMat4> {
    all.iter().map(|placed| (placed.gltf.index(), placed.world)).collect()
}

/// Where a node's mesh is to be seen.
pub(in crate::scene) fn places(
    loader: &mut Loader,
    asset: &Asset,
    root: &Node,
    placed: &Placed,
    pose: &Pose,
) -> Result<Vec<DMat4>> {
    if placed.hidden {
        loader.note(format!("{}: what is hidden is left out (KHR_node_visibility)", root.file.display()));
        return Ok(Vec::new());
    }
    if pose.is_skinned() {
        return Ok(vec![DMat4::IDENTITY]);
    }
    let mut copies = copies(loader, asset, root, placed)?;
    let all = copies.len();
    copies.retain(|world| !is_flat(world));
    if copies.len() < all {
        loader.note(format!("{}: what is scaled to nothing, or flat, is left out", root.file.display()));
    }
    Ok(copies)
}

/// Where copies of a node's mesh stand: one under the node, or as many as EXT_mesh_gpu_instancing has places.
fn copies(loader: &mut Loader, asset: &Asset, root: &Node, placed: &Placed) -> Result<Vec<DMat4>> {
    let instancing = placed.node.get("extensions").and_then(|e| e.get("EXT_mesh_gpu_instancing"));
    let Some(attributes) = instancing.and_then(|i| i.get("attributes")) else { return Ok(vec![placed.world]) };
    let accessor = |key: &str| -> Result<Option<gltf::Accessor>> {
        let Some(index) = attributes.get(key) else { return Ok(None) };
        Ok(asset.gltf.accessors().nth(index.integer(0, u32::MAX)? as usize))
    };
    let vectors = |key: &str| accessor(key)?.map(|a| asset.numbers::<3>(root, &a)).transpose();
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = accessor("ROTATION")?.map(|a| asset.numbers::<4>(root, &a)).transpose()?;
    let lengths = [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
    let Some(count) = lengths.iter().flatten().next().copied() else { return Ok(vec![placed.world]) };
    if lengths.iter().flatten().any(|length| *length != count) {
        return Err(attributes.fail("lists of different lengths", "export the file again"));
    }
    let vector = |list: &Option<Vec<[f64; 3]>>, i: usize, default| list.as_ref().map_or(default, |l| DVec3::from_array(l[i]));
    let place = |i: usize| {
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |r| unit(DQuat::from_array(r[i])));
        let (scale, translation) = (vector(&scales, i, DVec3::ONE), vector(&translations, i, DVec3::ZERO));
        placed.world * DMat4::from_scale_rotation_translation(scale, rotation, translation)
    };
    for _ in 0..count {
        loader.visit(&attributes)?;
    }
    let copies: Vec<DMat4> = (0..count).map(place).collect();
    if copies.iter().any(|m| !m.is_finite()) {
        return Err(attributes.fail("a place that is not finite", "export the file again"));
    }
    Ok(copies)
}

/// The rotation of a quaternion of any length; none where it has no direction.
fn unit(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() { rotation / length } else { DQuat::IDENTITY }
}

/// From a node's space to its parent's, moved or at rest.
fn local(node: &gltf::Node, moved: Option<&Moved>) -> DMat4 {
    let at_rest = match node.transform() {
        Transform::Matrix { matrix } => {
            let matrix = DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)));
            if moved.is_none() {
                return matrix;
            }
            matrix.to_scale_rotation_translation()
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
            (vector(scale), unit(DQuat::from_array(rotation.map(f64::from))), vector(translation))
        }
    };
    let (scale, rotation, translation) = at_rest;
    let moved = moved.copied().unwrap_or_default();
    DMat4::from_scale_rotation_translation(
        moved.scale.unwrap_or(scale),
        moved.rotation.unwrap_or(rotation),
        moved.translation.unwrap_or(translation),
    )
}

/// Does a transform leave a body its inside? Scales of 0 are how animations hide things.
pub(in crate::scene) fn is_flat(world: &DMat4) -> bool {
    let linear = DMat3::from_mat4(*world);
    linear.determinant() == 0.0 || !linear.inverse().is_finite()
}
