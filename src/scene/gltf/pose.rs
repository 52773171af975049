//! Meshes in the pose that a file gives them: morph targets by their weights, skins by where their joints stand.

use crate::error::Result;
use crate::scene::Mesh;
use crate::scene::gltf::document::{Asset, element};
use crate::scene::gltf::node::Placed;
use crate::scene::json::Node;
use glam::{DMat3, DMat4, DVec3};
use gltf::{Primitive, Semantic};
use std::collections::HashMap;

/// What bends the mesh of a node.
#[derive(Default)]
pub(in crate::scene) struct Pose {
    /// How much of each morph target is added.
    weights: Vec<f64>,
    /// From the mesh's space at rest to the world, for every joint of a skin.
    joints: Option<Vec<DMat4>>,
}

impl Pose {
    /// The pose of a node's mesh, where `worlds` says where nodes stand.
    pub(in crate::scene) fn of(asset: &Asset, root: &Node, placed: &Placed, worlds: &HashMap<usize, DMat4>) -> Result<Self> {
        let of_mesh = || placed.gltf.mesh().and_then(|mesh| mesh.weights());
        let weights = placed.gltf.weights().or_else(of_mesh).unwrap_or_default();
        let weights = weights.iter().map(|w| f64::from(*w)).collect();
        let Some(skin) = placed.gltf.skin() else { return Ok(Pose { weights, joints: None }) };
        let node = element(root, "skins", skin.index())?;
        let at_rest = skin.inverse_bind_matrices().map(|a| asset.numbers::<16>(root, &a)).transpose()?;
        let mut joints = Vec::new();
        for (i, joint) in skin.joints().enumerate() {
            let world = worlds.get(&joint.index());
            let world =
                world.ok_or_else(|| node.fail(format!("joint {i} is not in the scene"), "export it with its skeleton"))?;
            let inverse = match &at_rest {
                Some(list) => list.get(i).map(DMat4::from_cols_array),
                None => Some(DMat4::IDENTITY),
            };
            let inverse = inverse.ok_or_else(|| node.fail("fewer matrices than joints", "export the file again"))?;
            joints.push(*world * inverse);
        }
        Ok(Pose { weights, joints: Some(joints) })
    }

    /// Does a skin say where the mesh stands, whatever its node does?
    pub(in crate::scene) fn is_skinned(&self) -> bool {
        self.joints.is_some()
    }

    /// Bends the mesh of this primitive.
    pub(in crate::scene) fn bend(&self, mesh: &mut Mesh, asset: &Asset, root: &Node, primitive: &Primitive) -> Result<()> {
        for (target, weight) in primitive.morph_targets().zip(&self.weights).filter(|(_, w)| **w != 0.0) {
            let shift = |accessor: Option<gltf::Accessor>, list: &mut [DVec3]| -> Result<()> {
                let Some(accessor) = accessor.filter(|_| !list.is_empty()) else { return Ok(()) };
                check_count(root, &accessor, list.len())?;
                let shifts = asset.numbers::<3>(root, &accessor)?;
                list.iter_mut().zip(shifts).for_each(|(v, shift)| *v += *weight * DVec3::from_array(shift));
                Ok(())
            };
            shift(target.positions(), &mut mesh.positions)?;
            shift(target.normals(), &mut mesh.normals)?;
            let mut tangents: Vec<DVec3> = mesh.tangents.iter().map(|t| t.truncate()).collect();
            shift(target.tangents(), &mut tangents)?;
            mesh.tangents.iter_mut().zip(tangents).for_each(|(t, shifted)| *t = shifted.extend(t.w));
        }
        if let Some(joints) = &self.joints {
            skin(mesh, &blends(mesh, joints, asset, root, primitive)?);
        }
        Ok(())
    }
}

/// Refuses lists that are not one for each vertex, before they are read.
pub(in crate::scene) fn check_count(root: &Node, accessor: &gltf::Accessor, count: usize) -> Result<()> {
    if accessor.count() == count {
        return Ok(());
    }
    let node = element(root, "accessors", accessor.index())?;
    Err(node.fail(format!("{} elements for {count} vertices", accessor.count()), "export the file again"))
}

/// For every vertex the mean of its joints, by their weights.
fn blends(mesh: &Mesh, joints: &[DMat4], asset: &Asset, root: &Node, primitive: &Primitive) -> Result<Vec<DMat4>> {
    let count = mesh.positions.len();
    let mut sums = vec![(DMat4::ZERO, 0.0); count];
    for set in 0.. {
        let (Some(which), Some(weights)) = (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set))) else {
            break;
        };
        check_count(root, &which, count)?;
        check_count(root, &weights, count)?;
        let (which_node, weights) = (element(root, "accessors", which.index())?, asset.numbers::<4>(root, &weights)?);
        for ((which, weights), (sum, total)) in asset.numbers::<4>(root, &which)?.iter().zip(&weights).zip(&mut sums) {
            for (joint, weight) in which.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
                let joint = joints.get(*joint as usize);
                let joint =
                    joint.ok_or_else(|| which_node.fail("a joint that the skin does not have", "export the file again"))?;
                *sum += *joint * *weight;
                *total += weight;
            }
        }
    }
    // A vertex of no joint hangs on the first, as in other readers.
    let first = joints.first().copied().unwrap_or(DMat4::IDENTITY);
    Ok(sums.into_iter().map(|(sum, total)| if total > 0.0 { sum * (1.0 / total) } else { first }).collect())
}

fn skin(mesh: &mut Mesh, blends: &[DMat4]) {
    mesh.positions.iter_mut().zip(blends).for_each(|(p, m)| *p = m.transform_point3(*p));
    let linear = DMat3::from_mat4;
    mesh.normals.iter_mut().zip(blends).for_each(|(n, m)| *n = (linear(*m).inverse().transpose() * *n).normalize_or_zero());
    mesh.tangents.iter_mut().zip(blends).for_each(|(t, m)| *t = (linear(*m) * t.truncate()).normalize_or_zero().extend(t.w));
}
