//! The compressed wide BVH over all primitives of a scene, built by obvhs.

use glam::Vec3;
use obvhs::{BvhBuildParams, aabb::Aabb, cwbvh::CwBvh, cwbvh::builder::build_cwbvh};
use std::time::Duration;

/// A built hierarchy.
#[derive(Debug)]
pub struct Bvh {
    /// Nodes as the traversal reads them: 5 x vec4<u32> each. Never empty.
    pub nodes: Vec<[u32; 20]>,
    /// Primitives in the order of the leaves.
    pub order: Vec<u32>,
    /// Entries that a traversal's stack needs.
    pub stack: u32,
}

/// Builds the hierarchy over boxes (least, greatest corner), each grown by `padding`: what rounding in the slab test may lose, m.
pub fn build(boxes: &[(Vec3, Vec3)], padding: f32) -> Bvh {
    if boxes.is_empty() {
        // One node without children: every ray misses.
        return Bvh { nodes: vec![[0; 20]], order: Vec::new(), stack: 1 };
    }
    let padded: Vec<Aabb> = boxes.iter().map(|(lo, hi)| Aabb::new((*lo - padding).into(), (*hi + padding).into())).collect();
    let mut time = Duration::ZERO;
    let params = BvhBuildParams { max_prims_per_leaf: 3, ..BvhBuildParams::medium_build() };
    let bvh = build_cwbvh(&padded, params, &mut time);
    let stack = depth(&bvh, 0) + 1;
    let nodes = bvh.nodes.iter().map(bytemuck::cast_ref::<_, [u32; 20]>).copied().collect();
    Bvh { nodes, order: bvh.primitive_indices, stack }
}

/// Levels of inner nodes below and including `node`.
fn depth(bvh: &CwBvh, node: usize) -> u32 {
    let n = &bvh.nodes[node];
    let children = n.imask.count_ones();
    1 + (0..children).map(|c| depth(bvh, (n.child_base_idx + c) as usize)).max().unwrap_or(0)
}
