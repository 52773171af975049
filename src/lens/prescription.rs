//! The prescription of a lens: surfaces of revolution on one axis, in the order in which light meets them.
//!
//! Light goes along +z. The vertex of the first surface is at z = 0, radii are positive where the centre of curvature lies at greater z.

use crate::geometry::profile;
use crate::spectrum::{Ior, Spectrum};

/// Surfaces of a lens at most.
pub const MOST_SURFACES: usize = 64;
/// Aspheric coefficients of a surface at most: up to r^16.
pub const MOST_COEFFICIENTS: usize = 8;

/// What fills the space between two surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Glass {
    /// Its name, as the prescription gives it.
    pub name: String,
    /// Index of refraction relative to air.
    pub ior: Ior,
    /// Absorption coefficient, m^-1, where it is known.
    pub absorption: Option<Spectrum>,
}

/// A surface of revolution: `z(r) = c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) + a_0 r^2 + a_1 r^4 + a_2 r^6 + ...`, c = 1 / `radius` (ISO 10110-12).
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Radius of curvature at the vertex, m; infinite for a plane.
    pub radius: f64,
    /// Conic constant k: 0 a sphere, -1 a paraboloid.
    pub conic: f64,
    /// Coefficients of r^2, r^4, r^6, ..., in m^-1, m^-3, m^-5, ..., as Zemax orders them; empty for a conic.
    pub aspheric: Vec<f64>,
    /// Distance to the next vertex, m; behind the last surface, that to the film for which the lens was designed, or 0.
    pub thickness: f64,
    /// What is behind the surface; `None` is air. A plane between air and air, as most stops are, does nothing.
    pub glass: Option<Glass>,
    /// Half the diameter of what lets light through, m.
    pub semi_diameter: f64,
    /// The aperture stop.
    pub stop: bool,
}

/// A lens in air.
#[derive(Debug, Clone, PartialEq)]
pub struct Prescription {
    /// What the lens calls itself; may be empty.
    pub name: String,
    /// Its surfaces, at least one that refracts.
    pub surfaces: Vec<Surface>,
}

/// What is wrong with a prescription.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The surface, counted from 0; `None` where it is the whole.
    pub surface: Option<usize>,
    /// What is wrong.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

impl Surface {
    /// Curvature at the vertex without the aspheric terms, m^-1.
    pub fn curvature(&self) -> f64 {
        1.0 / self.radius
    }

    /// Curvature at the vertex, m^-1.
    pub fn vertex_curvature(&self) -> f64 {
        self.curvature() + 2.0 * self.aspheric.first().copied().unwrap_or(0.0)
    }

    /// Height z above the plane through the vertex at distance `r` from the axis, m. NaN where the conic does not reach so far.
    pub fn sag(&self, r: f64) -> f64 {
        profile::sag(self.curvature(), self.root(r * r), &self.aspheric, r * r)
    }

    /// dz / dr at distance `r` from the axis. NaN where the conic does not reach so far.
    pub fn slope(&self, r: f64) -> f64 {
        r * self.slope_over_r(r * r)
    }

    /// (dz / dr) / r at the square of the distance from the axis.
    pub(super) fn slope_over_r(&self, r2: f64) -> f64 {
        profile::slope_over_r(self.curvature(), self.root(r2), &self.aspheric, r2)
    }

    fn root(&self, r2: f64) -> f64 {
        (1.0 - (1.0 + self.conic) * self.curvature().powi(2) * r2).sqrt()
    }

    /// Whether the surface is a plane.
    pub fn is_plane(&self) -> bool {
        self.curvature() == 0.0 && self.aspheric.iter().all(|a| *a == 0.0)
    }
}

impl Prescription {
    /// Warnings of neighbouring surfaces that cross within what both let through, one line each.
    pub fn crossings(&self) -> Vec<String> {
        let crossing = |(i, pair): (usize, &[Surface])| {
            let (a, b) = (&pair[0], &pair[1]);
            let edge = a.semi_diameter.min(b.semi_diameter);
            // Along the whole of it: aspheres may cross half way.
            let gap = |j: u32| a.thickness + b.sag(edge * f64::from(j) / 16.0) - a.sag(edge * f64::from(j) / 16.0);
            let least = (1..=16).map(gap).fold(f64::INFINITY, f64::min);
            (least < -1e-9 * edge).then(|| {
                format!(
                    "surfaces {i} and {} of the lens cross within its diameter; use a greater thickness or a smaller one",
                    i + 1
                )
            })
        };
        self.surfaces.windows(2).enumerate().filter_map(crossing).collect()
    }

    /// Checks that light can be traced through the lens: numbers that are numbers, surfaces that reach their edge, one stop at most, glass somewhere, air
    /// at the end.
    pub fn check(&self) -> Result<(), Fault> {
        let whole = |problem: String, remedy: &str| Err(Fault { surface: None, problem, remedy: remedy.into() });
        if self.surfaces.is_empty() {
            return whole("the lens has no surfaces".into(), "give at least two, in the order in which light meets them");
        }
        if self.surfaces.len() > MOST_SURFACES {
            let problem = format!("the lens has {} surfaces", self.surfaces.len());
            return whole(problem, &format!("use at most {MOST_SURFACES}"));
        }
        for (i, surface) in self.surfaces.iter().enumerate() {
            let fault = surface.fault().map(|(problem, remedy)| Fault { surface: Some(i), problem, remedy: remedy.into() });
            fault.map_or(Ok(()), Err)?;
        }
        let at = |surface: usize, problem: &str, remedy: &str| {
            Err(Fault { surface: Some(surface), problem: problem.into(), remedy: remedy.into() })
        };
        if let Some(second) = self.surfaces.iter().enumerate().filter(|(_, s)| s.stop).map(|(i, _)| i).nth(1) {
            return at(second, "there is a stop already", "mark one surface as the stop");
        }
        let last = self.surfaces.len() - 1;
        if self.surfaces[last].glass.is_some() {
            return at(last, "there is glass behind the last surface", "add the surface where the glass ends");
        }
        if self.surfaces.iter().all(|s| s.glass.is_none()) {
            return whole("the lens has no glass".into(), "name the glass behind a surface");
        }
        Ok(())
    }
}

impl Surface {
    /// What is wrong with this surface, and what to do about it.
    fn fault(&self) -> Option<(String, &'static str)> {
        let finite = |v: f64| v.is_finite();
        if self.radius.is_nan() || self.radius == 0.0 || !finite(self.curvature()) {
            return Some((format!("{} is no radius of curvature", self.radius), "leave it out for a plane"));
        }
        if !finite(self.conic) || !self.aspheric.iter().copied().all(finite) {
            return Some(("a conic constant or aspheric coefficient is no number".into(), "mend it"));
        }
        if self.aspheric.len() > MOST_COEFFICIENTS {
            return Some((format!("{} aspheric coefficients", self.aspheric.len()), "give those of r^2 to r^16 at most"));
        }
        if !finite(self.thickness) || self.thickness < 0.0 {
            return Some((format!("the thickness {} m is none", self.thickness), "use a number of 0 or more"));
        }
        if self.glass.is_some() && self.thickness == 0.0 {
            return Some(("glass of no thickness".into(), "give it a thickness, or leave the glass out"));
        }
        if !(finite(self.semi_diameter) && self.semi_diameter > 0.0) {
            return Some((format!("the semi-diameter {} m is none", self.semi_diameter), "use a number above 0"));
        }
        if !(self.sag(self.semi_diameter).is_finite() && self.slope(self.semi_diameter).is_finite()) {
            let problem = format!("a radius of {} m does not reach a semi-diameter of {} m", self.radius, self.semi_diameter);
            return Some((problem, "use a greater radius or a smaller diameter"));
        }
        None
    }
}
