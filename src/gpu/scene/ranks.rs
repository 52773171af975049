//! Volumes as paths on the GPU know them.

use crate::scene::Scene;
use glam::UVec4;

/// Distinct volumes that a path can be in at once, and as many again where a scene needs them.
pub const SLOTS: usize = 4;

/// Interiors in the order in which they rule where they overlap, weakest first; what surrounds the scene rules over none.
pub(super) fn by_rank(scene: &Scene) -> Vec<usize> {
    let mut order: Vec<usize> = (0..scene.interiors.len()).collect();
    order[1..].sort_by_key(|&i| (scene.interiors[i].priority, scene.interiors[i].depth, i));
    order
}

/// The rank of every interior.
pub(super) fn ranks(scene: &Scene) -> Vec<u32> {
    let mut ranks = vec![0; scene.interiors.len()];
    by_rank(scene).into_iter().enumerate().for_each(|(rank, interior)| ranks[interior] = rank as u32);
    ranks
}

/// The volumes that a path is in ([`crate::scene::initial_interiors`]): for each a slot of its rank << 16 and how many of its bodies there are. `None` if
/// there are more than fit.
pub fn volume_stack(scene: &Scene, interiors: &[usize]) -> Option<[UVec4; 2]> {
    if interiors.is_empty() {
        return Some([UVec4::ZERO; 2]);
    }
    let mut slots: Vec<u32> = Vec::new();
    let ranks = ranks(scene);
    for &interior in interiors {
        match slots.iter_mut().find(|slot| **slot >> 16 == ranks[interior]) {
            Some(slot) if *slot & 0xffff == 0xffff => return None,
            Some(slot) => *slot += 1,
            None => slots.push(ranks[interior] << 16 | 1),
        }
    }
    if slots.len() > 2 * SLOTS {
        return None;
    }
    slots.resize(2 * SLOTS, 0);
    Some([UVec4::from_slice(&slots[..SLOTS]), UVec4::from_slice(&slots[SLOTS..])])
}
