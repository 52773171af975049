//! Volumes as paths on the GPU know them.

use crate::scene::Scene;
use glam::UVec4;

/// Rank of a volume in a path's set.
pub(super) fn rank(scene: &Scene, interior: usize) -> u32 {
    if interior == 0 { 0 } else { 1 << 31 | u32::from(scene.interiors[interior].priority) << 16 | interior as u32 }
}

/// A path's set of volumes, or `None` if it holds more than fit.
pub fn ranks(scene: &Scene, interiors: &[usize]) -> Option<UVec4> {
    let mut out = [0; 4];
    if interiors.len() > out.len() {
        return None;
    }
    interiors.iter().zip(&mut out).for_each(|(&i, r)| *r = rank(scene, i));
    Some(UVec4::from_array(out))
}
