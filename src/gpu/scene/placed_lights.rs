//! The lights that have a place, and what each could send to a point of the scene (Conty Estevez & Kulla, "Importance sampling of many lights with adaptive
//! tree splitting", HPG 2018).

use crate::geometry::{Bounds, bounds, corners, triangle_area};
use crate::scene::{Geometry, Light, Scene};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Directions of normals: all within `angle` of `axis`; over all of them light leaves up to a right angle away.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    pub axis: DVec3,
    /// Radians; pi for every direction.
    pub angle: f64,
}

/// A light, or what several come to.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedLight {
    pub bounds: Bounds,
    pub cone: Cone,
    pub two_sided: bool,
    /// Share of the scene's light.
    pub share: f64,
}

impl Cone {
    /// Everything.
    const ALL: Cone = Cone { axis: DVec3::Z, angle: PI };

    fn union(self, b: Cone) -> Cone {
        let (a, b) = if self.angle >= b.angle { (self, b) } else { (b, self) };
        let between = a.axis.angle_between(b.axis);
        if (between + b.angle).min(PI) <= a.angle {
            return a;
        }
        let angle = 0.5 * (a.angle + between + b.angle);
        let pivot = a.axis.cross(b.axis);
        if angle >= PI || pivot.length_squared() < 1e-20 {
            return Cone::ALL;
        }
        Cone { axis: glam::DQuat::from_axis_angle(pivot.normalize(), angle - a.angle) * a.axis, angle }
    }
}

impl PlacedLight {
    pub fn union(self, b: PlacedLight) -> PlacedLight {
        PlacedLight {
            bounds: self.bounds.union(b.bounds),
            cone: self.cone.union(b.cone),
            two_sided: self.two_sided || b.two_sided,
            share: self.share + b.share,
        }
    }

    pub fn center(&self) -> DVec3 {
        0.5 * (self.bounds.min + self.bounds.max)
    }
}

/// A light as points of the scene see it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Glimpse {
    center: DVec3,
    radius: f64,
    axis: DVec3,
    cos_angle: f64,
    sin_angle: f64,
    two_sided: bool,
    share: f64,
}

impl From<&PlacedLight> for Glimpse {
    fn from(light: &PlacedLight) -> Self {
        let (sin_angle, cos_angle) = light.cone.angle.sin_cos();
        let radius = 0.5 * (light.bounds.max - light.bounds.min).length();
        let (axis, two_sided, share) = (light.cone.axis, light.two_sided, light.share);
        Glimpse { center: light.center(), radius, axis, cos_angle, sin_angle, two_sided, share }
    }
}

impl Glimpse {
    /// What the light could send to `p`: Conty Estevez & Kulla (2018), eq. 3: an upper bound, zero only where the whole of it faces away.
    pub fn importance(&self, p: DVec3) -> f64 {
        let v = p - self.center;
        let (d2, r2) = (v.length_squared(), self.radius * self.radius);
        let nearest = self.share / d2.max(r2).max(1e-30);
        if d2 <= r2 {
            return nearest;
        }
        let way = self.axis.dot(v) / d2.sqrt();
        let cos = if self.two_sided { way.abs() } else { way }.clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        let sin_radius = self.radius / d2.sqrt();
        let cos_radius = (1.0 - sin_radius * sin_radius).sqrt();
        // The angle off the axis less that of the cone, and then less that of the sphere.
        let (cos, sin) = if cos >= self.cos_angle {
            (1.0, 0.0)
        } else {
            (cos * self.cos_angle + sin * self.sin_angle, sin * self.cos_angle - cos * self.sin_angle)
        };
        nearest * if cos >= cos_radius { 1.0 } else { (cos * cos_radius + sin * sin_radius).max(0.0) }
    }
}

/// The lights of a scene that have a place, in the order of their records (lights.rs), each with its power as its share.
pub(super) fn placed(scene: &Scene) -> Vec<PlacedLight> {
    let (lo, hi) = (scene.film.bins.min_nm, scene.film.bins.max_nm);
    let mut out = Vec::new();
    for shape in &scene.shapes {
        let Some(emission) = shape.emission.as_ref().filter(|e| !e.radiance.is_zero()) else { continue };
        let two_sided = emission.two_sided;
        let exitance = PI * emission.radiance.mean(lo, hi) * if two_sided { 2.0 } else { 1.0 };
        match &shape.geometry {
            Geometry::Mesh(mesh) => out.extend((0..mesh.triangles.len()).map(|t| {
                let [a, b, c] = corners(mesh, t);
                let bounds = Bounds { min: a.min(b).min(c), max: a.max(b).max(c) };
                let axis = (b - a).cross(c - a).normalize_or(DVec3::Z);
                PlacedLight { bounds, cone: Cone { axis, angle: 0.0 }, two_sided, share: exitance * triangle_area([a, b, c]) }
            })),
            other => {
                let cone = match other {
                    Geometry::Disc { normal, .. } => Cone { axis: *normal, angle: 0.0 },
                    _ => Cone::ALL,
                };
                out.push(PlacedLight { bounds: bounds(other), cone, two_sided, share: exitance * crate::geometry::area(other) });
            }
        }
    }
    for light in &scene.lights {
        let at = |p: &DVec3, reach: f64| Bounds { min: *p - reach, max: *p + reach };
        let (bounds, cone, share) = match light {
            Light::Point { position, intensity } => (at(position, 0.0), Cone::ALL, 4.0 * PI * intensity.mean(lo, hi)),
            Light::Spot { position, direction, intensity, cos_outer, .. } => {
                let cone = Cone { axis: *direction, angle: cos_outer.clamp(-1.0, 1.0).acos() };
                (at(position, 0.0), cone, 2.0 * PI * (1.0 - cos_outer) * intensity.mean(lo, hi))
            }
            Light::Profile { position, axes, intensity, profile } => {
                // Light leaves up to a right angle off the cone.
                let cone = Cone { axis: axes.z_axis, angle: (profile.reach() - FRAC_PI_2).max(0.0) };
                (at(position, 0.0), cone, profile.solid_angle() * intensity.mean(lo, hi))
            }
            Light::Beam { origin, direction, radius, irradiance } => {
                let cone = Cone { axis: *direction, angle: 0.0 };
                (at(origin, *radius), cone, PI * radius * radius * irradiance.mean(lo, hi))
            }
            Light::Sun { .. } | Light::Constant { .. } | Light::Image(_) => continue,
        };
        out.push(PlacedLight { bounds, cone, two_sided: false, share });
    }
    out
}

/// Points of the scene that are asked whether lights differ for them.
const POINTS: usize = 64;
/// A grid is of use from here on: how much larger the mean square of what a light sample finds is where lights are chosen by power, shadows left out.
const CONTRAST: f64 = 1.25;

/// Does a grid over the scene pay (`light_grid`)? It does where lights are many, spread apart or turned away from one another: a place sees few of
/// them well.
pub fn light_grid_pays(scene: &Scene) -> bool {
    let lights = placed(scene);
    lights.len() > 1 && contrast(&lights, &places(scene)) > CONTRAST
}

/// Mean square of what a light sample finds over the square of its mean, in the (geometric) mean over `points`, if lights are chosen by power.
fn contrast(lights: &[PlacedLight], points: &[DVec3]) -> f64 {
    let total: f64 = lights.iter().map(|l| l.share).sum();
    let seen: Vec<_> = lights.iter().filter(|l| l.share > 0.0).map(|l| (Glimpse::from(l), l.share / total)).collect();
    let contrasts = points.iter().map(|&p| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for (light, share) in &seen {
            let seen = light.importance(p);
            sum += seen;
            squares += seen * seen / share;
        }
        // Where nothing shines, nothing is to be chosen.
        (sum > 0.0).then(|| squares / (sum * sum))
    });
    let contrasts: Vec<f64> = contrasts.flatten().collect();
    // The logarithm, since one place beside a lamp should not decide.
    (contrasts.iter().map(|c| c.ln()).sum::<f64>() / contrasts.len().max(1) as f64).exp()
}

/// Points on what is lit, spread over the primitives.
fn places(scene: &Scene) -> Vec<DVec3> {
    let lit: Vec<_> = scene.shapes.iter().filter(|s| s.emission.is_none()).map(|s| &s.geometry).collect();
    let each = POINTS.div_ceil(lit.len().max(1));
    let step = lit.len().div_ceil(POINTS).max(1);
    let on = |geometry: &Geometry| -> Vec<DVec3> {
        match geometry {
            Geometry::Mesh(mesh) => {
                // Corners and middles of evenly chosen triangles: a wall has but two.
                let middle = |i: usize| {
                    let [a, b, c] = corners(mesh, i * mesh.triangles.len() / each);
                    let (u, v) = ((0.755 * i as f64).fract(), (0.57 * i as f64).fract());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    a + u * (b - a) + v * (c - a)
                };
                (0..each).map(middle).collect()
            }
            other => {
                let b = bounds(other);
                vec![0.5 * (b.min + b.max)]
            }
        }
    };
    lit.into_iter().step_by(step).flat_map(on).collect()
}
