//! The way back to the host: copies that the host reads where they lie, while the adapter goes on with other work.

use super::{Faults, Gpu, Resource};
use crate::error::{Error, Result};
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// What the host and an adapter had to do with each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Times that the host waited for the adapter.
    pub waits: u64,
    /// How long, in all.
    pub waited: Duration,
    /// Bytes that came back.
    pub bytes_read: u64,
}

impl std::ops::Sub for Traffic {
    type Output = Traffic;

    fn sub(self, b: Self) -> Self {
        Traffic {
            waits: self.waits - b.waits,
            waited: self.waited.saturating_sub(b.waited),
            bytes_read: self.bytes_read - b.bytes_read,
        }
    }
}

/// [`Traffic`] of a device so far.
#[derive(Debug, Default)]
pub(super) struct Meter {
    waits: AtomicU64,
    nanoseconds: AtomicU64,
    bytes_read: AtomicU64,
}

impl Meter {
    pub(super) fn waited(&self, since: Instant) {
        self.waits.fetch_add(1, Relaxed);
        self.nanoseconds.fetch_add(since.elapsed().as_nanos() as u64, Relaxed);
    }

    pub(super) fn read(&self, bytes: u64) {
        self.bytes_read.fetch_add(bytes, Relaxed);
    }

    pub(super) fn traffic(&self) -> Traffic {
        Traffic {
            waits: self.waits.load(Relaxed),
            waited: Duration::from_nanos(self.nanoseconds.load(Relaxed)),
            bytes_read: self.bytes_read.load(Relaxed),
        }
    }
}

/// Memory that both reach, for one buffer: kept, since making it anew takes longer than the copy. What was read is dropped before the next copy.
#[derive(Debug)]
pub struct Staging(wgpu::Buffer);

impl Staging {
    /// For up to `size` bytes.
    pub fn new(gpu: &Gpu, size: u64) -> Self {
        Staging(gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: size.next_multiple_of(16),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// Has the first `size` bytes of `source` here after what `encoder` holds so far.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, source: &Resource, size: u64) {
        if let Resource::Buffer(source) = source {
            encoder.copy_buffer_to_buffer(source, 0, &self.0, 0, size);
        }
    }

    /// Asks for `size` bytes, once the copy is submitted; [`Staging::mapped`] has them after the next [`Gpu::wait`].
    pub fn map(&self, size: u64) {
        self.0.slice(..size).map_async(wgpu::MapMode::Read, |_| {});
    }

    /// The bytes that were asked for.
    ///
    /// # Errors
    /// [`Error::Fault`] if the device has failed.
    pub fn mapped(&self, gpu: &Gpu, size: u64) -> Result<Mapped> {
        let view = self.0.slice(..size).get_mapped_range().map_err(|e| gpu.faults.lost(&e))?;
        gpu.meter.read(size);
        Ok(Mapped { view: Some(view), buffer: self.0.clone(), faults: gpu.faults.clone() })
    }
}

/// Bytes that came back, on any thread.
#[derive(Debug)]
pub struct Mapped {
    view: Option<wgpu::BufferView>,
    buffer: wgpu::Buffer,
    faults: Faults,
}

impl Deref for Mapped {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.view.as_deref().unwrap_or_default()
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        self.view = None;
        // A device that has failed is left alone; whoever works with it next is told.
        let _ = self.faults.guard(|| {
            self.buffer.unmap();
            Ok::<(), Error>(())
        });
    }
}

impl Gpu {
    /// What host and adapter had to do with each other since it was opened.
    pub fn traffic(&self) -> Traffic {
        self.meter.traffic()
    }

    /// Brings the first bytes of some buffers back in one go, so many of each, and leaves zeros in all of these.
    ///
    /// # Errors
    /// [`Error::Fault`] if the device has failed.
    pub fn take(&self, parts: &[(&Resource, &Staging, u64)]) -> Result<Vec<Mapped>> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        for (source, staging, size) in parts {
            staging.copy(&mut encoder, source, *size);
            if let Resource::Buffer(source) = source {
                encoder.clear_buffer(source, 0, None);
            }
        }
        self.queue.submit([encoder.finish()]);
        parts.iter().for_each(|(_, staging, size)| staging.map(*size));
        self.wait()?;
        parts.iter().map(|(_, staging, size)| staging.mapped(self, *size)).collect()
    }
}
