//! Open devices that all tests of a binary share, so that each kernel is compiled once for them all.

use abbe::Result;
use abbe::gpu::Gpu;
use abbe::integrator::{GpuIntegrator, Plan, Techniques};
use abbe::scene::Scene;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, OnceLock};

/// Several, since a software driver compiles the kernels of a device one after the other.
const DEVICES: usize = 4;

fn device(number: usize) -> Arc<Gpu> {
    static OPEN: [OnceLock<Arc<Gpu>>; DEVICES] = [const { OnceLock::new() }; DEVICES];
    OPEN[number].get_or_init(|| Arc::new(Gpu::open(None).expect("an adapter"))).clone()
}

/// A device for small kernels.
pub fn gpu() -> Arc<Gpu> {
    device(0)
}

/// As [`GpuIntegrator::new`].
pub fn integrator(scene: &Scene, seed: u64) -> Result<GpuIntegrator> {
    with(scene, seed, Techniques::default())
}

/// As [`GpuIntegrator::with`].
pub fn with(scene: &Scene, seed: u64, techniques: Techniques) -> Result<GpuIntegrator> {
    with_plan(scene, seed, Plan::new(scene, techniques))
}

/// As [`GpuIntegrator::with_plan`]. Equal plans, whose kernels may be the same, share a device.
pub fn with_plan(scene: &Scene, seed: u64, plan: Plan) -> Result<GpuIntegrator> {
    let mut hasher = DefaultHasher::new();
    format!("{:?} {:?} {}", plan.camera, plan.light, plan.constants()).hash(&mut hasher);
    GpuIntegrator::on(device(hasher.finish() as usize % DEVICES), scene, seed, plan)
}
