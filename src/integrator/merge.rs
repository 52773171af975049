//! Merging light paths at the visible points of camera paths: how wide, and the buffers for it (shaders/path/merge.wgsl).

use super::{Feature, Plan};
use crate::error::Result;
use crate::gpu::layout::{PointLink, PointSegment, PointSheen, VisiblePoint, texels};
use crate::gpu::scene::Targets;
use crate::gpu::{Gpu, Resource};
use crate::scene::bounds_of_all;
use crate::scene::{Scene, Sensor};

/// Bytes for the visible points that light paths are merged at.
const POINT_BYTES: u64 = 32 << 20;
/// Radius of merging in the first pass, in pixels.
const PIXELS: f64 = 1.4;
/// And at most this part of the scene's size.
const SHARE: f64 = 0.01;
/// The squared radius of merging falls with the pass as pass^-(1 - this): Knaus & Zwicker 2011, eq. 20.
const ALPHA: f64 = 2.0 / 3.0;
/// Wavelengths may share a way if their own would end within this part of the radius (shaders/path/hero.wgsl).
pub(super) const BLUR: f32 = 0.5;
/// Angle that light spreads by where it scatters, in the first pass, radians: what wavelengths that share a way from there are apart by is a part of it.
pub(super) const SPREAD: f64 = 0.3;

/// In fog a kernel is a cylinder along the camera ray, since nobody sees how deep in the fog something lies, this many times as long as wide: a link of the grid for each
/// part. A photon beam merged with points (Jarosz et al. 2008, "The beam radiance estimate") in pieces.
const FOG_LINKS: u32 = 8;

/// Where light paths are merged.
#[derive(Debug)]
pub(super) struct Merge {
    pub points: Resource,
    /// How many points there may be.
    pub slots: u32,
    /// Links of them all, behind which the rest of the points lies.
    pub links: u32,
    pub heads: Resource,
    /// Of `heads`, for each pass.
    pub cells: u32,
    /// Passes whose points fit.
    pub passes: u32,
}

/// How wide light paths are merged, in pixels: what wavelengths that share a way are apart by is a part of it.
#[derive(Debug)]
pub(super) struct Radius {
    /// Radius, and radius per metre of the camera path, in the first pass of a picture of one row, m.
    of_row: (f64, f64),
    /// And at most, m.
    most: (f64, f64),
}

impl Radius {
    /// For paths of a scene up to this length.
    pub fn new(scene: &Scene, reach: f32) -> Self {
        // A picture of few pixels must not blur what is smaller than they are.
        let most = SHARE * 2.0 * bounds_of_all(&scene.shapes).ball().1;
        let of_row = match scene.sensor {
            Sensor::Perspective { tan_half_vfov, .. } => (0.0, PIXELS * 2.0 * tan_half_vfov),
            Sensor::Orthographic { height, .. } => (PIXELS * height, 0.0),
            Sensor::IrradiancePlane { .. } | Sensor::IrradianceSphere { .. } => (0.0, 0.0),
        };
        Self { of_row, most: (most, most / f64::from(reach)) }
    }

    /// Radius, m, and radius per metre of the camera path, in this pass of all over a picture of so many rows.
    pub fn at(&self, pass: u64, rows: u32) -> (f64, f64) {
        let radius = |of_row: f64, most: f64| (of_row / f64::from(rows)).min(most) * shrinkage(pass);
        (radius(self.of_row.0, self.most.0), radius(self.of_row.1, self.most.1))
    }
}

/// The radius of merging in this pass of all, over that in the first one.
pub(super) fn shrinkage(pass: u64) -> f64 {
    (pass as f64 + 1.0).powf(0.5 * (ALPHA - 1.0))
}

impl Merge {
    /// Buffers for the points of a tile of `blocks` blocks, the largest one, in `passes` passes.
    ///
    /// # Errors
    /// [`crate::error::Error::Device`] if the adapter cannot hold them.
    pub fn new(gpu: &Gpu, plan: &Plan, blocks: u32, passes: u32) -> Result<Self> {
        let point_bytes = point_bytes(plan);
        let pixels = 64 * u64::from(blocks);
        // Where blocks differ in their samples, some passes have a few more than others.
        let slots = pixels * u64::from(passes) + (pixels * u64::from(passes) / 8).next_multiple_of(64) + 64 * 64;
        let points = gpu.empty_table("visible points", slots * point_bytes / 16)?;
        let cells = (2 * pixels * u64::from(links(plan)).isqrt())
            .next_power_of_two()
            .clamp(1 << 10, ((1 << 22) / u64::from(passes)).next_power_of_two()) as u32;
        let heads = gpu.empty_storage("cells of visible points", u64::from(cells) * u64::from(passes) * 4)?;
        Ok(Self { points, slots: slots as u32, links: slots as u32 * links(plan), heads, cells, passes })
    }
}

/// The mean over the first `passes` passes of the squared radius of merging, in units of the first one's. The blur, and with it the bias of what is merged, is
/// in proportion to it (Knaus & Zwicker 2011).
pub fn mean_squared_radius(passes: u64) -> f64 {
    /// So many terms are summed; of the rest the integral, by the midpoint rule, is closer than 1e-6.
    const EXACT: u64 = 100;
    let terms: f64 = (1..=passes.min(EXACT)).map(|pass| (pass as f64).powf(ALPHA - 1.0)).sum();
    let integral = |pass: u64| (pass as f64 + 0.5).powf(ALPHA) / ALPHA;
    (terms + integral(passes.max(EXACT)) - integral(EXACT)) / passes.max(1) as f64
}

/// Passes over a tile of `blocks` blocks whose points have room together, `most` at most.
pub(super) fn passes(gpu: &Gpu, plan: &Plan, blocks: u32, most: u32) -> u32 {
    let bytes = 64 * u64::from(blocks) * point_bytes(plan);
    (POINT_BYTES.min(gpu.max_binding()) / bytes).clamp(1, u64::from(most)) as u32
}

/// Links of the grid that a visible point may have.
pub(super) fn links(plan: &Plan) -> u32 {
    if plan.has(Feature::Scattering) { FOG_LINKS } else { 1 }
}

/// Bytes of a point, its throughput included, and through a lens where each wavelength lands.
pub(super) fn point_bytes(plan: &Plan) -> u64 {
    let sheen = if plan.has(Feature::Sheen) { texels::<PointSheen>() } else { 0 };
    let segment = if plan.has(Feature::Scattering) { texels::<PointSegment>() } else { 0 };
    let of_wavelengths = plan.wavelengths.div_ceil(4) * if plan.has(Feature::SensorLens) { 2 } else { 1 };
    u64::from(links(plan) * texels::<PointLink>() + texels::<VisiblePoint>() + sheen + segment + of_wavelengths) * 16
}

/// Camera paths longer than this are merged within the radius of this length: cells fit the largest radius, so that it should not be much larger than
/// usual. One and a half times as far as what counts of whatever bends light is from the eye (or its radius, around the eye).
pub(super) fn reach(scene: &Scene, targets: &Targets) -> f32 {
    let Sensor::Perspective { eye, .. } = scene.sensor else { return 0.0 };
    targets.parts.iter().map(|(center, radius)| (1.5 * center.distance(eye)).max(*radius)).fold(0.0, f64::max) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_squared_radius_is_the_sum_over_passes() {
        for passes in [1, 100, 101, 5000] {
            let sum: f64 = (1..=passes).map(|pass: u64| (pass as f64).powf(-1.0 / 3.0)).sum();
            let mean = mean_squared_radius(passes);
            assert!((mean * passes as f64 / sum - 1.0).abs() < 1e-6, "{passes} passes: {mean}");
        }
    }
}
