//! From a scene to radiance on the film: the plan, the wavelengths of each pass, and the passes.

mod camera_pass;
mod plan;
mod wavelengths;

pub use camera_pass::GpuIntegrator;
pub use plan::Plan;
pub use wavelengths::{Stratum, Wavelengths};
