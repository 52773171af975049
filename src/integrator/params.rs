//! What the shaders are told of the sensor, the film and the scene's sizes.

use crate::error::{Error, Result};
use crate::geometry::Bounds;
use crate::gpu::layout::Params;
use crate::gpu::scene::{GpuScene, volume_stack};
use crate::lens::camera::PUPIL_BOUNDS;
use crate::scene::{Filter, SLACK, Scene, Sensor, Starts, Tile, initial_interiors};
use glam::{DVec3, Vec4};
use std::f64::consts::PI;

/// Uniforms that do not change from dispatch to dispatch.
pub(super) fn params(
    scene: &Scene,
    bounds: Bounds,
    uploaded: &GpuScene,
    merge_reach: f32,
    spectra_stride: u32,
) -> Result<Params> {
    let (film, origin, power) = (&scene.film, uploaded.origin, uploaded.power);
    let local = |p: DVec3| (p - origin).as_vec3().extend(0.0);
    let vec4 = |v: DVec3| v.as_vec3().extend(0.0);
    let aspect = f64::from(film.width) / f64::from(film.height);
    let half = |x: f64, y: f64, z: f64, w: f64| Vec4::new(x as f32, y as f32, z as f32, w as f32);
    let mut p = Params {
        image_width: film.width,
        image_height: film.height,
        max_depth: scene.max_depth,
        spectra_stride,
        light_paths: film.pixel_bounds().pixels() as u32,
        filter_reach: match film.filter {
            Filter::Box => 0.5,
            Filter::Tent { radius } => radius as f32,
            Filter::Gaussian { sigma } => (3.0 * sigma) as f32,
        },
        filter_radius: match film.filter {
            Filter::Box => 0.5,
            Filter::Tent { radius } => radius as f32,
            Filter::Gaussian { sigma } => sigma as f32,
        },
        ..uploaded.params
    };
    let starts = Starts::of(scene);
    let start = match &starts.sensor {
        Sensor::Perspective { eye, frame, optics: Some(lens), .. } => {
            p.origin = local(*eye);
            [p.axis_x, p.axis_y, p.axis_z] = [frame.x_axis, frame.y_axis, frame.z_axis].map(vec4);
            p.half_extent = half(0.5 * lens.film.x, 0.5 * lens.film.y, lens.front.radius, lens.front.z);
            p.dual_u = half(lens.eye_z, lens.film_z, lens.pupil_z, lens.start_z);
            p.dual_v = half((PUPIL_BOUNDS - 1) as f64 / lens.film_radius(), lens.axial, lens.least_cos, 0.0);
            *eye
        }
        Sensor::Perspective { eye, frame, tan_half_vfov, lens_radius, focus_distance, optics: None } => {
            p.origin = local(*eye);
            [p.axis_x, p.axis_y, p.axis_z] = [frame.x_axis, frame.y_axis, frame.z_axis].map(vec4);
            p.half_extent = half(tan_half_vfov * aspect, *tan_half_vfov, *lens_radius, *focus_distance);
            *eye
        }
        Sensor::Orthographic { eye, frame, height } => {
            p.origin = local(*eye);
            [p.axis_x, p.axis_y, p.axis_z] = [frame.x_axis, frame.y_axis, frame.z_axis].map(vec4);
            p.half_extent = half(0.5 * height * aspect, 0.5 * height, 0.0, 0.0);
            *eye
        }
        Sensor::IrradiancePlane { origin: corner, edge_u, edge_v } => {
            p.origin = local(*corner);
            [p.axis_x, p.axis_y, p.axis_z] = [*edge_u, *edge_v, edge_u.cross(*edge_v).normalize()].map(vec4);
            // Dual basis: coordinates along the edges by dot products.
            let n = edge_u.cross(*edge_v);
            p.dual_u = vec4(edge_v.cross(n) / n.length_squared()).with_w(n.length() as f32);
            p.dual_v = vec4(n.cross(*edge_u) / n.length_squared());
            *corner + 0.5 * (edge_u + edge_v)
        }
        Sensor::IrradianceSphere { center, radius } => {
            p.origin = local(*center);
            p.half_extent = half(*radius, 0.0, 0.0, 0.0);
            *center + DVec3::Y * *radius
        }
    };
    p.origin.w = if starts.sensor_touches { SLACK as f32 } else { 0.0 };
    let (_, scene_radius) = bounds.ball();
    p.scene_diameter = (2.0 * scene_radius) as f32;
    p.merge_reach = merge_reach;
    // A quantum is 2^-24 of what a typical light path adds to a pixel that sees it from across the scene.
    let pixel_measure = match scene.sensor {
        Sensor::Perspective { tan_half_vfov, .. } => (2.0 * tan_half_vfov / f64::from(film.height) * scene_radius).powi(2) * PI,
        Sensor::Orthographic { height, .. } => (height / f64::from(film.height)).powi(2) * PI,
        Sensor::IrradiancePlane { edge_u, edge_v, .. } => edge_u.cross(edge_v).length() / f64::from(film.width * film.height),
        Sensor::IrradianceSphere { radius, .. } => 4.0 * PI * radius * radius / f64::from(film.width * film.height),
    };
    p.inverse_quantum = (pixel_measure / power.max(1e-30) * 0.5f64.powi(-24)).clamp(1e-30, 1e30) as f32;
    let around = initial_interiors(scene, &[start]);
    [p.inside, p.inside_more] = volume_stack(scene, &around[0]).ok_or_else(|| {
        Error::usage("the sensor lies inside more than 8 different volumes", "remove some of the glasses or media around it")
    })?;
    Ok(p)
}

/// What is rendered of which picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// The picture, with the number of light paths of a pass.
    pub params: Params,
    /// The part of it that is kept.
    pub bounds: Tile,
}

impl View {
    /// Pixels of the picture.
    pub fn pixels_of_picture(&self) -> f64 {
        f64::from(self.params.image_width) * f64::from(self.params.image_height)
    }

    /// Pixels of the part that is kept.
    pub fn pixels(&self) -> f64 {
        self.bounds.pixels() as f64
    }

    /// The same view with at most about so many `pixels` kept, with as many light paths for each of them.
    pub fn coarser(&self, pixels: f64) -> View {
        let scale = (pixels / self.pixels()).sqrt().min(1.0);
        let fine = &self.params;
        let along = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
        let mut params = Params { image_width: along(fine.image_width), image_height: along(fine.image_height), ..*fine };
        // All pixels that the part reaches into.
        let of_axis = |first: u32, count: u32, (fine, coarse): (u32, u32)| {
            let at = |n: u32| u64::from(n) * u64::from(coarse);
            let (low, high) = (at(first) / u64::from(fine), at(first + count).div_ceil(u64::from(fine)));
            (low as u32, (high - low) as u32)
        };
        let (x, width) = of_axis(self.bounds.x, self.bounds.width, (fine.image_width, params.image_width));
        let (y, height) = of_axis(self.bounds.y, self.bounds.height, (fine.image_height, params.image_height));
        let coarse = View { params, bounds: Tile { x, y, width, height } };
        let area = self.pixels_of_picture() / coarse.pixels_of_picture();
        params.light_paths = ((f64::from(fine.light_paths) / area).round() as u32).max(1);
        // What a light path adds to a pixel is the more, the smaller the pixel.
        params.inverse_quantum = (f64::from(fine.inverse_quantum) * area) as f32;
        View { params, ..coarse }
    }
}
