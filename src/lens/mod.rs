//! Lenses as opticians write them down: prescriptions of surfaces of revolution on one axis, and what follows from them.

pub mod faces;
pub mod prescription;

pub use prescription::{Fault, Glass, MOST_SURFACES, Prescription, Surface};
