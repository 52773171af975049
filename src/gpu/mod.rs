//! Everything that touches wgpu: adapters, shader assembly, the host/shader boundary, kernels and the scene's buffers.

mod adapter;
mod faults;
mod instances;
mod kernel;
pub mod layout;
mod light_grid;
mod lights;
mod placed_lights;
mod primitives;
mod profiles;
mod scene;
pub mod shader;
mod targets;
mod textures;
mod timer;

pub use adapter::{AdapterInfo, Gpu, Resource, list_adapters};
pub use faults::Faults;
pub use kernel::{Kernel, kernel_source};
pub use lights::ranks;
pub use placed_lights::light_grid_pays;
pub use scene::{GpuScene, SpectrumRow};
pub use targets::targets;
pub use timer::Timer;
