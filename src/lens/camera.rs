//! A lens as a camera: where its film is, what its aperture is, and bounds of what gets through, for both directions.
//!
//! The lens's coordinates: z along the axis from the scene to the film, 0 at the first vertex. The film lies in the plane `film_z`.

use super::{Fault, LensRay, Paraxial, Prescription, Tracer};
use crate::spectrum::LINE_D_NM;
use glam::{DVec2, dvec2};
use std::f64::consts::PI;

/// Places on the film, from its middle to its corner, at which the exit pupil is bounded.
pub const PUPIL_BOUNDS: usize = 33;
/// Rays across the pupil that find its bounds.
const ACROSS: usize = 48;
/// Wavelengths over the film's range at which they do.
const WAVELENGTHS: usize = 3;
/// By how much bounds are wider than what these rays need, over the spacing of the rays.
const MARGIN: f64 = 1.5;

/// Where light that reaches a place of the film, on the axis of x at some radius, comes through the plane `pupil_z`: an ellipse.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PupilBound {
    /// x of its centre, m.
    pub center: f64,
    /// Half its extent along x and across, m; 0 where no light comes through.
    pub half: DVec2,
}

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
    /// Where what lies this far before the entrance pupil, m, makes the smallest spot.
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
    /// Tangent of half the vertical field of view of a pinhole in the entrance pupil that sees as much of the plane in focus.
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
            if wanted.is_nan() || wanted < 0.999 * widest {
                return fail(format!("f/{wanted} is wider than the lens, which has f/{widest:.2}"), "use a greater f_number");
            }
            lens.surfaces[open.stop].semi_diameter *= widest / wanted;
            // Of a lens that names none, the stop is where it was before.
            lens.surfaces[open.stop].stop = true;
        }
        let paraxial = lens.paraxial(LINE_D_NM);
        let film_z = match setting.focus {
            Focus::At(distance) => lens.best_focus(&paraxial, paraxial.entrance_pupil.0 - distance),
            Focus::Film(distance) => paraxial.last_vertex + distance,
        };
        if let (Focus::At(distance), false) = (setting.focus, film_z.is_finite() && film_z > paraxial.last_vertex) {
            let problem = format!("the lens makes no image of what is {distance} m away behind itself");
            return fail(problem, "use a lens that converges, and a focus_distance beyond its focal length");
        }
        let front_rim = lens.surfaces[0].sag(lens.surfaces[0].semi_diameter);
        // By the ray through the middle of the stop, which leaves the exit pupil at another angle than it enters by: both pupils are images of the stop.
        let pupil_magnification = paraxial.exit_pupil.1 / paraxial.entrance_pupil.1;
        let tan_half_vfov = (0.5 * setting.film.y / (film_z - paraxial.exit_pupil.0) * pupil_magnification).abs();
        let mut camera = LensCamera {
            pupil_z: paraxial.last_vertex,
            film: setting.film,
            film_z,
            pupil: Vec::new(),
            front: AxialDisc { z: 0.0, radius: 0.0 },
            least_cos: 1.0,
            start_z: front_rim.min(0.0),
            axial: 0.0,
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

    /// Bounds of the exit pupil from grids of rays, first over the last surface, then over what of it lets light through.
    fn bound_pupils(&mut self, (lo, hi): (f64, f64)) {
        let tracers: Vec<Tracer> =
            (0..WAVELENGTHS).map(|i| Tracer::new(&self.lens, lo + (hi - lo) * i as f64 / (WAVELENGTHS - 1) as f64)).collect();
        let last = &self.lens.surfaces[self.lens.surfaces.len() - 1];
        // Light that grazes the rim of a surface that is hollow towards the film crosses the plane of its vertex further out.
        let widest = last.semi_diameter * (1.0 + last.sag(last.semi_diameter).abs() / (self.film_z - self.pupil_z)) * 1.5;
        let planes = [self.start_z, self.paraxial.entrance_pupil.0];
        let (mut reach, mut least_cos) = ([0.0f64; 2], 1.0f64);
        let radius_of = |i: usize| self.film_radius() * i as f64 / (PUPIL_BOUNDS - 1) as f64;
        let mut pupil = Vec::new();
        for i in 0..PUPIL_BOUNDS {
            let film = dvec2(radius_of(i), 0.0);
            let (mut center, mut half) = (DVec2::ZERO, DVec2::splat(widest));
            let mut clear: Vec<DVec2> = Vec::new();
            for _ in 0..2 {
                clear.clear();
                // The pupil is its own mirror image: one half of the rays is enough.
                for (a, b) in (0..ACROSS * ACROSS / 2).map(|n| (n % ACROSS, n / ACROSS)) {
                    let at = |n: usize| (n as f64 + 0.5) * 2.0 / ACROSS as f64 - 1.0;
                    let p = center + half * dvec2(at(a), at(b));
                    for out in tracers.iter().filter_map(|t| t.trace(self.ray_from_film(film, p))).filter(|out| out.is_clear) {
                        clear.push(p);
                        let far = planes.map(|z| out.ray.at(z).truncate().length());
                        least_cos = least_cos.min(out.ray.d.z.abs());
                        reach = [reach[0].max(far[0]), reach[1].max(far[1])];
                    }
                }
                if clear.is_empty() {
                    break;
                }
                let step = half * (2.0 * MARGIN / ACROSS as f64);
                let min_x = clear.iter().map(|p| p.x).fold(f64::INFINITY, f64::min) - step.x;
                let max_x = clear.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max) + step.x;
                let max_y = clear.iter().map(|p| p.y.abs()).fold(0.0, f64::max) + step.y;
                (center, half) = (dvec2(0.5 * (min_x + max_x), 0.0), dvec2(0.5 * (max_x - min_x), max_y));
            }
            // Of the box the ellipse that has all rays, and the spacing around them.
            let step = half * (2.0 * MARGIN / ACROSS as f64);
            let need = |p: &DVec2| (((*p - center).abs() + step) / half).length();
            let scale = clear.iter().map(need).fold(0.0, f64::max);
            pupil.push(if clear.is_empty() {
                PupilBound::default()
            } else {
                PupilBound { center: center.x, half: half * scale }
            });
        }
        self.pupil = pupil;
        // Rays between those of the grid may be a little further out.
        self.least_cos = 1.0 - 1.1 * (1.0 - least_cos);
        let plane = if reach[1] < reach[0] && planes[1].is_finite() && planes[1] >= self.start_z { 1 } else { 0 };
        self.front = AxialDisc { z: planes[plane], radius: 1.02 * reach[plane] };
    }

    /// See [`LensCamera::axial`].
    fn axial_irradiance(&self) -> f64 {
        let tracer = Tracer::new(&self.lens, LINE_D_NM);
        let passes = |h: f64| {
            let out = tracer.trace(self.ray_from_film(DVec2::ZERO, dvec2(h, 0.0)));
            out.is_some_and(|out| out.is_clear)
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
        let last = PUPIL_BOUNDS - 1;
        let x = (radius / self.film_radius() * last as f64).min(last as f64);
        let i = (x as usize).min(last - 1);
        let (a, b, t) = (self.pupil[i], self.pupil[i + 1], x - i as f64);
        PupilBound { center: a.center + t * (b.center - a.center), half: a.half + t * (b.half - a.half) }
    }

    /// Where a ray that comes out of the lens towards the film arrives, and the measure that turns radiance into irradiance there for an area of the plane
    /// of the exit pupil: cos^4 over the squared distance of the planes, m^-2.
    pub fn land(&self, ray: &LensRay) -> (DVec2, f64) {
        let gap = self.film_z - self.pupil_z;
        (ray.at(self.film_z).truncate(), ray.d.z.powi(4) / (gap * gap))
    }
}
