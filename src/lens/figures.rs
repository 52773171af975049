//! What an optician asks of a lens: spots, colours and transmission over its field, by rays through it.

use super::{LensRay, Paraxial, Prescription, Tracer};
use crate::spectrum::{LINE_C_NM, LINE_D_NM, LINE_F_NM};
use glam::{DVec2, DVec3, dvec2, dvec3};

/// The lines that figures are of, nm: F, d and C.
pub const LINES_NM: [f64; 3] = [LINE_F_NM, LINE_D_NM, LINE_C_NM];
/// Rays across the entrance pupil.
const ACROSS: usize = 31;
/// Wavelengths of [`Figures::focus_shift`], nm.
const SHIFT_NM: (f64, f64, f64) = (400.0, 700.0, 10.0);
/// Fields beyond this are not looked for, rad.
const WIDEST: f64 = 0.35;

/// Light of one direction in the plane of the film.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Angle to the axis, rad.
    pub angle: f64,
    /// Where rays of each line of [`LINES_NM`] arrive, m, y from the axis up.
    pub spots: [Vec<DVec2>; 3],
    /// Root mean square distance of all of them from their centroid, m; NaN where none arrives.
    pub rms: f64,
    /// Height of the middle of the pencil at the d line, m: of the ray through the middle of the entrance pupil, or the centroid where that is stopped.
    pub height: f64,
    /// How much higher F arrives than C, by the rays through the middle of the entrance pupil, m.
    pub lateral_color: f64,
    /// Share of the rays of the entrance pupil that no rim stops, at d.
    pub unvignetted: f64,
    /// Of these, share of their light that is neither reflected nor absorbed.
    pub transmission: f64,
}

/// Figures of a lens for objects at infinity.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// Gaussian optics at each line of [`LINES_NM`].
    pub paraxial: [Paraxial; 3],
    /// The film: where light of the d line from infinity on the axis makes its smallest spot, z in m.
    pub film_z: f64,
    /// Fields at 0, 0.5, 0.7 and 1 of the greatest angle.
    pub fields: Vec<Field>,
    /// Paraxial focal point of each wavelength in nm, behind that of d, m.
    pub focus_shift: Vec<(f64, f64)>,
}

impl Prescription {
    /// Figures up to a field of `angle` in rad, or to where half of the pencil on the axis is stopped.
    pub fn figures(&self, angle: Option<f64>) -> Figures {
        let paraxial = LINES_NM.map(|nm| self.paraxial(nm));
        let film_z = self.best_focus(&paraxial[1], f64::NEG_INFINITY);
        let widest = angle.unwrap_or_else(|| {
            let full = self.field(0.0, film_z, &paraxial[1]).unvignetted;
            let steps = (0..=35).map(|i| WIDEST * f64::from(i) / 35.0);
            let clear = |a: &f64| self.field(*a, film_z, &paraxial[1]).unvignetted >= 0.5 * full;
            steps.take_while(clear).last().unwrap_or(0.0)
        });
        let fields = [0.0, 0.5, 0.7, 1.0].map(|share| self.field(share * widest, film_z, &paraxial[1])).to_vec();
        let (lo, hi, step) = SHIFT_NM;
        let shift = |i: usize| {
            let nm = lo + step * i as f64;
            (nm, self.paraxial(nm).rear_focus - paraxial[1].rear_focus)
        };
        let focus_shift = (0..=((hi - lo) / step) as usize).map(shift).collect();
        Figures { paraxial, film_z, fields, focus_shift }
    }

    fn field(&self, angle: f64, film_z: f64, paraxial: &Paraxial) -> Field {
        let d = dvec3(0.0, angle.sin(), angle.cos());
        let (pupil_z, radius) = (paraxial.entrance_pupil.0, paraxial.entrance_pupil.1.abs());
        // Well before whatever is first.
        let start = |p: DVec2| LensRay { o: p.extend(pupil_z) - d * (pupil_z.abs() + 4.0 * radius), d };
        let grid = (0..ACROSS * ACROSS).map(|i| {
            let at = |n: usize| (2 * n + 1) as f64 / ACROSS as f64 - 1.0;
            dvec2(at(i % ACROSS), at(i / ACROSS))
        });
        let pupil: Vec<DVec2> = grid.filter(|p| p.length() <= 1.0).map(|p| radius * p).collect();
        let tracers = LINES_NM.map(|nm| Tracer::new(self, nm));
        let arrive = |tracer: &Tracer, p: DVec2| tracer.trace(start(p)).filter(|out| out.is_clear());
        let landed = |tracer: &Tracer, p: DVec2| arrive(tracer, p).map(|out| out.ray.at(film_z).truncate());
        let spots = [0, 1, 2].map(|line| pupil.iter().filter_map(|&p| landed(&tracers[line], p)).collect::<Vec<_>>());
        let all: Vec<DVec2> = spots.iter().flatten().copied().collect();
        let middle = all.iter().sum::<DVec2>() / all.len() as f64;
        let rms = (all.iter().map(|p| p.distance_squared(middle)).sum::<f64>() / all.len() as f64).sqrt();
        let centroid = |of: &[DVec2]| of.iter().map(|p| p.y).sum::<f64>() / of.len() as f64;
        let heights = [0, 1, 2].map(|i| landed(&tracers[i], DVec2::ZERO).map_or_else(|| centroid(&spots[i]), |p| p.y));
        let through: Vec<f64> = pupil.iter().filter_map(|&p| arrive(&tracers[1], p)).map(|out| out.transmission).collect();
        Field {
            angle,
            rms,
            height: heights[1],
            lateral_color: heights[0] - heights[2],
            unvignetted: through.len() as f64 / pupil.len() as f64,
            transmission: through.iter().sum::<f64>() / through.len() as f64,
            spots,
        }
    }

    /// z of the smallest spot that light of the d line from the axial point at `object_z` (which may be infinite) makes, root mean square over the entrance
    /// pupil. Not finite where no light gets through.
    pub fn best_focus(&self, paraxial: &Paraxial, object_z: f64) -> f64 {
        const RAYS: usize = 64;
        let tracer = Tracer::new(self, LINE_D_NM);
        // The ray that fills the stop, at the first vertex; where light of that place misses the stop's rim, others end it.
        let (y, angle) = if object_z.is_finite() { (-object_z, 1.0) } else { (1.0, 0.0) };
        let first = &self.surfaces[0];
        let at_stop = self.heights(y, angle, LINE_D_NM)[paraxial.stop];
        let radius = (y * self.surfaces[paraxial.stop].semi_diameter / at_stop).abs().min(first.semi_diameter);
        let before = first.sag(first.semi_diameter).min(0.0) - radius;
        let (mut yt, mut tt) = (0.0, 0.0);
        for i in 0..RAYS {
            let target = dvec3(0.0, radius * ((i as f64 + 0.5) / RAYS as f64).sqrt(), 0.0);
            let d = if object_z.is_finite() { (target - dvec3(0.0, 0.0, object_z)).normalize() } else { DVec3::Z };
            let o = target + before / d.z * d;
            let Some(out) = tracer.trace(LensRay { o, d }).filter(|out| out.is_clear()) else { continue };
            let (y, t) = (out.ray.at(paraxial.last_vertex).y, out.ray.d.y / out.ray.d.z);
            (yt, tt) = (yt + y * t, tt + t * t);
        }
        paraxial.last_vertex - yt / tt
    }
}
