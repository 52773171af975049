//! Shading normals that lose no light: a surface of facets on a mirror.
//!
//! A shading normal `ns` may contradict the geometric one, `ng`: a facet of normal `ns` scatters light to below the surface, or shows the eye its back. Such
//! light is not lost. The facets lie on a mirror of normal `ng`, which throws back what leaves them to the wrong side; and an eye behind a facet sees what it
//! would see as its mirror image in the facet's plane. (Schüssler, Heitz, Hanika & Dachsbacher, "Microfacet-based Normal Mapping for Robust Monte Carlo Path
//! Tracing", SIGGRAPH Asia 2017, close the microsurface with facets that are mirrors likewise, but stand upright; here one bounce is always enough.)
//!
//! Let `M` mirror in the surface, `N` in the facet's plane, and `g(o, i)` be the facet's density of light that an eye at `o` gets from `i`, cosine included.
//! An eye at `o` gets from `i` the sum of `g(o', i')` over those of `i` and `M i` that are on the same side of `ns` as `i` of `ng`, where `o'` is `o`, or `N o`
//! if `o` is behind the facet. All that `g` scatters arrives somewhere, so a white facet makes a white surface. Paths keep to one term of the sum. Where
//! normals agree there is but one, which is `g` itself.
//!
//! Of light (flux) that arrives from `i` the same says that it goes on to each of `o'` and `N o'` that lies on the right side of `ng`.
//!
//! Smooth glass goes by the geometric normal where the shading normal reflects totally what the geometry would let out: else light would be caught in closed
//! bodies for ever. From the light's end that is another light path than the facet's.

use super::fresnel;
use glam::DVec3;

/// Least cosine of a raised direction.
const LEAST: f64 = 1e-9;

/// Whether light from the far side of smooth glass, of relative index `eta`, gets to an eye at `o` by the geometric normal only.
pub fn is_let_out(o: DVec3, ns: DVec3, ng: DVec3, eta: f64) -> bool {
    let is_total = |n: DVec3| fresnel::cos_transmitted(o.dot(n).abs().min(1.0), eta).is_none();
    is_total(ns) && !is_total(ng)
}

/// `w` mirrored in the plane of normal `n`, if it is not on the `side` (1 or -1) of it.
pub fn raise(w: DVec3, n: DVec3, side: f64) -> DVec3 {
    let height = side * w.dot(n);
    if height >= LEAST { w } else { w + n * side * (height.abs().max(LEAST) - height) }
}

/// `w`, or its image in the plane of normal `mirror`, whichever is on the `side` of `valid`; the image never is unless `w` is. Of both, `u` in [0, 1) chooses.
/// Also returns how many they are. `w` is on the `side` of `mirror`.
pub fn choose(w: DVec3, mirror: DVec3, valid: DVec3, side: f64, u: impl FnOnce() -> f64) -> (DVec3, f64) {
    let image = w - mirror * 2.0 * w.dot(mirror);
    match (side * w.dot(valid) > 0.0, side * image.dot(valid) > 0.0) {
        (false, _) => (w, 0.0),
        (true, false) => (w, 1.0),
        (true, true) => (if u() < 0.5 { w } else { image }, 2.0),
    }
}
