//! A lens as a camera: where its film is, what its aperture is, and bounds of what gets through, for both directions.
//!
//! The lens's coordinates: z along the axis from the scene to the film, 0 at the first vertex. The film lies in the plane `film_z`.

use super::pupil::{PupilBound, Rim};
use super::{Fault, LensRay, Paraxial, Prescription, Tracer};
use crate::spectrum::LINE_D_NM;
use glam::{DVec2, dvec2};
use std::f64::consts::PI;

/// Places on the film, from its middle to its corner, at which the exit pupil is bounded.
pub const PUPIL_BOUNDS: usize = 33;
/// Places in between that the bounds must hold at, with these.
const PLACES: usize = 2 * PUPIL_BOUNDS - 1;
/// Wavelengths over the film's range at which they do.
const WAVELENGTHS: usize = 3;
/// Halvings that find where the picture that the lens makes ends.
const HALVINGS: usize = 16;
/// An entrance pupil further from the lens than so many focal lengths is not where a camera stands.
const FAR: f64 = 1e3;

/// A disc about the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxialDisc {
    /// Its plane.
    pub z: f64,
    /// Its radius, m.
    pub radius: f64,
}

/// Where the film of a camera is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Focus {
    /// Where what lies this far before the eye, m, makes the smallest spot.
    At(f64),
    /// So far behind the last vertex, m.
    Film(f64),
}

/// What the camera is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Size of the film, m.
    pub film: DVec2,
    /// Where the film is.
    pub focus: Focus,
    /// The aperture, for objects at infinity; that of the lens if none.
    pub f_number: Option<f64>,
    /// Wavelengths that the camera is for, nm.
    pub range_nm: (f64, f64),
}

/// A lens with a film behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct LensCamera {
    /// The lens, stopped down.
    pub lens: Prescription,
    /// Its Gaussian optics at the d line.
    pub paraxial: Paraxial,
    /// Size of the film, m.
    pub film: DVec2,
    /// Its plane.
    pub film_z: f64,
    /// Plane of the bounds of the exit pupil: the last vertex.
    pub pupil_z: f64,
    /// Bounds of the exit pupil at [`PUPIL_BOUNDS`] radii on the film, evenly from 0 to [`LensCamera::film_radius`].
    pub pupil: Vec<PupilBound>,
    /// All light that reaches the film comes, or would come without the lens, through this disc.
    pub front: AxialDisc,
    /// Cosine of the angle to the axis beyond which no light from the scene reaches the film.
    pub least_cos: f64,
    /// Rays into the scene start in this plane, before the first surface.
    pub start_z: f64,
    /// Irradiance in the middle of the film over the scene's radiance, at the d line, without losses: pi sin^2 of the marginal ray's angle, sr.
    pub axial: f64,
    /// The eye: the centre of the entrance pupil, or the first vertex where that is far away, as that of a lens that is telecentric towards the scene.
    pub eye_z: f64,
    /// Tangent of half the vertical field of view of a pinhole in the eye that sees as much of the plane in focus.
    pub tan_half_vfov: f64,
}

impl LensCamera {
    /// Focuses and stops down a lens: the film goes where light of the d line from the axial point in focus makes its smallest spot (root mean square).
    ///
    /// Errors if the lens makes no image behind itself, or lets nothing through, or has no such aperture.
    pub fn new(mut lens: Prescription, setting: &Setting) -> Result<Self, Fault> {
        let fail = |problem: String, remedy: &str| Err(Fault { surface: None, problem, remedy: remedy.into() });
        let open = lens.paraxial(LINE_D_NM);
        if let Some(wanted) = setting.f_number {
            let widest = open.f_number();
            if widest < 1.0 / FAR {
                let problem = "a lens that is telecentric towards the scene has no f-number".into();
                return fail(problem, "give its stop a diameter");
            }
            if wanted.is_nan() || wanted < 0.999 * widest {
                return fail(format!("f/{wanted} is wider than the lens, which has f/{widest:.2}"), "use a greater f_number");
            }
            lens.surfaces[open.stop].semi_diameter *= widest / wanted;
            // Of a lens that names none, the stop is where it was before.
            lens.surfaces[open.stop].stop = true;
        }
        let paraxial = lens.paraxial(LINE_D_NM);
        let eye_z =
            if paraxial.entrance_pupil.0.abs() < FAR * paraxial.focal_length.abs() { paraxial.entrance_pupil.0 } else { 0.0 };
        let film_z = match setting.focus {
            Focus::At(distance) => lens.best_focus(&paraxial, eye_z - distance),
            Focus::Film(distance) => paraxial.last_vertex + distance,
        };
        if let (Focus::At(distance), false) = (setting.focus, film_z.is_finite() && film_z > paraxial.last_vertex) {
            let problem = format!("the lens makes no image of what is {distance} m away behind itself");
            return fail(problem, "use a lens that converges, and a focus_distance beyond its focal length");
        }
        let front_rim = lens.surfaces[0].sag(lens.surfaces[0].semi_diameter);
        let in_focus = match setting.focus {
            Focus::At(distance) => eye_z - distance,
            Focus::Film(_) => paraxial.object_of(film_z),
        };
        let tan_half_vfov = (0.5 * setting.film.y * lens.chief_tangent(&paraxial, film_z, eye_z, in_focus)).abs();
        let mut camera = LensCamera {
            pupil_z: paraxial.last_vertex,
            film: setting.film,
            film_z,
            pupil: Vec::new(),
            front: AxialDisc { z: 0.0, radius: 0.0 },
            least_cos: 1.0,
            start_z: front_rim.min(0.0),
            axial: 0.0,
            eye_z,
            tan_half_vfov,
            paraxial,
            lens,
        };
        camera.bound_pupils(setting.range_nm);
        camera.axial = camera.axial_irradiance();
        if camera.pupil.iter().all(|b| b.half.x == 0.0) || camera.axial == 0.0 {
            return fail("no light gets through the lens".into(), "make its surfaces wider, or its aperture");
        }
        Ok(camera)
    }

    /// Distance from the film's middle to its corner, m.
    pub fn film_radius(&self) -> f64 {
        0.5 * self.film.length()
    }

    /// The ray from a place of the film through a place of the plane of the exit pupil.
    pub fn ray_from_film(&self, film: DVec2, pupil: DVec2) -> LensRay {
        let o = film.extend(self.film_z);
        LensRay { o, d: (pupil.extend(self.pupil_z) - o).normalize() }
    }

    /// Bounds of the exit pupil, and what follows from the rays through its rim.
    fn bound_pupils(&mut self, (lo, hi): (f64, f64)) {
        let tracers: Vec<Tracer> =
            (0..WAVELENGTHS).map(|i| Tracer::new(&self.lens, lo + (hi - lo) * i as f64 / (WAVELENGTHS - 1) as f64)).collect();
        let last = &self.lens.surfaces[self.lens.surfaces.len() - 1];
        // Light that grazes the rim of a surface that is hollow towards the film crosses the plane of its vertex further out.
        let widest = last.semi_diameter * (1.0 + last.sag(last.semi_diameter).abs() / (self.film_z - self.pupil_z)) * 1.5;
        let rim_at = |radius: f64| Rim::find(&tracers, |p| self.ray_from_film(dvec2(radius, 0.0), p), widest);
        let spacing = self.film_radius() / (PUPIL_BOUNDS - 1) as f64;
        let mut rims: Vec<(f64, Rim)> = Vec::new();
        for radius in (0..PLACES).map(|i| 0.5 * spacing * i as f64) {
            let found = rim_at(radius);
            let (mut lit, mut dark) = (radius - 0.5 * spacing, radius);
            if found.is_none() && rims.last().is_some_and(|(last, _)| *last == lit) {
                // Here the picture ends: up to the last place that light reaches.
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (lit + dark);
                    match rim_at(middle) {
                        Some(rim) => {
                            lit = middle;
                            rims.push((middle, rim));
                        }
                        None => dark = middle,
                    }
                }
            }
            rims.extend(found.map(|rim| (radius, rim)));
        }
        let planes = [self.start_z, self.paraxial.entrance_pupil.0];
        let (mut reach, mut least_cos) = ([0.0f64; 2], 1.0f64);
        for ray in rims.iter().flat_map(|(_, rim)| &rim.rays) {
            let far = planes.map(|z| ray.at(z).truncate().length());
            least_cos = least_cos.min(ray.d.z.abs());
            reach = [reach[0].max(far[0]), reach[1].max(far[1])];
        }
        let radius_of = |i: usize| spacing * i as f64;
        let nearest = |at: f64| rims.iter().min_by(|a, b| (a.0 - at).abs().total_cmp(&(b.0 - at).abs()));
        let centers: Vec<f64> = (0..PUPIL_BOUNDS).map(|i| nearest(radius_of(i)).map_or(0.0, |(_, rim)| rim.center())).collect();
        // Each bound serves all radii to its neighbours: between two, where the centre moves evenly, it then holds what both do.
        let half = |i: usize| {
            let served = rims.iter().filter(|(radius, _)| (radius - radius_of(i)).abs() < 0.99 * spacing);
            served
                .map(|(radius, rim)| rim.half(between(&centers, radius / spacing, |a, b, t| a + t * (b - a))))
                .fold(DVec2::ZERO, DVec2::max)
        };
        self.pupil = (0..PUPIL_BOUNDS).map(|i| PupilBound { center: centers[i], half: half(i) }).collect();
        // Rays between those may be a little further out.
        self.least_cos = 1.0 - 1.1 * (1.0 - least_cos);
        let plane = if reach[1] < reach[0] && planes[1].is_finite() && planes[1] >= self.start_z { 1 } else { 0 };
        self.front = AxialDisc { z: planes[plane], radius: 1.02 * reach[plane] };
    }

    /// See [`LensCamera::axial`].
    fn axial_irradiance(&self) -> f64 {
        let tracer = Tracer::new(&self.lens, LINE_D_NM);
        let passes = |h: f64| {
            let out = tracer.trace(self.ray_from_film(DVec2::ZERO, dvec2(h, 0.0)));
            out.is_some_and(|out| out.is_clear())
        };
        let (mut lo, mut hi) = (0.0, self.pupil[0].half.x + self.pupil[0].center.abs());
        if !passes(1e-6 * hi) {
            return 0.0;
        }
        for _ in 0..60 {
            let middle = 0.5 * (lo + hi);
            if passes(middle) { lo = middle } else { hi = middle }
        }
        let tan = lo / (self.film_z - self.pupil_z);
        PI * tan * tan / (1.0 + tan * tan)
    }

    /// The bound of the exit pupil at `radius` on the film: linear between those of [`LensCamera::pupil`].
    pub fn pupil_at(&self, radius: f64) -> PupilBound {
        let mix = |a: PupilBound, b: PupilBound, t: f64| PupilBound {
            center: a.center + t * (b.center - a.center),
            half: a.half + t * (b.half - a.half),
        };
        between(&self.pupil, radius / self.film_radius() * (PUPIL_BOUNDS - 1) as f64, mix)
    }

    /// Where a ray that comes out of the lens towards the film arrives, and the measure that turns radiance into irradiance there for an area of the plane
    /// of the exit pupil: cos^4 over the squared distance of the planes, m^-2.
    pub fn land(&self, ray: &LensRay) -> (DVec2, f64) {
        let gap = self.film_z - self.pupil_z;
        (ray.at(self.film_z).truncate(), ray.d.z.powi(4) / (gap * gap))
    }
}

/// What lies at `x`, in steps, between the values of two neighbours.
fn between<T: Copy>(values: &[T], x: f64, mix: impl Fn(T, T, f64) -> T) -> T {
    let i = (x as usize).min(values.len() - 2);
    mix(values[i], values[i + 1], (x - i as f64).min(1.0))
}
