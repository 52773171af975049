//! The compressed wide BVH over all primitives of a scene, built by obvhs.

use glam::Vec3;
use obvhs::{BvhBuildParams, aabb::Aabb, cwbvh::CwBvh, cwbvh::builder::build_cwbvh};
use std::time::Duration;

/// A built hierarchy.
#[derive(Debug)]
pub struct Bvh {
    /// Nodes as the traversal reads them: 5 x `vec4<u32>` each. Never empty.
    pub nodes: Vec<[u32; 20]>,
    /// Primitives in the order of the leaves.
    pub order: Vec<u32>,
    /// Entries that a traversal's stack needs.
    pub stack: u32,
}

/// Boxes in one place, as far as single precision can tell, at most: the builder takes their number squared of steps, and rays have to try them all.
pub const MOST_IN_ONE_PLACE: u32 = 16_384;

/// Do more than [`MOST_IN_ONE_PLACE`] boxes lie in one place? Boxes are counted by a hash, so that a few more may pass for being in one place.
pub fn is_crowded(boxes: &[(Vec3, Vec3)]) -> bool {
    const PLACES: usize = 1 << 20;
    if boxes.len() <= MOST_IN_ONE_PLACE as usize {
        return false;
    }
    let mut counts = vec![0u32; PLACES];
    boxes.iter().any(|(lo, hi)| {
        let bits = lo.to_array().into_iter().chain(hi.to_array()).map(|v| u64::from(v.to_bits()));
        // FNV-1a by words, of which the upper bits are the mixed ones.
        let hash = bits.fold(0xcbf2_9ce4_8422_2325u64, |h, v| (h ^ v).wrapping_mul(0x0100_0000_01b3));
        let count = &mut counts[(hash ^ hash >> 32) as usize % PLACES];
        *count += 1;
        *count > MOST_IN_ONE_PLACE
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_crowded_where_they_are_the_same_and_not_where_they_are_many() {
        let most = MOST_IN_ONE_PLACE as usize;
        assert!(!is_crowded(&vec![(Vec3::ZERO, Vec3::ONE); most]));
        assert!(is_crowded(&vec![(Vec3::ZERO, Vec3::ONE); most + 1]));
        let at = |i: u32| Vec3::new((i % 1000) as f32, (i / 1000) as f32 * 1e-3, 1.0);
        assert!(!is_crowded(&(0..1_000_000).map(|i| (at(i), at(i) + 0.5)).collect::<Vec<_>>()));
    }
}
