//! Everything that touches wgpu: adapters, shader assembly, the host/shader boundary and kernels; and the buffers of a [`scene`], which the rest
//! knows nothing of.

mod adapter;
mod faults;
mod kernel;
pub mod layout;
mod read_back;
pub mod scene;
pub mod shader;
mod shared;
mod tables;
mod timer;

pub use adapter::{AdapterInfo, Gpu, Resource, STORAGE_TEXTURES, list_adapters};
pub use faults::Faults;
pub use kernel::{Kernel, kernel_source};
pub use read_back::{Mapped, Staging, Traffic};
pub use timer::Timer;
