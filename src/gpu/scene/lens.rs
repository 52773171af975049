//! The lens of a camera: its surfaces, and the bounds of its exit pupil. They are uniforms, which every path reads in the same order.

use super::rows::{Rows, SpectrumRow};
use crate::gpu::layout::LensSurface;
use crate::gpu::{Gpu, Resource};
use crate::lens::{LensCamera, Surface};
use crate::scene::Scene;
use crate::spectrum::{Ior, Spectrum};
use glam::Vec4;

/// Named buffers, and sizes as constants of the shaders; nothing where the camera has no lens.
pub(super) fn build(gpu: &Gpu, scene: &Scene, rows: &mut Rows) -> (Vec<(&'static str, Resource)>, String) {
    let Some(camera) = scene.sensor.optics() else { return Default::default() };
    let LensCamera { lens, pupil, .. } = camera;
    let mut medium = |before: Option<&Surface>| {
        let glass = before.and_then(|s| s.glass.as_ref());
        let ior = glass.map_or(Ior::constant(1.0), |g| g.ior.clone());
        let absorption = glass.and_then(|g| g.absorption.clone()).unwrap_or(Spectrum::Constant(0.0));
        (rows.add(SpectrumRow::Ior(ior)), rows.spectrum(&absorption))
    };
    let mut front = medium(None);
    let air = front.0;
    let mut surfaces = Vec::new();
    for (surface, z) in lens.surfaces.iter().zip(lens.vertices()) {
        let behind = medium(Some(surface));
        // Of the height at the rim: in metres those of high powers are beyond single precision.
        let at_rim = |i: usize| surface.semi_diameter.powi(2 * i as i32 + 2);
        let coefficient = |i: usize| surface.aspheric.get(i).map_or(0.0, |a| a * at_rim(i)) as f32;
        let four = |first: usize| Vec4::from_array(std::array::from_fn(|i| coefficient(first + i)));
        surfaces.push(LensSurface {
            curvature: surface.curvature() as f32,
            conic: surface.conic as f32,
            z: z as f32,
            semi_diameter: surface.semi_diameter as f32,
            front_row: front.0,
            row: behind.0,
            front_absorption: front.1,
            absorption: behind.1,
            low: four(0),
            high: four(4),
        });
        front = behind;
    }
    // Centre, and half extents.
    let bounds: Vec<Vec4> = pupil.iter().map(|b| Vec4::new(b.center as f32, b.half.x as f32, b.half.y as f32, 0.0)).collect();
    let uniform = |label: &str, bytes: &[u8]| {
        let buffer = gpu.uniform(label, bytes.len() as u64);
        gpu.write(&buffer, bytes);
        buffer
    };
    let resources = vec![
        ("lens", uniform("surfaces of the lens", bytemuck::cast_slice(&surfaces))),
        ("pupil_bounds", uniform("bounds of the exit pupil", bytemuck::cast_slice(&bounds))),
    ];
    let sizes =
        format!("const LENS_SURFACES = {}u;\nconst LENS_BOUNDS = {}u;\nconst LENS_AIR = {air}u;\n", surfaces.len(), bounds.len());
    (resources, sizes)
}
