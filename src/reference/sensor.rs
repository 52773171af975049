//! The four sensors: rays that they look along (backward), and what light that reaches them adds to which pixels (forward).

use super::rng::Rng;
use crate::bsdf::sample_cosine;
use crate::geometry::world::Ray;
use crate::lens::{LensCamera, LensRay, Tracer};
use crate::scene::{FilmSettings, Filter, Sensor};
use glam::{DMat3, DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::PI;

/// A ray along which a pixel looks, and what the radiance along it counts for.
pub(super) struct View {
    pub ray: Ray,
    pub weight: f64,
}

/// A straight connection from a point to the sensor.
pub(super) struct Connection {
    /// Direction from the point.
    pub dir: DVec3,
    pub distance: f64,
    /// Where on the film, in pixels, and pixel value per W sr^-1 nm^-1 sent that way, without the filter: of every wavelength, or one for all.
    pub landings: Vec<([f64; 2], f64)>,
}

/// Points and directions of a camera with a lens: from its coordinates to the world.
struct Mount<'a> {
    lens: &'a LensCamera,
    eye: DVec3,
    frame: DMat3,
}

impl Mount<'_> {
    fn eye_in_lens(&self) -> DVec3 {
        dvec3(0.0, 0.0, self.lens.eye_z)
    }

    /// Film position in pixels from one in m: the image is upside down.
    fn pixels(&self, film: &FilmSettings, at: DVec2) -> [f64; 2] {
        let q = dvec2(f64::from(film.width), f64::from(film.height)) * at / self.lens.film;
        film_position(film, -q.x, -q.y)
    }

    /// A ray through the last surface from the place of the picture, in pixels about its centre; `None` where the lens stops it.
    fn view(&self, film: &FilmSettings, (x, y): (f64, f64), nm: f64, rng: &mut Rng) -> Option<View> {
        let lens = self.lens;
        let at = -dvec2(x, y) * lens.film / dvec2(f64::from(film.width), f64::from(film.height));
        let bound = lens.pupil_at(at.length());
        // A circle around the bound: this needs no more of it than that nothing gets through outside.
        let radius = bound.center.abs() + bound.half.max_element();
        let from = lens.ray_from_film(at, sample_disc(radius, rng).truncate());
        let out = Tracer::new(&lens.lens, nm).trace(from).filter(|out| out.is_clear())?;
        let weight = out.transmission * lens.land(&from).1 * PI * radius * radius / lens.axial;
        let start = out.ray.at(lens.start_z) - self.eye_in_lens();
        Some(View { ray: Ray::new(self.eye + self.frame * start, self.frame * out.ray.d), weight })
    }

    fn connect(&self, film: &FilmSettings, p: DVec3, nm: &[f64], rng: &mut Rng) -> Option<Connection> {
        let lens = self.lens;
        let from = self.frame.transpose() * (p - self.eye) + self.eye_in_lens();
        let entry = sample_disc(lens.front.radius, rng) + dvec3(0.0, 0.0, lens.front.z) - from;
        if from.z >= lens.start_z || entry.z <= 0.0 {
            return None;
        }
        let d = entry.normalize();
        let pixel = lens.film.x * lens.film.y / f64::from(film.width * film.height);
        let weight = PI * lens.front.radius.powi(2) * d.z / (entry.length_squared() * pixel * lens.axial);
        let land = |nm: &f64| {
            let out = Tracer::new(&lens.lens, *nm).trace(LensRay { o: from, d }).filter(|out| out.is_clear());
            let land = |out: crate::lens::trace::Out| (self.pixels(film, lens.land(&out.ray).0), weight * out.transmission);
            out.map_or(([f64::MIN; 2], 0.0), land)
        };
        let distance = (lens.start_z - from.z) / d.z;
        Some(Connection { dir: self.frame * d, distance, landings: nm.iter().map(land).collect() })
    }
}

/// Size of a pixel on the plane at distance 1.
fn pixel_size(tan_half_vfov: f64, film: &FilmSettings) -> f64 {
    2.0 * tan_half_vfov / f64::from(film.height)
}

/// Film position in pixels from coordinates in pixels about the centre, y upwards (and back, being its own mirror image).
fn film_position(film: &FilmSettings, x: f64, y: f64) -> [f64; 2] {
    [0.5 * f64::from(film.width) + x, 0.5 * f64::from(film.height) - y]
}

/// Whether wavelengths go different ways between the film and the scene.
pub(super) fn disperses(sensor: &Sensor) -> bool {
    sensor.optics().is_some()
}

/// A random ray of a pixel, at `nm`; `None` where a lens stops it.
pub(super) fn sample_view(sensor: &Sensor, film: &FilmSettings, pixel: usize, nm: f64, rng: &mut Rng) -> Option<View> {
    let (col, row) = ((pixel % film.width as usize) as f64, (pixel / film.width as usize) as f64);
    let centred = |rng: &mut Rng| {
        let (dx, dy) = (sample_filter(film.filter, rng), sample_filter(film.filter, rng));
        (col + 0.5 + dx - 0.5 * f64::from(film.width), 0.5 * f64::from(film.height) - (row + 0.5 + dy))
    };
    Some(match sensor {
        Sensor::Perspective { eye, frame, optics: Some(lens), .. } => {
            return Mount { lens, eye: *eye, frame: *frame }.view(film, centred(rng), nm, rng);
        }
        Sensor::Perspective { eye, frame, tan_half_vfov, lens_radius, focus_distance, optics: None } => {
            let (x, y) = centred(rng);
            let s = pixel_size(*tan_half_vfov, film);
            let (focus, lens) = (dvec3(x * s, y * s, -1.0) * *focus_distance, sample_disc(*lens_radius, rng));
            View { ray: Ray::new(*eye + *frame * lens, (*frame * (focus - lens)).normalize()), weight: 1.0 }
        }
        Sensor::Orthographic { eye, frame, height } => {
            let (x, y) = centred(rng);
            let s = height / f64::from(film.height);
            View { ray: Ray::new(*eye + *frame * dvec3(x * s, y * s, 0.0), -frame.z_axis), weight: 1.0 }
        }
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            let u = (col + rng.next()) / f64::from(film.width);
            let v = 1.0 - (row + rng.next()) / f64::from(film.height);
            measure(*origin + *edge_u * u + *edge_v * v, edge_u.cross(*edge_v).normalize(), rng)
        }
        Sensor::IrradianceSphere { center, radius } => {
            let phi = 2.0 * PI * (col + rng.next()) / f64::from(film.width);
            let y = 1.0 - 2.0 * (row + rng.next()) / f64::from(film.height);
            let r = ((1.0 - y) * (1.0 + y)).max(0.0).sqrt();
            let n = dvec3(r * phi.cos(), y, -r * phi.sin());
            measure(*center + n * *radius, n, rng)
        }
    })
}

/// Irradiance at `p`: pi times the radiance from a cosine-distributed direction.
fn measure(p: DVec3, n: DVec3, rng: &mut Rng) -> View {
    let (x, y) = n.any_orthonormal_pair();
    let dir = (DMat3::from_cols(x, y, n) * sample_cosine(rng.next2())).normalize();
    View { ray: Ray::new(p, dir), weight: PI }
}

/// Connects a point to a camera, through a random point of its lens, at the wavelengths `nm`. Sensors of irradiance are crossed instead: see [`crossings`].
pub(super) fn connect(sensor: &Sensor, film: &FilmSettings, p: DVec3, nm: &[f64], rng: &mut Rng) -> Option<Connection> {
    match sensor {
        Sensor::Perspective { eye, frame, optics: Some(lens), .. } => {
            Mount { lens, eye: *eye, frame: *frame }.connect(film, p, nm, rng)
        }
        Sensor::Perspective { eye, frame, tan_half_vfov, lens_radius, focus_distance, optics: None } => {
            let lens = sample_disc(*lens_radius, rng);
            let from = frame.transpose() * (p - *eye) - lens;
            let (distance, cos) = (from.length(), -from.z / from.length());
            if cos.is_nan() || cos <= 0.0 {
                return None;
            }
            let (s, focus) = (pixel_size(*tan_half_vfov, film), lens / *focus_distance + from / -from.z);
            // A pixel's square covers the solid angle s^2 cos^3 seen from the lens.
            let weight = 1.0 / (distance * distance * s * s * cos * cos * cos);
            let film = film_position(film, focus.x / s, focus.y / s);
            Some(Connection { dir: *frame * (-from / distance), distance, landings: vec![(film, weight)] })
        }
        Sensor::Orthographic { eye, frame, height } => {
            let from = frame.transpose() * (p - *eye);
            let s = height / f64::from(film.height);
            let film = film_position(film, from.x / s, from.y / s);
            (from.z < 0.0).then_some(Connection { dir: frame.z_axis, distance: -from.z, landings: vec![(film, 1.0 / (s * s))] })
        }
        Sensor::IrradiancePlane { .. } | Sensor::IrradianceSphere { .. } => None,
    }
}

/// Where a ray crosses a sensor of irradiance from its front: distance, pixel, and 1 / area of the pixel.
pub(super) fn crossing(sensor: &Sensor, film: &FilmSettings, ray: &Ray) -> Option<(f64, usize, f64)> {
    let (w, h) = (f64::from(film.width), f64::from(film.height));
    let pixel = |u: f64, v: f64| (v * h).min(h - 1.0) as usize * film.width as usize + (u * w).min(w - 1.0) as usize;
    match sensor {
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            let n = edge_u.cross(*edge_v);
            let area = n.length();
            let (t, rel) = ((*origin - ray.origin).dot(n) / ray.dir.dot(n), ray.origin - *origin);
            let rel = rel + ray.dir * t;
            // Coordinates along edges that need not be at right angles.
            let (u, v) = (rel.cross(*edge_v).dot(n) / (area * area), edge_u.cross(rel).dot(n) / (area * area));
            let inside = (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v);
            (ray.dir.dot(n) < 0.0 && t > 0.0 && inside).then(|| (t, pixel(u, 1.0 - v), w * h / area))
        }
        Sensor::IrradianceSphere { center, radius } => {
            let oc = ray.origin - *center;
            let b = oc.dot(ray.dir);
            let miss = (oc - ray.dir * b).length();
            let t = -b - ((radius - miss) * (radius + miss)).max(0.0).sqrt();
            if miss >= *radius || t <= 0.0 {
                return None;
            }
            let n = (oc + ray.dir * t) / *radius;
            let u = (-n.z).atan2(n.x).rem_euclid(2.0 * PI) / (2.0 * PI);
            Some((t, pixel(u, (0.5 * (1.0 - n.y)).max(0.0)), w * h / (4.0 * PI * radius * radius)))
        }
        Sensor::Perspective { .. } | Sensor::Orthographic { .. } => None,
    }
}

/// Points that the sensor's own surface spans, which light from infinity must cover.
pub(super) fn corners(sensor: &Sensor) -> Vec<DVec3> {
    match sensor {
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            vec![*origin, *origin + *edge_u, *origin + *edge_v, *origin + *edge_u + *edge_v]
        }
        Sensor::IrradianceSphere { center, radius } => {
            vec![*center - DVec3::splat(*radius), *center + DVec3::splat(*radius)]
        }
        Sensor::Perspective { .. } | Sensor::Orthographic { .. } => vec![],
    }
}

fn sample_disc(radius: f64, rng: &mut Rng) -> DVec3 {
    if radius == 0.0 {
        return DVec3::ZERO;
    }
    let (r, phi) = (radius * rng.next().sqrt(), 2.0 * PI * rng.next());
    dvec3(r * phi.cos(), r * phi.sin(), 0.0)
}

/// The pixels whose filter covers a film position, with the filter's value (1 over the pixel for a box).
pub(super) fn splat(film: &FilmSettings, at: [f64; 2], mut add: impl FnMut(usize, f64)) {
    let radius = match film.filter {
        Filter::Box => 0.5,
        Filter::Tent { radius } => radius,
        Filter::Gaussian { sigma } => 3.0 * sigma,
    };
    // First and last pixel along one axis whose centre is within the radius; a float cast saturates, so far-off points give empty ranges.
    let range = |x: f64, n: u32| {
        ((x - radius - 0.5).ceil().max(0.0) as i64)..=((x + radius - 0.5).floor().min(f64::from(n) - 1.0) as i64)
    };
    for row in range(at[1], film.height) {
        for col in range(at[0], film.width) {
            let w = eval_filter(film.filter, at[0] - col as f64 - 0.5) * eval_filter(film.filter, at[1] - row as f64 - 0.5);
            if w > 0.0 {
                add(row as usize * film.width as usize + col as usize, w);
            }
        }
    }
}

/// Density of the filter along one axis, per pixel.
fn eval_filter(filter: Filter, x: f64) -> f64 {
    match filter {
        Filter::Box => f64::from(u8::from((-0.5..0.5).contains(&x))),
        Filter::Tent { radius } => (1.0 - x.abs() / radius).max(0.0) / radius,
        Filter::Gaussian { sigma } if x.abs() <= 3.0 * sigma => {
            // erf(3 / sqrt 2): what the cut leaves.
            const INSIDE: f64 = 0.997_300_203_936_740;
            (-0.5 * (x / sigma).powi(2)).exp() / ((2.0 * PI).sqrt() * sigma * INSIDE)
        }
        Filter::Gaussian { .. } => 0.0,
    }
}

/// A displacement with that density.
fn sample_filter(filter: Filter, rng: &mut Rng) -> f64 {
    match filter {
        Filter::Box => rng.next() - 0.5,
        Filter::Tent { radius } => radius * (rng.next() - rng.next()),
        Filter::Gaussian { sigma } => loop {
            let x = (-2.0 * (1.0 - rng.next()).ln()).sqrt() * (2.0 * PI * rng.next()).cos();
            if x.abs() <= 3.0 {
                return sigma * x;
            }
        },
    }
}
