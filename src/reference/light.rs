//! Lights: where light starts (forward), and what arrives from infinity (backward).

use super::Stage;
use super::rng::Rng;
use super::start::{off_light, on_surface};
use super::walk::{Path, WavelengthSample};
use crate::bsdf::sample_cosine;
use crate::geometry::Coordinates;
use crate::geometry::world::Ray;
use crate::scene::{EnvironmentMap, Geometry, Light, Mesh, Scene, spot_solid_angle};
use crate::spectrum::Spectrum;
use glam::{DMat3, DVec2, DVec3, dvec3};
use std::f64::consts::PI;

/// All that gives light, to choose from by power.
pub(super) struct Emitters {
    what: Vec<What>,
    /// Running sum of the shares of power.
    cumulative: Vec<f64>,
    /// The ball that light from infinity falls on.
    ball: (DVec3, f64),
}

enum What {
    /// A shape, its area, and running sums of its triangles' areas.
    Shape {
        shape: usize,
        area: f64,
        triangles: Vec<f64>,
    },
    Light {
        light: usize,
        texels: Vec<f64>,
    },
}

/// Flux by wavelength, W nm^-1.
type Flux<'a> = dyn Fn(f64) -> f64 + 'a;

/// Light as it starts.
pub(super) struct Emitted {
    pub path: Path,
    /// Density of the emitted flux per solid angle about the surface that light left, if it has one: `cos / pi`.
    pub normal: Option<DVec3>,
}

impl Emitters {
    pub(super) fn new(scene: &Scene, ball: (DVec3, f64)) -> Self {
        let mean = |s: &Spectrum| s.mean(scene.film.bins.min_nm, scene.film.bins.max_nm);
        let cross_section = PI * ball.1 * ball.1;
        let mut what = Vec::new();
        let mut cumulative = Vec::new();
        let mut total = 0.0;
        let mut push = |emitter: What, power: f64| {
            if power > 0.0 {
                total += power;
                what.push(emitter);
                cumulative.push(total);
            }
        };
        for (shape, s) in scene.shapes.iter().enumerate() {
            let Some(emission) = &s.emission else { continue };
            let triangles = if let Geometry::Mesh(mesh) = &s.geometry { running_areas(mesh) } else { vec![] };
            let area = triangles.last().copied().unwrap_or_else(|| crate::geometry::area(&s.geometry));
            let sides = if emission.two_sided { 2.0 } else { 1.0 };
            push(
                What::Shape { shape, area, triangles },
                sides * PI * area * emission.radiance.mean(scene.film.bins.min_nm, scene.film.bins.max_nm),
            );
        }
        for (light, l) in scene.lights.iter().enumerate() {
            let texels = if let Light::Image(map) = l { running_radiance(scene, map) } else { vec![] };
            let power = match l {
                Light::Point { intensity, .. } => 4.0 * PI * mean(intensity),
                Light::Spot { intensity, cos_inner, cos_outer, falloff, .. } => {
                    spot_solid_angle(*cos_inner, *cos_outer, *falloff) * mean(intensity)
                }
                Light::Profile { intensity, profile, .. } => profile.solid_angle() * mean(intensity),
                Light::Beam { radius, irradiance, .. } => PI * radius * radius * mean(irradiance),
                Light::Sun { irradiance, .. } => cross_section * mean(irradiance),
                Light::Constant { radiance } => 4.0 * PI * cross_section * mean(radiance),
                Light::Image(_) => cross_section * texels.last().copied().unwrap_or(0.0),
            };
            push(What::Light { light, texels }, power);
        }
        Self { what, cumulative, ball }
    }
}

impl Stage {
    /// Starts a light path, with a sample at each of the wavelengths `nm`, carrying flux over the probability of choosing it. `None` in the dark.
    pub(super) fn emit(&self, nm: &[f64], rng: &mut Rng) -> Option<Emitted> {
        let emitters = &self.emitters;
        let (index, share) = choose(&emitters.cumulative, rng)?;
        let wavelengths = |flux: &Flux| -> Vec<WavelengthSample> {
            nm.iter().enumerate().map(|(bin, &nm)| WavelengthSample { bin, nm, beta: flux(nm) / share, etendue: 1.0 }).collect()
        };
        let light = match &emitters.what[index] {
            What::Shape { shape, area, triangles } => return self.emit_shape(*shape, *area, triangles, &wavelengths, rng),
            What::Light { light, texels } => (&self.scene.lights[*light], texels),
        };
        let (center, radius) = emitters.ball;
        let cross_section = PI * radius * radius;
        let far = |dir: DVec3, rng: &mut Rng| Ray::new(center - dir * radius + on_disc(dir, radius, rng), dir);
        let (ray, wavelengths) = match light {
            (Light::Point { position, intensity }, _) => {
                (Ray::new(*position, on_cone(DVec3::Y, -1.0, rng)), wavelengths(&|nm| 4.0 * PI * intensity.eval(nm)))
            }
            (Light::Spot { position, direction, intensity, cos_inner, cos_outer, falloff }, _) => {
                let dir = on_cone(*direction, *cos_outer, rng);
                let share = (dir.dot(*direction) - cos_outer) / (cos_inner - cos_outer);
                let weight = falloff.at(share) * 2.0 * PI * (1.0 - cos_outer);
                (Ray::new(*position, dir), wavelengths(&|nm| weight * intensity.eval(nm)))
            }
            (Light::Profile { position, axes, intensity, profile }, _) => {
                let dir = on_cone(DVec3::Y, -1.0, rng);
                let weight = profile.eval(axes.transpose() * dir) * 4.0 * PI;
                (Ray::new(*position, dir), wavelengths(&|nm| weight * intensity.eval(nm)))
            }
            (Light::Beam { origin, direction, radius, irradiance }, _) => {
                let ray = Ray::new(*origin + on_disc(*direction, *radius, rng), *direction);
                (ray, wavelengths(&|nm| PI * radius * radius * irradiance.eval(nm)))
            }
            (Light::Sun { direction, cos_angle, irradiance }, _) => {
                let ray = far(on_cone(*direction, cos_angle.min(1.0), rng), rng);
                // Solid angle over projected solid angle of the disc; 1 for parallel light.
                let spread = 2.0 / (1.0 + cos_angle.min(1.0));
                (ray, wavelengths(&|nm| cross_section * spread * irradiance.eval(nm)))
            }
            (Light::Constant { radiance }, _) => {
                (far(on_cone(DVec3::Y, -1.0, rng), rng), wavelengths(&|nm| 4.0 * PI * cross_section * radiance.eval(nm)))
            }
            (Light::Image(map), texels) => {
                let (texel, share) = choose(texels, rng)?;
                let (row, col) = (texel / map.width as usize, texel % map.width as usize);
                let (top, bottom) = row_edges(map, row);
                let (y, phi) = (top + (bottom - top) * rng.next(), 2.0 * PI * (col as f64 + rng.next()) / f64::from(map.width));
                let r = ((1.0 - y) * (1.0 + y)).max(0.0).sqrt();
                let dir = -(map.to_local.transpose() * dvec3(r * phi.cos(), y, r * phi.sin())).normalize();
                let solid_angle = 2.0 * PI / f64::from(map.width) * (top - bottom);
                (far(dir, rng), wavelengths(&|nm| texel_radiance(map, texel, nm) * solid_angle / share * cross_section))
            }
        };
        let ray = Ray::new(ray.origin + off_light(light.0, self.world.extent), ray.dir);
        let inside = self.interiors_at(ray.origin);
        let mut path = Path::new(ray, wavelengths, inside);
        if light.0.is_distant() {
            // Light that would have to come through an endless medium does not arrive.
            let medium = &self.scene.interiors[0];
            path.wavelengths.retain(|l| medium.sigma_a.eval(l.nm) + medium.sigma_s.eval(l.nm) == 0.0);
        }
        Some(Emitted { path, normal: None })
    }

    fn emit_shape(
        &self,
        shape: usize,
        area: f64,
        triangles: &[f64],
        wavelengths: &dyn Fn(&Flux) -> Vec<WavelengthSample>,
        rng: &mut Rng,
    ) -> Option<Emitted> {
        let scene = &self.scene;
        let emission = scene.shapes[shape].emission.as_ref()?;
        let (p, outward, uv) = on_shape(&scene.shapes[shape].geometry, triangles, rng)?;
        let back = emission.two_sided && rng.next() < 0.5;
        let n = if back { -outward } else { outward };
        let (x, y) = n.any_orthonormal_pair();
        let dir = (DMat3::from_cols(x, y, n) * sample_cosine(rng.next2())).normalize();
        let sides = if emission.two_sided { 2.0 } else { 1.0 };
        let wavelengths = wavelengths(&|nm| sides * PI * area * emission.radiance.eval(nm, uv));
        // On the side that it leaves to, of its own surface and of all that this lies in.
        let p = p + n * on_surface(p, self.world.extent);
        Some(Emitted { path: Path::new(Ray::new(p, dir), wavelengths, self.interiors_at(p)), normal: Some(n) })
    }

    /// Radiance that arrives from infinity along `-dir`.
    pub(super) fn environment(&self, dir: DVec3, nm: f64) -> f64 {
        let from = |light: &Light| match light {
            Light::Constant { radiance } => radiance.eval(nm),
            Light::Sun { direction, cos_angle, irradiance } if *cos_angle < 1.0 && -dir.dot(*direction) >= *cos_angle => {
                irradiance.eval(nm) / (PI * (1.0 - cos_angle) * (1.0 + cos_angle))
            }
            Light::Image(map) => texel_radiance(map, texel_towards(map, dir), nm),
            _ => 0.0,
        };
        self.scene.lights.iter().map(from).sum()
    }
}

/// An index by its share of a running sum, and the share.
fn choose(cumulative: &[f64], rng: &mut Rng) -> Option<(usize, f64)> {
    let total = *cumulative.last()?;
    let x = rng.next() * total;
    let i = cumulative.partition_point(|&c| c <= x).min(cumulative.len() - 1);
    Some((i, (cumulative[i] - if i > 0 { cumulative[i - 1] } else { 0.0 }) / total))
}

fn corners(mesh: &Mesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|v| mesh.positions[v as usize])
}

fn running_areas(mesh: &Mesh) -> Vec<f64> {
    let areas = (0..mesh.triangles.len()).map(|t| {
        let [a, b, c] = corners(mesh, t);
        0.5 * (b - a).cross(c - a).length()
    });
    running(areas)
}

fn running(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values
        .scan(0.0, |sum, v| {
            *sum += v;
            Some(*sum)
        })
        .collect()
}

/// A uniform point of a shape: point, outward normal, coordinates for pictures.
fn on_shape(geometry: &Geometry, triangles: &[f64], rng: &mut Rng) -> Option<(DVec3, DVec3, Coordinates)> {
    Some(match geometry {
        Geometry::Mesh(mesh) => {
            let (t, _) = choose(triangles, rng)?;
            let [a, b, c] = corners(mesh, t);
            let (s, v) = (rng.next().sqrt(), rng.next());
            let weights = [s * (1.0 - v), s * v];
            let p = a * (1.0 - s) + b * weights[0] + c * weights[1];
            (p, (b - a).cross(c - a).normalize(), mesh.coordinates(t, weights))
        }
        // These do not emit.
        Geometry::Instance(_) | Geometry::LensFace(_) => return None,
        Geometry::Sphere { center, radius } => {
            let n = on_cone(DVec3::Y, -1.0, rng);
            (*center + n * *radius, n, DVec2::ZERO.into())
        }
        Geometry::Disc { center, normal, radius } => (*center + on_disc(*normal, *radius, rng), *normal, DVec2::ZERO.into()),
        Geometry::Cylinder { base, axis, length, radius } => {
            let (x, y) = axis.any_orthonormal_pair();
            let phi = 2.0 * PI * rng.next();
            let n = x * phi.cos() + y * phi.sin();
            (*base + *axis * (length * rng.next()) + n * *radius, n, DVec2::ZERO.into())
        }
    })
}

/// A uniform direction within the cone about `axis`; `cos = -1` is the whole sphere.
fn on_cone(axis: DVec3, cos: f64, rng: &mut Rng) -> DVec3 {
    let down = (1.0 - cos) * rng.next();
    let r = (down * (2.0 - down)).max(0.0).sqrt();
    let phi = 2.0 * PI * rng.next();
    let (x, y) = axis.any_orthonormal_pair();
    (x * (r * phi.cos()) + y * (r * phi.sin()) + axis * (1.0 - down)).normalize()
}

/// A uniform displacement on a disc across `n`.
fn on_disc(n: DVec3, radius: f64, rng: &mut Rng) -> DVec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (r, phi) = (radius * rng.next().sqrt(), 2.0 * PI * rng.next());
    x * (r * phi.cos()) + y * (r * phi.sin())
}

/// Cosines from +Y of the upper and lower edge of a row of texels.
fn row_edges(map: &EnvironmentMap, row: usize) -> (f64, f64) {
    let edge = |r: usize| (PI * r as f64 / f64::from(map.height)).cos();
    (edge(row), edge(row + 1))
}

fn texel_radiance(map: &EnvironmentMap, texel: usize, nm: f64) -> f64 {
    map.eval(texel, nm) * map.illuminant.eval(nm)
}

fn texel_towards(map: &EnvironmentMap, dir: DVec3) -> usize {
    let d = map.to_local * dir;
    let u = d.z.atan2(d.x).rem_euclid(2.0 * PI) / (2.0 * PI);
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let at = |x: f64, n: u32| (x * f64::from(n)).min(f64::from(n) - 1.0) as usize;
    at(v, map.height) * map.width as usize + at(u, map.width)
}

/// Running sums over texels of radiance times solid angle, at a few wavelengths: only the choice depends on it.
fn running_radiance(scene: &Scene, map: &EnvironmentMap) -> Vec<f64> {
    let bins = scene.film.bins;
    let wavelengths: Vec<f64> = (0..4).map(|i| bins.min_nm + (bins.max_nm - bins.min_nm) * (f64::from(i) + 0.5) / 4.0).collect();
    let weights = (0..map.count()).map(|texel| {
        let (top, bottom) = row_edges(map, texel / map.width as usize);
        let mean = wavelengths.iter().map(|&nm| texel_radiance(map, texel, nm)).sum::<f64>() / 4.0;
        mean * 2.0 * PI / f64::from(map.width) * (top - bottom)
    });
    running(weights)
}
