//! Lenses as opticians write them down: prescriptions of surfaces of revolution on one axis, and what follows from them.

pub mod camera;
pub mod faces;
pub mod figures;
pub mod library;
pub mod paraxial;
pub mod prescription;
pub mod pupil;
pub mod trace;
pub mod zmx;

pub use camera::LensCamera;
pub use paraxial::Paraxial;
pub use prescription::{Fault, Glass, MOST_COEFFICIENTS, MOST_SURFACES, Prescription, Surface};
pub use pupil::PupilBound;
pub use trace::{LensRay, Tracer};
