//! The adapter's own clock, before and after each kernel of a dispatch.

use super::Gpu;
use crate::error::Result;
use std::time::Duration;

/// Most kernels of a dispatch.
const KERNELS: u32 = 4;

/// Reads the clock.
#[derive(Debug)]
pub struct Timer {
    queries: wgpu::QuerySet,
    ticks: wgpu::Buffer,
    /// Of a tick.
    nanoseconds: f64,
}

impl Timer {
    /// One for `gpu`; `None` if its clock cannot be read.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Timer {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("clock"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * KERNELS,
            }),
            ticks: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("ticks"),
                size: 16 * u64::from(KERNELS),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            nanoseconds: gpu.queue.get_timestamp_period().into(),
        })
    }

    /// For the pass of the dispatch's kernel `kernel`.
    pub(super) fn writes(&self, kernel: u32) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * kernel),
            end_of_pass_write_index: Some(2 * kernel + 1),
        }
    }

    /// Appends what makes the times of the first `kernels` kernels readable.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder, kernels: u32) {
        encoder.resolve_query_set(&self.queries, 0..2 * kernels, &self.ticks, 0);
    }

    /// Times of the first `kernels` kernels of the last dispatch.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device was lost.
    pub fn times(&self, gpu: &Gpu, kernels: u32) -> Result<Vec<Duration>> {
        let mut ticks: Vec<u64> = Vec::new();
        gpu.read_buffer(&self.ticks, 16 * u64::from(kernels), &mut |part| ticks.extend_from_slice(part))?;
        let time = |t: &[u64]| Duration::from_nanos((t[1].saturating_sub(t[0]) as f64 * self.nanoseconds) as u64);
        Ok(ticks.chunks_exact(2).map(time).collect())
    }
}
