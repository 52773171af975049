//! What paths start on: the sensor, and lamps that have a place. Where one meets the boundary of a volume, every path finds out by itself which volumes
//! it starts in. Where one lies in a surface, as far as rounding can tell, its paths start on the side that they leave to: it counts as a little off that
//! surface.

use super::{FilmSettings, Filter, Geometry, Light, Scene, Sensor, Shape, bounds_of_all};
use crate::geometry::{Bounds, LensForm, bounds, corners};
use glam::{DVec3, dvec3};

/// Surfaces that are nearer than this to each other cannot be told apart in single precision; over the size of coordinates, or the length of a ray.
pub(crate) const SLACK: f64 = 2e-6;

/// What has no side of its own counts as a little above where it is.
const ABOVE: DVec3 = dvec3(0.3, 1.0, 0.2);

/// Comparisons of a lamp's primitives with those of other shapes: more are not made, and it counts as lying in all of them.
const MOST_PAIRS: usize = 20_000_000;

/// Where paths of a scene start.
pub(crate) struct Starts {
    /// The sensor, off all surfaces that it lies in.
    pub sensor: Sensor,
    /// Whether it lies in any.
    pub sensor_touches: bool,
    /// Whether its paths start in different volumes.
    pub sensor_meets_volume: bool,
    /// For each emitting shape how far off each of its primitives light starts, m: 0 for those that lie in no other surface; empty if none does.
    pub lifts: Vec<Vec<f64>>,
    /// What takes each of the scene's lights that are no shapes off the surfaces it lies in, m.
    pub shifts: Vec<DVec3>,
    /// Whether an emitting shape lies in a surface of another.
    pub lamps_touch: bool,
    /// Whether paths of one lamp start in different volumes.
    pub lamp_meets_volume: bool,
}

/// A piece of a surface.
struct Patch {
    form: Form,
    bounds: Bounds,
}

enum Form {
    Point(DVec3),
    Flat {
        normal: DVec3,
        points: [DVec3; 4],
    },
    Sphere {
        center: DVec3,
        radius: f64,
    },
    Cylinder {
        base: DVec3,
        axis: DVec3,
        radius: f64,
    },
    /// Somewhere in its box.
    Any,
}

impl Patch {
    fn flat(normal: DVec3, points: [DVec3; 4]) -> Self {
        let bounds = points.iter().fold(Bounds::EMPTY, |b, &p| b.union(Bounds { min: p, max: p }));
        Patch { form: Form::Flat { normal, points }, bounds }
    }

    fn point(p: DVec3) -> Self {
        Patch { form: Form::Point(p), bounds: Bounds { min: p, max: p } }
    }

    fn disc(center: DVec3, normal: DVec3, radius: f64) -> Self {
        let (x, y) = normal.any_orthonormal_pair();
        // Of the square around it.
        let points = [x + y, x - y, -x - y, y - x].map(|d| center + d * radius);
        Patch { form: Form::Flat { normal, points }, bounds: bounds(&Geometry::Disc { center, normal, radius }) }
    }

    /// Distances of a point from the surface that this is a piece of, with the normal there.
    fn off(&self, p: DVec3) -> (f64, DVec3) {
        match &self.form {
            Form::Point(q) => (p.distance(*q), DVec3::ZERO),
            Form::Flat { normal, points } => ((p - points[0]).dot(*normal), *normal),
            Form::Sphere { center, radius } => (p.distance(*center) - radius, (p - *center).normalize_or_zero()),
            Form::Cylinder { base, axis, radius } => {
                let across = (p - *base).reject_from_normalized(*axis);
                (across.length() - radius, across.normalize_or_zero())
            }
            Form::Any => (f64::NAN, DVec3::ZERO),
        }
    }

    /// Whether all of `points` lie to one side of the surface, farther than `slack`.
    fn parts(&self, points: &[DVec3], slack: f64) -> bool {
        points.iter().all(|&p| self.off(p).0 > slack) || points.iter().all(|&p| self.off(p).0 < -slack)
    }

    /// Whether this may cross or touch `other`.
    fn meets(&self, other: &Patch, slack: f64) -> bool {
        if !widened(&self.bounds, slack).overlaps(&other.bounds) {
            return false;
        }
        let is_apart = |a: &Patch, b: &Patch| match (&a.form, &b.form) {
            (Form::Flat { .. } | Form::Sphere { .. } | Form::Cylinder { .. }, Form::Flat { points, .. }) => {
                // The middle of a flat piece may reach into a round one, but not out of it.
                let inside = points.iter().all(|&p| a.off(p).0 < -slack);
                inside || (matches!(a.form, Form::Flat { .. }) && a.parts(points, slack))
            }
            (Form::Sphere { center: p, radius: r }, Form::Sphere { center: q, radius: s }) => {
                p.distance(*q) + s < r - slack || p.distance(*q) > r + s + slack
            }
            (Form::Sphere { .. }, _) => box_corners(&b.bounds).iter().all(|&p| a.off(p).0 < -slack),
            _ => false,
        };
        !is_apart(self, other) && !is_apart(other, self)
    }

    /// Whether this lies in the surface of `other`.
    fn lies_in(&self, other: &Patch, slack: f64) -> bool {
        if !widened(&self.bounds, slack).overlaps(&other.bounds) {
            return false;
        }
        let near = |a: &Patch, points: &[DVec3]| points.iter().all(|&p| a.off(p).0.abs() <= slack);
        match (&self.form, &other.form) {
            (Form::Point(p), _) => near(other, &[*p]),
            (Form::Flat { points: a, .. }, Form::Flat { points: b, .. }) => near(self, b) || near(other, a),
            (Form::Sphere { center: a, radius: r }, Form::Sphere { center: b, radius: s }) => {
                a.distance(*b) <= slack && (r - s).abs() <= slack
            }
            (Form::Cylinder { base: a, axis: x, radius: r }, Form::Cylinder { base: b, axis: y, radius: s }) => {
                (*b - *a).reject_from_normalized(*x).length() <= slack && x.cross(*y).length() <= SLACK && (r - s).abs() <= slack
            }
            _ => false,
        }
    }
}

/// Primitives of a shape, of a mesh those with a box that meets `within`.
fn patches(geometry: &Geometry, within: &Bounds) -> Vec<Patch> {
    match geometry {
        Geometry::Mesh(mesh) => (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = corners(mesh, t);
                // One of no area lies in nothing.
                Patch::flat((b - a).cross(c - a).normalize_or(DVec3::NAN), [a, b, c, a])
            })
            .filter(|patch| patch.bounds.overlaps(within))
            .collect(),
        Geometry::Instance(instance) => patches(&Geometry::Mesh(instance.flattened().into()), within),
        Geometry::Disc { center, normal, radius } => vec![Patch::disc(*center, *normal, *radius)],
        &Geometry::Sphere { center, radius } => {
            vec![Patch { form: Form::Sphere { center, radius }, bounds: bounds(geometry) }]
        }
        &Geometry::Cylinder { base, axis, radius, .. } => {
            vec![Patch { form: Form::Cylinder { base, axis, radius }, bounds: bounds(geometry) }]
        }
        Geometry::LensFace(face) => {
            let (low, high) = face.heights();
            vec![match &face.form {
                LensForm::Edge { radius, .. } => {
                    Patch { form: Form::Cylinder { base: face.base, axis: face.axis, radius: *radius }, bounds: bounds(geometry) }
                }
                _ if low == high => Patch::disc(face.base + face.axis * low, face.axis, face.radius()),
                _ => Patch { form: Form::Any, bounds: bounds(geometry) },
            }]
        }
    }
}

/// The surface that a sensor's paths start on, and where they go, if all go to one side.
fn of_sensor(sensor: &Sensor, film: &FilmSettings) -> (Patch, DVec3) {
    match sensor {
        Sensor::Perspective { eye, frame, lens_radius, .. } if *lens_radius > 0.0 => {
            (Patch::disc(*eye, frame.z_axis, *lens_radius), -frame.z_axis)
        }
        // An eye at the water line is above the water.
        Sensor::Perspective { eye, frame, .. } => (Patch::point(*eye), 0.05 * ABOVE - frame.z_axis),
        Sensor::Orthographic { eye, frame, height } => {
            let reach = match film.filter {
                Filter::Box => 0.0,
                Filter::Tent { radius } => radius,
                Filter::Gaussian { sigma } => 3.0 * sigma,
            };
            let half = |pixels: u32| height / f64::from(film.height) * (0.5 * f64::from(pixels) + reach);
            let (x, y) = (frame.x_axis * half(film.width), frame.y_axis * half(film.height));
            (Patch::flat(frame.z_axis, [*eye - x - y, *eye + x - y, *eye + x + y, *eye - x + y]), -frame.z_axis)
        }
        Sensor::IrradiancePlane { origin, edge_u, edge_v } => {
            let n = edge_u.cross(*edge_v).normalize();
            (Patch::flat(n, [*origin, *origin + *edge_u, *origin + *edge_u + *edge_v, *origin + *edge_v]), n)
        }
        &Sensor::IrradianceSphere { center, radius } => {
            let form = Form::Sphere { center, radius };
            (Patch { form, bounds: bounds(&Geometry::Sphere { center, radius }) }, DVec3::ZERO)
        }
    }
}

fn of_light(light: &Light) -> Option<(Patch, DVec3)> {
    let place = light.placement()?;
    let patch =
        if place.radius > 0.0 { Patch::disc(place.position, place.axis, place.radius) } else { Patch::point(place.position) };
    Some((patch, if place.is_even() { ABOVE } else { place.axis }))
}

/// What a scene's coordinates are measured from on the GPU, and its shapes.
struct Surroundings<'a> {
    scene: &'a Scene,
    origin: DVec3,
    /// Of all shapes.
    bounds: Vec<Bounds>,
}

impl Surroundings<'_> {
    /// Greatest coordinates of both boxes, along each axis.
    fn extent(&self, a: &Bounds, b: &Bounds) -> DVec3 {
        let of = |b: &Bounds| (b.min - self.origin).abs().max((b.max - self.origin).abs());
        of(a).max(of(b))
    }

    fn slack(&self, a: &Bounds, b: &Bounds) -> f64 {
        SLACK * self.extent(a, b).max_element()
    }

    /// Shapes whose box meets this one, but for `own`.
    fn near(&self, b: &Bounds, own: Option<usize>) -> impl Iterator<Item = &Shape> {
        let is_near = move |i: usize, other: &Bounds| {
            Some(i) != own && !other.is_empty() && widened(b, self.slack(b, other)).overlaps(other)
        };
        self.scene.shapes.iter().enumerate().filter(move |(i, _)| is_near(*i, &self.bounds[*i])).map(|(_, s)| s)
    }

    /// Primitives of a shape that may meet what is in the box `around`.
    fn pieces(&self, shape: &Shape, around: &Bounds) -> Vec<Patch> {
        patches(&shape.geometry, &widened(around, self.slack(around, &bounds(&shape.geometry))))
    }

    /// Whether one of `starts` meets one of `others`.
    fn meet(&self, starts: &[Patch], others: &[Patch]) -> bool {
        let meets = |a: &Patch, b: &Patch| a.meets(b, self.slack(&a.bounds, &b.bounds));
        starts.len().saturating_mul(others.len()) > MOST_PAIRS || starts.iter().any(|a| others.iter().any(|b| meets(a, b)))
    }

    /// How far `start` has to be moved along `normal` to be off `other`, in which it lies: by what rounding does along the normal to them, and any way to
    /// a ray from close by.
    fn lift(&self, start: &Patch, other: &Patch, normal: DVec3) -> f64 {
        let along = normal.abs().dot(self.extent(&start.bounds, &other.bounds));
        SLACK * (along + self.extent(&start.bounds, &start.bounds).max_element())
    }

    /// What takes `start` off all surfaces that it lies in, to the side that `axis` points to.
    fn shift(&self, start: &Patch, axis: DVec3) -> DVec3 {
        let mut shift = DVec3::ZERO;
        for shape in self.near(&start.bounds, None) {
            for other in self.pieces(shape, &start.bounds) {
                if start.lies_in(&other, self.slack(&start.bounds, &other.bounds)) {
                    let n = other.off(0.5 * (start.bounds.min + start.bounds.max)).1;
                    // Concentric spheres have no normal there, and any will do.
                    let n = if n == DVec3::ZERO {
                        DVec3::Y
                    } else if axis.dot(n) < 0.0 {
                        -n
                    } else {
                        n
                    };
                    shift += n * (self.lift(start, &other, n) - shift.dot(n)).max(0.0);
                }
            }
        }
        shift
    }

    fn bounds_volume(&self, shape: &Shape) -> bool {
        self.scene.volume_of(shape).is_some()
    }

    /// Whether `starts`, which lie in the box `around`, meet the boundary of a volume. A point does not: it is off all surfaces.
    fn meets_volume(&self, starts: &[Patch], around: &Bounds, own: Option<usize>) -> bool {
        let is_point = matches!(starts, [Patch { form: Form::Point(_), .. }]);
        let mut near = self.near(around, own).filter(|shape| self.bounds_volume(shape));
        !is_point && near.any(|shape| self.meet(starts, &self.pieces(shape, around)))
    }

    /// How far off each primitive of lamp `index` light starts.
    fn lifts(&self, index: usize, lamp: &[Patch]) -> Vec<f64> {
        let mut lifts = vec![0.0f64; lamp.len()];
        for shape in self.near(&self.bounds[index], Some(index)) {
            let others = self.pieces(shape, &self.bounds[index]);
            let are_many = lamp.len().saturating_mul(others.len()) > MOST_PAIRS;
            for (lift, a) in lifts.iter_mut().zip(lamp) {
                if are_many {
                    *lift = lift.max(self.slack(&a.bounds, &bounds(&shape.geometry)));
                    continue;
                }
                for b in others.iter().filter(|b| a.lies_in(b, self.slack(&a.bounds, &b.bounds))) {
                    let n = if let Form::Flat { normal, .. } = a.form { normal } else { DVec3::ONE };
                    *lift = lift.max(self.lift(a, b, n));
                }
            }
        }
        lifts
    }
}

impl Starts {
    pub fn of(scene: &Scene) -> Self {
        let all = bounds_of_all(&scene.shapes);
        let origin = if all.is_empty() { DVec3::ZERO } else { 0.5 * (all.min + all.max) };
        let around = Surroundings { scene, origin, bounds: scene.shapes.iter().map(|s| bounds(&s.geometry)).collect() };
        let mut starts = Starts {
            sensor: scene.sensor.clone(),
            sensor_touches: false,
            sensor_meets_volume: false,
            lifts: Vec::new(),
            shifts: Vec::new(),
            lamps_touch: false,
            lamp_meets_volume: false,
        };
        let (patch, axis) = of_sensor(&scene.sensor, &scene.film);
        let shift = around.shift(&patch, axis);
        starts.sensor_touches = shift != DVec3::ZERO;
        match &mut starts.sensor {
            Sensor::Perspective { eye, .. } | Sensor::Orthographic { eye, .. } => *eye += shift,
            Sensor::IrradiancePlane { origin, .. } => *origin += shift,
            Sensor::IrradianceSphere { radius, .. } => *radius += shift.length(),
        }
        starts.sensor_meets_volume = around.meets_volume(std::slice::from_ref(&patch), &patch.bounds, None);
        for (index, shape) in scene.shapes.iter().enumerate() {
            let Some(emission) = shape.emission.as_ref().filter(|e| !e.radiance.is_zero()) else { continue };
            // Light that shines into the lamp's own volume, too.
            let is_within = emission.two_sided && around.bounds_volume(shape);
            if !is_within && around.near(&around.bounds[index], Some(index)).next().is_none() {
                starts.lifts.push(Vec::new());
                continue;
            }
            let lamp = patches(&shape.geometry, &around.bounds[index]);
            let mut lifts = around.lifts(index, &lamp);
            starts.lamps_touch |= lifts.iter().any(|&l| l > 0.0);
            if is_within {
                lifts.iter_mut().zip(&lamp).for_each(|(l, p)| *l = l.max(around.slack(&p.bounds, &p.bounds)));
            }
            starts.lamp_meets_volume |= is_within || around.meets_volume(&lamp, &around.bounds[index], Some(index));
            starts.lifts.push(lifts);
        }
        for light in &scene.lights {
            let Some((patch, axis)) = of_light(light) else {
                starts.shifts.push(DVec3::ZERO);
                continue;
            };
            starts.shifts.push(around.shift(&patch, axis));
            starts.lamp_meets_volume |= around.meets_volume(std::slice::from_ref(&patch), &patch.bounds, None);
        }
        starts
    }
}

fn widened(b: &Bounds, slack: f64) -> Bounds {
    Bounds { min: b.min - slack, max: b.max + slack }
}

fn box_corners(b: &Bounds) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, lo: f64, hi: f64| if i & bit == 0 { lo } else { hi };
        dvec3(pick(1, b.min.x, b.max.x), pick(2, b.min.y, b.max.y), pick(4, b.min.z, b.max.z))
    })
}
