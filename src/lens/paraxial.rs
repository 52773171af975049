//! Gaussian optics of a prescription (Hecht, Optics, 6.1; Kingslake & Johnson, Lens Design Fundamentals, ch. 3).

use super::{Prescription, Surface};
use crate::spectrum::LINE_D_NM;

/// What a lens does near its axis, at one wavelength. Lengths are m; places are z, counted from the first vertex in the direction of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paraxial {
    /// Focal length on the image side; negative for a lens that diverges, infinite for one without power.
    pub focal_length: f64,
    /// Focal point of light that comes from the other side.
    pub front_focus: f64,
    /// Focal point of light from infinity.
    pub rear_focus: f64,
    /// Last vertex.
    pub last_vertex: f64,
    /// Index of the surface that is the aperture stop.
    pub stop: usize,
    /// Image of the stop as seen from the front: its place, and its radius.
    pub entrance_pupil: (f64, f64),
    /// Image of the stop as seen from behind: likewise.
    pub exit_pupil: (f64, f64),
}

impl Paraxial {
    /// Back focal distance: from the last vertex to the focal point.
    pub fn back_focus(&self) -> f64 {
        self.rear_focus - self.last_vertex
    }

    /// Places of the front and the rear principal plane.
    pub fn principal_planes(&self) -> (f64, f64) {
        (self.front_focus + self.focal_length, self.rear_focus - self.focal_length)
    }

    /// f-number for objects at infinity: focal length over diameter of the entrance pupil.
    pub fn f_number(&self) -> f64 {
        self.focal_length.abs() / (2.0 * self.entrance_pupil.1.abs())
    }

    /// Where what is imaged at `z` lies.
    pub fn object_of(&self, z: f64) -> f64 {
        // Newton: the product of the distances from the focal points is -f^2.
        self.front_focus - self.focal_length * self.focal_length / (z - self.rear_focus)
    }
}

/// A paraxial ray: height, and angle times index.
#[derive(Clone, Copy)]
struct Ray {
    y: f64,
    nu: f64,
}

impl Ray {
    fn refracted(self, surface: &Surface, before: f64, after: f64) -> Ray {
        Ray { nu: self.nu - (after - before) * surface.vertex_curvature() * self.y, ..self }
    }

    fn moved(self, distance: f64, n: f64) -> Ray {
        Ray { y: self.y + distance * self.nu / n, ..self }
    }

    /// Where it crosses the axis, from where it is, in air.
    fn crossing(self) -> f64 {
        -self.y / self.nu
    }
}

impl Prescription {
    /// Index behind each surface at `nm`.
    pub fn indices(&self, nm: f64) -> Vec<f64> {
        self.surfaces.iter().map(|s| s.glass.as_ref().map_or(1.0, |g| g.ior.eval(nm))).collect()
    }

    /// z of every vertex.
    pub fn vertices(&self) -> Vec<f64> {
        let ends = self.surfaces.iter().scan(0.0, |z, s| {
            *z += s.thickness;
            Some(*z)
        });
        std::iter::once(0.0).chain(ends).take(self.surfaces.len()).collect()
    }

    /// The surface that is the aperture stop: the one that says so, or the one that light from an axial point at infinity fills first.
    pub fn stop(&self, nm: f64) -> usize {
        if let Some(stop) = self.surfaces.iter().position(|s| s.stop) {
            return stop;
        }
        let heights = self.forward(Ray { y: 1.0, nu: 0.0 }, 0..self.surfaces.len(), nm).1;
        let room = |i: usize| self.surfaces[i].semi_diameter / heights[i].abs();
        (0..self.surfaces.len()).min_by(|&a, &b| room(a).total_cmp(&room(b))).unwrap_or(0)
    }

    /// Heights at every surface of the paraxial ray of this height at the first one and this angle before it.
    pub fn heights(&self, y: f64, angle: f64, nm: f64) -> Vec<f64> {
        self.forward(Ray { y, nu: angle }, 0..self.surfaces.len(), nm).1
    }

    /// A ray from before the first of `surfaces` to behind the last, and its height at each.
    fn forward(&self, mut ray: Ray, surfaces: std::ops::Range<usize>, nm: f64) -> (Ray, Vec<f64>) {
        let n = self.indices(nm);
        let mut heights = Vec::new();
        for i in surfaces.clone() {
            heights.push(ray.y);
            ray = ray.refracted(&self.surfaces[i], if i == 0 { 1.0 } else { n[i - 1] }, n[i]);
            if i + 1 < surfaces.end {
                ray = ray.moved(self.surfaces[i].thickness, n[i]);
            }
        }
        (ray, heights)
    }

    /// The lens as seen from the other side.
    pub fn reversed(&self) -> Prescription {
        let count = self.surfaces.len();
        let turned = |i: usize| {
            let (s, before) = (&self.surfaces[count - 1 - i], (count - 1 - i).checked_sub(1).map(|j| &self.surfaces[j]));
            Surface {
                radius: -s.radius,
                aspheric: s.aspheric.iter().map(|a| -a).collect(),
                thickness: before.map_or(0.0, |b| b.thickness),
                glass: before.and_then(|b| b.glass.clone()),
                ..s.clone()
            }
        };
        Prescription { name: self.name.clone(), surfaces: (0..count).map(turned).collect() }
    }

    /// The ray that goes through the middle of the stop at the angle of 1 over the index there, behind the last surface.
    fn chief(&self, stop: usize, nm: f64) -> Ray {
        let (count, start) = (self.surfaces.len(), Ray { y: 0.0, nu: 1.0 });
        if stop + 1 == count {
            return start;
        }
        self.forward(start.moved(self.surfaces[stop].thickness, self.indices(nm)[stop]), stop + 1..count, nm).0
    }

    /// Tangent of the angle at which one in the eye at `eye_z` sees the point of the plane `object_z` that the ray through the middle of the stop leads to from
    /// a place of the film in the plane `film_z`; over the distance of that place from the axis, m^-1. At the d line.
    pub fn chief_tangent(&self, paraxial: &Paraxial, film_z: f64, eye_z: f64, object_z: f64) -> f64 {
        let count = self.surfaces.len();
        let behind = self.chief(paraxial.stop, LINE_D_NM);
        let before = self.reversed().chief(count - 1 - paraxial.stop, LINE_D_NM);
        // Seen from the other side the same ray rises where it falls; so far away only its angle counts.
        let height = |z: f64| before.nu * z - before.y;
        let tangent = if object_z.is_finite() && object_z < eye_z { height(object_z) / (eye_z - object_z) } else { before.nu };
        tangent / (behind.y + (film_z - paraxial.last_vertex) * behind.nu)
    }

    /// Gaussian optics at `nm`.
    pub fn paraxial(&self, nm: f64) -> Paraxial {
        let (all, last_vertex) = (0..self.surfaces.len(), *self.vertices().last().unwrap_or(&0.0));
        let turned = self.reversed();
        let out = self.forward(Ray { y: 1.0, nu: 0.0 }, all.clone(), nm).0;
        let back = turned.forward(Ray { y: 1.0, nu: 0.0 }, all, nm).0;
        let stop = self.stop(nm);
        let radius = self.surfaces[stop].semi_diameter;
        // What the stop's own surface does belongs to the side on which its glass is: its rim is where it bends light.
        let behind = self.chief(stop, nm);
        let before = turned.chief(self.surfaces.len() - 1 - stop, nm);
        Paraxial {
            focal_length: -1.0 / out.nu,
            front_focus: -back.crossing(),
            rear_focus: last_vertex + out.crossing(),
            last_vertex,
            stop,
            // By Lagrange's invariant for the size.
            entrance_pupil: (-before.crossing(), radius / before.nu),
            exit_pupil: (last_vertex + behind.crossing(), radius / behind.nu),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::lens::{Glass, Prescription, Surface};
    use crate::spectrum::Ior;

    fn surface(radius: f64, thickness: f64, n: Option<f64>) -> Surface {
        let glass = n.map(|n| Glass { name: "glass".into(), ior: Ior::constant(n), absorption: None });
        Surface { radius, conic: 0.0, aspheric: vec![], thickness, glass, semi_diameter: 0.01, stop: false }
    }

    /// Lensmaker's equation with thickness (Hecht, equations 6.2 to 6.4, and back focal length).
    #[test]
    fn a_thick_lens_obeys_the_lensmaker() {
        let (r1, r2, d, n) = (0.05, -0.08, 0.012, 1.6);
        let lens = Prescription { name: String::new(), surfaces: vec![surface(r1, d, Some(n)), surface(r2, 0.0, None)] };
        let p = lens.paraxial(550.0);
        let f = 1.0 / ((n - 1.0) * (1.0 / r1 - 1.0 / r2 + (n - 1.0) * d / (n * r1 * r2)));
        let (h1, h2) = (-f * (n - 1.0) * d / (n * r2), -f * (n - 1.0) * d / (n * r1));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} is not {b}");
        close(p.focal_length, f);
        close(p.principal_planes().0, h1);
        close(p.principal_planes().1, d + h2);
        // The first surface is the stop: light converges behind it.
        assert_eq!(p.stop, 0);
        close(p.entrance_pupil.0, 0.0);
        close(p.f_number(), f / 0.02);
        // The thin lens equation between the principal planes.
        let (object, image) = (h1 - 0.3, d + h2 + 1.0 / (1.0 / f - 1.0 / 0.3));
        close(p.object_of(image), object);
    }

    /// A stop behind a thin lens, at half its focal length, is seen twice as large at a focal length behind the lens.
    #[test]
    fn a_stop_behind_a_lens_is_seen_through_it() {
        let mut surfaces = vec![surface(0.1, 1e-12, Some(1.5)), surface(-0.1, 0.05, None), surface(f64::INFINITY, 0.0, None)];
        surfaces[2].stop = true;
        let p = Prescription { name: String::new(), surfaces }.paraxial(550.0);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-10, "{a} is not {b}");
        close(p.focal_length, 0.1);
        close(p.entrance_pupil.0, 0.1);
        close(p.entrance_pupil.1, 0.02);
        close(p.exit_pupil.0, 0.05);
        close(p.exit_pupil.1, 0.01);
        close(p.f_number(), 2.5);
    }
}
