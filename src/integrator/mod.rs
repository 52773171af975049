//! From a scene to radiance on the film: the plan, the wavelengths of each pass, and the passes.

mod adaptive;
mod aov;
mod brightness;
mod budget;
mod dispatch;
mod features;
mod gpu_integrator;
mod guide;
mod landing;
mod learned;
mod merge;
mod params;
mod plan;
mod preview;
mod probe;
mod sample_counts;
mod tile_sums;
mod tiles;
mod wavelengths;

pub use budget::{Budget, Probe};
pub use features::{Feature, Features};
pub use gpu_integrator::{GpuIntegrator, fold_seed};
pub use learned::MOST_HALVINGS;
pub use merge::mean_squared_radius;
pub use plan::{Plan, Techniques};
pub use preview::Preview;
pub use wavelengths::{Stratum, Wavelengths};
