//! The list of lights for next-event estimation: every emitting primitive and every light that is no shape, with an alias table by power.

use super::alias::alias_table;
use super::light_grid::{self, LightGrid};
use super::placed_lights::{light_grid_pays, placed};
use super::profiles::Profiles;
use super::ranks::volume_stack;
use super::rows::{Rows, SpectrumRow};
use super::textures::Textures;
use crate::error::{Error, Result};
use crate::geometry::{Bounds, corners, triangle_area};
use crate::gpu::layout::{self, Light, NO_INDEX};
use crate::scene::{self, EnvironmentMap, EnvironmentTexels, Geometry, SLACK, Scene, Starts, Texture, initial_interiors};
use glam::{DVec3, UVec4, Vec4};
use std::f64::consts::PI;

/// Lights as buffers.
pub(super) struct Lights {
    /// Distant ones last.
    pub records: Vec<Light>,
    /// Light of each primitive in the scene's order.
    pub of_primitive: Vec<u32>,
    /// Texels of the environment picture: coefficients and scale; threshold, alias, pdf per solid angle.
    pub environment: Vec<Vec4>,
    /// Profiles of lamps (shaders/light/profile.wgsl).
    pub profiles: Vec<[u32; 4]>,
    /// Index of the first distant light.
    pub first_distant: usize,
    /// What chooses among all others, if it pays.
    pub grid: LightGrid,
    /// Probability of a light that is not distant.
    pub near_share: f64,
    /// Index of the environment picture, or of nothing.
    pub environment_light: usize,
    /// Power of all lights, mean over the film's range, W nm^-1.
    pub power: f64,
}

fn vec4(v: DVec3) -> Vec4 {
    v.as_vec3().extend(0.0)
}

/// Lists the lights; positions are relative to `origin`, primitives numbered in the scene's order.
pub(super) fn build(scene: &Scene, rows: &mut Rows, textures: &mut Textures, bounds: Bounds, origin: DVec3) -> Result<Lights> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let (_, radius) = bounds.ball();
    let at = |p: DVec3| vec4(p - origin);
    let mut records: Vec<Light> = Vec::new();
    let mut powers = Vec::new();
    // The shape or light that each record is part of.
    let mut sources = Vec::new();
    let starts = Starts::of(scene);
    let mut lifts = starts.lifts.iter();
    let mut inside = places(scene, &starts.shifts).into_iter().map(|set| {
        volume_stack(scene, &set)
            .ok_or_else(|| Error::usage("a light lies inside more than 8 different volumes", "move it out of some of them"))
    });
    let mut of_primitive = Vec::new();
    let mut sources_so_far = 0;
    for shape in &scene.shapes {
        let count = if let Geometry::Mesh(m) = &shape.geometry { m.triangles.len() } else { 1 };
        let Some(emission) = shape.emission.as_ref().filter(|e| !e.radiance.is_zero()) else {
            of_primitive.extend(std::iter::repeat_n(NO_INDEX, count));
            continue;
        };
        let [inside, inside_more] = inside.next().unwrap_or(Ok([UVec4::ZERO; 2]))?;
        let lifts = lifts.next();
        let (row, texture) = textures.add(&emission.radiance, rows);
        let exitance = PI * emission.radiance.mean(lo, hi) * if emission.two_sided { 2.0 } else { 1.0 };
        for i in 0..count {
            let (kind, area, p0, p1, p2) = match &shape.geometry {
                Geometry::Mesh(mesh) => {
                    let c = corners(mesh, i);
                    (layout::LIGHT_KIND_TRIANGLE, triangle_area(c), at(c[0]).with_w(f32::from_bits(texture)), at(c[1]), at(c[2]))
                }
                Geometry::Instance(_) => {
                    return Err(Error::usage(
                        format!("the instance {:?} emits", shape.name),
                        "give every lamp a mesh of its own",
                    ));
                }
                Geometry::LensFace(_) => {
                    return Err(Error::usage(
                        format!("the lens {:?} emits", shape.name),
                        "put a disc or sphere that emits in its place",
                    ));
                }
                Geometry::Sphere { center, radius } => {
                    (layout::LIGHT_KIND_SPHERE, 4.0 * PI * radius * radius, at(*center), Vec4::ZERO, size(*radius, 0.0))
                }
                Geometry::Disc { center, normal, radius } => {
                    (layout::LIGHT_KIND_DISC, PI * radius * radius, at(*center), vec4(*normal), size(*radius, 0.0))
                }
                Geometry::Cylinder { base, axis, length, radius } => {
                    (layout::LIGHT_KIND_CYLINDER, 2.0 * PI * radius * length, at(*base), vec4(*axis), size(*radius, *length))
                }
            };
            let lift = lifts.and_then(|l| l.get(i)).map_or(0.0, |&l| l as f32);
            let p1 = p1.with_w(lift);
            of_primitive.push(records.len() as u32);
            powers.push(exitance * area * share_of_triangle(&emission.radiance, &shape.geometry, i));
            sources.push(sources_so_far);
            let primitive = of_primitive.len() as u32 - 1;
            let (two_sided, area) = (u32::from(emission.two_sided), area as f32);
            records.push(Light { kind, row, primitive, two_sided, p0, p1, p2, area, inside, inside_more, ..Default::default() });
        }
        sources_so_far += 1;
    }
    let mut environment = Vec::new();
    let mut profiles = Profiles::default();
    let mut environment_light = NO_INDEX as usize;
    // Lights at a place first, those from infinity last.
    let (distant, near): (Vec<_>, Vec<_>) = scene.lights.iter().zip(&starts.shifts).partition(|(light, _)| light.is_distant());
    let first_distant = records.len() + near.len();
    for (light, shift) in near.into_iter().chain(distant) {
        let at = |p: DVec3| at(p + shift);
        let none = [UVec4::ZERO; 2];
        let [inside, inside_more] = if light.is_distant() { none } else { inside.next().unwrap_or(Ok(none))? };
        let none = Light { primitive: NO_INDEX, inside, inside_more, ..Default::default() };
        let short = if *shift == DVec3::ZERO { 0.0 } else { SLACK as f32 };
        let mut record = match light {
            scene::Light::Point { position, intensity } => Light {
                kind: layout::LIGHT_KIND_POINT,
                row: rows.spectrum(intensity),
                p0: at(*position),
                p1: vec4(DVec3::Z),
                ..none
            },
            scene::Light::Spot { position, direction, intensity, cos_inner, cos_outer, falloff } => {
                let is_squared = f32::from(u8::from(*falloff == scene::Falloff::Squared));
                let p2 = size(*cos_inner, *cos_outer).with_z(is_squared);
                let (row, p1) = (rows.spectrum(intensity), vec4(*direction));
                Light { kind: layout::LIGHT_KIND_SPOT, row, p0: at(*position), p1, p2, ..none }
            }
            scene::Light::Profile { position, axes, intensity, profile } => {
                let (row, solid_angle) = (rows.spectrum(intensity), profile.solid_angle());
                let p0 = at(*position).with_w(f32::from_bits(profiles.add(profile)));
                let (p1, p2) = (vec4(axes.z_axis).with_w(solid_angle as f32), vec4(axes.x_axis));
                Light { kind: layout::LIGHT_KIND_PROFILE, row, p0, p1, p2, ..none }
            }
            scene::Light::Beam { origin, direction, radius, irradiance } => {
                let (row, p1, p2) = (rows.spectrum(irradiance), vec4(*direction), size(*radius, 0.0));
                Light { kind: layout::LIGHT_KIND_BEAM, row, p0: at(*origin), p1, p2, ..none }
            }
            scene::Light::Sun { direction, cos_angle, irradiance } => {
                let one_minus_cos = 1.0 - cos_angle;
                // Uniform radiance over the disc: irradiance / (pi sin^2).
                let solid = PI * one_minus_cos * (1.0 + cos_angle);
                let scale = if one_minus_cos > 0.0 { 1.0 / solid } else { 1.0 };
                let row = rows.spectrum(&irradiance.clone().scaled(scale));
                let p2 = size(one_minus_cos, 0.0);
                Light { kind: layout::LIGHT_KIND_SUN, row, p1: vec4(*direction), p2, ..none }
            }
            scene::Light::Constant { radiance } => {
                Light { kind: layout::LIGHT_KIND_CONSTANT, row: rows.spectrum(radiance), ..none }
            }
            scene::Light::Image(map) => {
                if !environment.is_empty() {
                    return Err(Error::usage("the scene has several environment pictures", "keep one light of kind \"image\""));
                }
                environment_light = records.len();
                environment = environment_texels(map);
                let row = rows.spectrum(&map.illuminant);
                let x_row = rows.add(match &map.texels {
                    EnvironmentTexels::Colors(_) => SpectrumRow::UpsamplingCoordinate,
                    EnvironmentTexels::Spectra(spectra) => SpectrumRow::Channel(spectra.clone(), false),
                });
                let [x, y, z] = [0, 1, 2].map(|i| map.to_local.row(i).as_vec3());
                let two_sided = if let EnvironmentTexels::Spectra(spectra) = &map.texels { spectra.stride() as u32 } else { 1 };
                Light {
                    kind: layout::LIGHT_KIND_IMAGE,
                    row,
                    two_sided,
                    p0: x.extend(map.width as f32),
                    p1: y.extend(map.height as f32),
                    p2: z.extend(f32::from_bits(x_row)),
                    ..none
                }
            }
        };
        if !light.is_distant() {
            record.p2.w = short;
        }
        records.push(record);
        powers.push(light.power(radius, lo, hi));
        sources.push(sources_so_far);
        sources_so_far += 1;
    }
    for (record, (probability, threshold, alias)) in records.iter_mut().zip(alias_table(&shares(&powers, &sources))) {
        record.probability = probability as f32;
        record.alias_threshold = threshold as f32;
        record.alias_index = alias;
    }
    let mut grid = LightGrid::default();
    if light_grid_pays(scene) {
        let mut placed = placed(scene);
        placed.iter_mut().zip(&records).for_each(|(light, record)| light.share = f64::from(record.probability));
        grid = light_grid::build(&placed, bounds, origin);
    }
    // Exactly 1 where there is nothing else to choose.
    let near_share = 1.0 - records[first_distant..].iter().map(|r| f64::from(r.probability)).sum::<f64>();
    let power = powers.iter().sum();
    let profiles = profiles.texels;
    Ok(Lights { records, of_primitive, environment, profiles, first_distant, grid, near_share, environment_light, power })
}

/// How much of the mean radiance of its picture a triangle shows, at 64 points of it; never 0, as a bright spot may lie between those.
fn share_of_triangle(radiance: &Texture, geometry: &Geometry, triangle: usize) -> f64 {
    const POINTS: u32 = 64;
    const NM: f64 = 550.0;
    let (Some(_), Geometry::Mesh(mesh)) = (radiance.image(), geometry) else { return 1.0 };
    let mean = radiance.average(NM);
    let point = |i: u32| {
        // An additive recurrence (the plastic number), folded into the triangle.
        let [b, c] = [0.754_877_666, 0.569_840_291].map(|a: f64| (a * f64::from(i + 1)).fract());
        if b + c > 1.0 { [1.0 - b, 1.0 - c] } else { [b, c] }
    };
    let seen = (0..POINTS).map(|i| radiance.eval(NM, mesh.coordinates(triangle, point(i)))).sum::<f64>() / f64::from(POINTS);
    if mean > 0.0 { 0.75 * seen / mean + 0.25 } else { 1.0 }
}

/// How often each record is to be chosen: by power, but a fifth alike for all lights, since the strongest may be hidden where the weakest is all there is.
fn shares(powers: &[f64], sources: &[usize]) -> Vec<f64> {
    let total: f64 = powers.iter().sum();
    let count = sources.last().map_or(0, |s| s + 1);
    let mut of_source = vec![0.0; count];
    powers.iter().zip(sources).for_each(|(p, &s)| of_source[s] += p);
    let share = |(p, &s): (&f64, &usize)| {
        if *p > 0.0 { 0.8 * p / total + 0.2 * p / (of_source[s] * count as f64) } else { 0.0 }
    };
    powers.iter().zip(sources).map(share).collect()
}

/// The volumes around every emitting shape, then around every light that has a place, moved by its shift.
fn places(scene: &Scene, shifts: &[DVec3]) -> Vec<Vec<usize>> {
    let emitting = scene.shapes.iter().filter(|s| s.emission.as_ref().is_some_and(|e| !e.radiance.is_zero()));
    // A point just off the surface, on the side that it lights.
    let off = |p: DVec3, n: DVec3| p + n * (1e-9 * p.abs().max_element().max(1e-3));
    let mut points: Vec<DVec3> = emitting
        .map(|s| match &s.geometry {
            Geometry::Mesh(mesh) => {
                let [a, b, c] = if mesh.triangles.is_empty() { [DVec3::ZERO; 3] } else { corners(mesh, 0) };
                off((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero())
            }
            Geometry::Instance(instance) => 0.5 * (instance.bounds().min + instance.bounds().max),
            Geometry::Sphere { center, radius } => off(*center + DVec3::Y * *radius, DVec3::Y),
            Geometry::Disc { center, normal, .. } => off(*center, *normal),
            Geometry::Cylinder { base, axis, length, radius } => {
                let n = axis.any_orthonormal_vector();
                off(base + axis * (0.5 * length) + n * *radius, n)
            }
            Geometry::LensFace(face) => face.ends()[0],
        })
        .collect();
    points.extend(scene.lights.iter().zip(shifts).filter_map(|(light, shift)| Some(light.position()? + shift)));
    initial_interiors(scene, &points)
}

fn size(x: f64, y: f64) -> Vec4 {
    Vec4::new(x as f32, y as f32, 0.0, 0.0)
}

/// Texels as the shader reads them: how one is chosen, and what is in it.
fn environment_texels(map: &EnvironmentMap) -> Vec<Vec4> {
    let choice = |(i, (probability, threshold, alias)): (usize, (f64, f64, u32))| {
        let pdf = probability / map.solid_angle(i / map.width as usize);
        Vec4::new(threshold as f32, f32::from_bits(alias), pdf as f32, 0.0)
    };
    let choices = alias_table(&map.weights()).into_iter().enumerate().map(choice);
    let (stride, contents): (usize, Box<dyn Iterator<Item = [f32; 4]>>) = match &map.texels {
        EnvironmentTexels::Colors(texels) => (1, Box::new(texels.iter().copied())),
        EnvironmentTexels::Spectra(spectra) => (spectra.stride(), Box::new(spectra.padded())),
    };
    let mut contents = contents.map(Vec4::from_array);
    choices.flat_map(|choice| [choice].into_iter().chain(contents.by_ref().take(stride).collect::<Vec<_>>())).collect()
}
