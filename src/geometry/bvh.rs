//! The compressed wide BVH over all primitives of a scene, built by obvhs.

use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};
use obvhs::ploc::{PlocBuilder, morton::morton_encode_u64_unorm};
use rayon::slice::ParallelSliceMut;
use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};

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

/// Boxes in one place, at most: rays have to try what is in all of them.
pub const MOST_IN_ONE_PLACE: usize = 16_384;
/// So many boxes in each other are nothing special.
const FEW: usize = 16;

/// Numbers of the boxes of each heap: more than a few in a row along a space-filling curve through their middles, of which each holds the next or lies in
/// it. Boxes in one place are a heap, too.
pub fn heaps(boxes: &[(Vec3, Vec3)]) -> Vec<Vec<u32>> {
    let (low, high) =
        boxes.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (lo, hi)| (low.min(*lo), high.max(*hi)));
    let (low, size) = (low.as_dvec3(), (high - low).as_dvec3().max(DVec3::splat(f64::MIN_POSITIVE)));
    let code = |(lo, hi): &(Vec3, Vec3)| morton_encode_u64_unorm((0.5 * (lo.as_dvec3() + hi.as_dvec3()) - low) / size);
    let mut order: Vec<(u64, u32)> = boxes.iter().enumerate().map(|(i, boxed)| (code(boxed), i as u32)).collect();
    order.par_sort_unstable();
    let holds = |(lo, hi): &(Vec3, Vec3), other: &(Vec3, Vec3)| lo.cmple(other.0).all() && hi.cmpge(other.1).all();
    let is_heap = |(_, i): &(u64, u32), (_, j): &(u64, u32)| {
        let (a, b) = (&boxes[*i as usize], &boxes[*j as usize]);
        holds(a, b) || holds(b, a)
    };
    let runs = order.chunk_by(is_heap).filter(|run| run.len() > FEW);
    runs.map(|run| run.iter().map(|(_, i)| *i).collect()).collect()
}

/// How many of the boxes of a heap are in one place, as far as single precision can tell, at most.
pub fn in_one_place(heap: &[u32], boxes: &[(Vec3, Vec3)]) -> usize {
    let mut counts: HashMap<[u32; 6], usize> = HashMap::new();
    for &i in heap {
        let (lo, hi) = boxes[i as usize];
        *counts.entry([lo.x, lo.y, lo.z, hi.x, hi.y, hi.z].map(f32::to_bits)).or_default() += 1;
    }
    counts.into_values().max().unwrap_or(0)
}

/// Builds the hierarchy over those boxes (least, greatest corner) that are wanted, each grown by `padding`: what rounding in the slab test may lose, m.
/// `heaps` are the wanted ones of [`heaps`].
pub fn build(boxes: &[(Vec3, Vec3)], padding: f32, heaps: &[Vec<u32>], is_wanted: impl Fn(u32) -> bool) -> Bvh {
    if boxes.is_empty() {
        // One node without children: every ray misses.
        return Bvh { nodes: vec![[0; 20]], order: Vec::new(), stack: 1 };
    }
    let padded: Vec<Aabb> = boxes.iter().map(|(lo, hi)| Aabb::new((*lo - padding).into(), (*hi + padding).into())).collect();
    let bvh = bvh2_to_cwbvh(&binary(&padded, heaps, is_wanted), 3, true, false);
    let stack = depth(&bvh, 0) + 1;
    let nodes = bvh.nodes.iter().map(bytemuck::cast_ref::<_, [u32; 20]>).copied().collect();
    Bvh { nodes, order: bvh.primitive_indices, stack }
}

/// The binary hierarchy that becomes the wide one. Boxes are clustered with those close by (PLOC). Of a heap this would take one after the other, in a
/// number of steps that is the square of theirs, to a chain as deep as they are many: heaps are halved by number.
fn binary(boxes: &[Aabb], heaps: &[Vec<u32>], is_wanted: impl Fn(u32) -> bool) -> Bvh2 {
    // The first of a heap stands for it.
    let heap_of: HashMap<u32, &Vec<u32>> = heaps.iter().map(|heap| (heap[0], heap)).collect();
    let others: HashSet<u32> = heaps.iter().flat_map(|heap| &heap[1..]).copied().collect();
    let mut wanted: Vec<u32> = (0..boxes.len() as u32).filter(|i| is_wanted(*i) && !others.contains(i)).collect();
    let clustered: Vec<Aabb> =
        wanted.iter().map(|i| heap_of.get(i).map_or(boxes[*i as usize], |heap| around(heap, boxes))).collect();
    let params = BvhBuildParams::medium_build();
    let mut bvh = PlocBuilder::with_capacity(clustered.len()).build(
        params.ploc_search_distance,
        &clustered,
        wanted.clone(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    // Rounds of clustering, each of which may add a level: heaps that are none by their order along the curve.
    if bvh.max_depth > DEFAULT_MAX_STACK_DEPTH {
        bvh.nodes = vec![Bvh2Node::default()];
        bvh.parents.clear();
        halve(&mut bvh, 0, &mut wanted, boxes);
    } else {
        ReinsertionOptimizer::default().run(&mut bvh, params.reinsertion_batch_ratio, None);
    }
    for node in 0..bvh.nodes.len() {
        if bvh.nodes[node].is_leaf()
            && let Some(heap) = heap_of.get(&bvh.nodes[node].first_index)
        {
            halve(&mut bvh, node, &mut heap.to_vec(), boxes);
        }
    }
    // Leaves have the numbers of boxes.
    bvh.primitive_indices = (0..boxes.len() as u32).collect();
    bvh
}

/// The box around these.
fn around(members: &[u32], boxes: &[Aabb]) -> Aabb {
    members.iter().fold(Aabb::empty(), |all, &i| all.union(&boxes[i as usize]))
}

/// Makes `node` the root of a hierarchy over these boxes, each node of which has half of those above.
fn halve(bvh: &mut Bvh2, node: usize, members: &mut [u32], boxes: &[Aabb]) {
    let all = around(members, boxes);
    if let [one] = members {
        bvh.nodes[node] = Bvh2Node::new(all, 1, *one);
        return;
    }
    // Along the axis that sets them apart most.
    let ends = members.iter().fold(Aabb::empty(), |ends, &i| {
        let middle = boxes[i as usize].center();
        ends.union(&Aabb::new(middle, middle))
    });
    let apart = ends.diagonal();
    let axis = (0..3).fold(0, |most, axis| if apart[axis] > apart[most] { axis } else { most });
    // Of those in each other the greatest are together.
    let key = |i: &u32| (boxes[*i as usize].center()[axis], boxes[*i as usize].half_area());
    let half = members.len() / 2;
    members.select_nth_unstable_by(half, |a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
    let first = bvh.nodes.len();
    bvh.nodes[node] = Bvh2Node::new(all, 0, first as u32);
    bvh.nodes.extend([Bvh2Node::default(); 2]);
    let (left, right) = members.split_at_mut(half);
    halve(bvh, first, left, boxes);
    halve(bvh, first + 1, right, boxes);
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

    /// Entries of the stack that a hierarchy over these boxes takes. It has every box once.
    fn stack_over(boxes: &[(Vec3, Vec3)]) -> u32 {
        let bvh = build(boxes, 1e-6, &heaps(boxes), |_| true);
        let mut found = bvh.order.clone();
        found.sort_unstable();
        assert!(found.into_iter().eq(0..boxes.len() as u32));
        bvh.stack
    }

    #[test]
    fn heaps_are_boxes_in_each_other_and_not_merely_many() {
        assert!(heaps(&[(Vec3::ZERO, Vec3::ONE); FEW]).is_empty());
        let mut boxes = vec![(Vec3::ZERO, Vec3::ONE); FEW + 1];
        boxes.insert(0, (Vec3::splat(3.0), Vec3::splat(4.0)));
        assert_eq!(heaps(&boxes), [(1..FEW as u32 + 2).collect::<Vec<_>>()]);
        assert_eq!(in_one_place(&heaps(&boxes)[0], &boxes), FEW + 1);
        let nested: Vec<_> = (1..100).map(|i| (Vec3::splat(-i as f32), Vec3::splat(i as f32))).collect();
        assert_eq!(heaps(&nested)[0].len(), 99);
        assert_eq!(in_one_place(&heaps(&nested)[0], &nested), 1);
        let at = |i: u32| Vec3::new((i % 1000) as f32, (i / 1000) as f32 * 1e-3, 1.0);
        assert!(heaps(&(0..1_000_000).map(|i| (at(i), at(i) + 0.5)).collect::<Vec<_>>()).is_empty());
    }

    #[test]
    fn hierarchies_are_shallow_however_boxes_lie_in_each_other() {
        const N: u32 = 12_000;
        let side = |i: u32| 1.0 + i as f32 * 1e-4;
        type Place<'a> = &'a dyn Fn(u32) -> (Vec3, Vec3);
        let places: [(&str, Place<'_>); 4] = [
            ("one place", &|_| (Vec3::ZERO, Vec3::ONE)),
            ("from one corner", &|i| (Vec3::ZERO, Vec3::splat(side(i)))),
            ("around one middle", &|i| (Vec3::splat(-side(i)), Vec3::splat(side(i)))),
            ("one behind the other", &|i| (Vec3::new(0.0, 0.0, side(i)), Vec3::new(1.0, 1.0, side(i)))),
        ];
        for (name, place) in places {
            let floor = (Vec3::new(-9.0, -1.0, -9.0), Vec3::new(9.0, -1.0, 9.0));
            let stack = stack_over(&(0..N).map(place).chain([floor]).collect::<Vec<_>>());
            assert!(stack <= 16, "{name}: {stack}");
        }
    }
}
