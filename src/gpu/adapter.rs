//! Finding and opening an adapter.

use super::Faults;
use super::kernel::Kernels;
use super::layout::TABLE_WIDTH;
use super::read_back::Meter;
use crate::error::{Error, Result};
use crate::memory;
use std::fmt;
use std::time::Instant;

/// What the user is told about an adapter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterInfo {
    /// Device name.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan, Metal, Dx12.
    pub backend: String,
    /// Discrete GPU, CPU, ...
    pub kind: String,
}

impl AdapterInfo {
    fn of(info: &wgpu::AdapterInfo) -> Self {
        Self {
            name: info.name.clone(),
            driver: format!("{} {}", info.driver, info.driver_info),
            backend: format!("{:?}", info.backend),
            kind: format!("{:?}", info.device_type),
        }
    }

    /// It computes on the processors that run this program.
    pub fn is_cpu(&self) -> bool {
        self.kind == format!("{:?}", wgpu::DeviceType::Cpu)
    }
}

impl fmt::Display for AdapterInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {}, {})", self.name, self.kind, self.backend, self.driver)
    }
}

/// Something that a kernel can be given by name.
#[derive(Debug)]
pub enum Resource {
    /// A uniform or storage buffer.
    Buffer(wgpu::Buffer),
    /// A read-only table of 16-byte texels, and its size in bytes.
    Table(wgpu::TextureView, u64),
}

impl Resource {
    /// For a bind group.
    pub fn binding(&self) -> wgpu::BindingResource<'_> {
        match self {
            Resource::Buffer(b) => b.as_entire_binding(),
            Resource::Table(view, _) => wgpu::BindingResource::TextureView(view),
        }
    }

    /// Bytes.
    pub fn size(&self) -> u64 {
        match self {
            Resource::Buffer(b) => b.size(),
            Resource::Table(_, bytes) => *bytes,
        }
    }
}

/// An opened adapter.
#[derive(Debug)]
pub struct Gpu {
    /// For creating resources.
    pub device: wgpu::Device,
    /// For submitting work.
    pub queue: wgpu::Queue,
    /// What it is.
    pub info: AdapterInfo,
    /// It binds too few storage textures: tables are buffers, those that the host writes packed into one.
    pub(super) tables_in_buffers: bool,
    pub(super) kernels: Kernels,
    pub(super) meter: Meter,
    /// How it failed, if it did.
    pub faults: Faults,
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // wgpu panics on closing a device that failed: it stays open to the end of the process. What waits may be what finds out.
        if std::thread::panicking() || self.faults.guard(|| self.wait()).is_err() {
            std::mem::forget((self.device.clone(), self.queue.clone()));
        }
    }
}

fn adapters() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    // Discrete first, then integrated, virtual, CPU.
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Cpu => 3,
        wgpu::DeviceType::Other => 4,
    });
    all
}

/// All adapters, the one used by default first.
pub fn list_adapters() -> Vec<AdapterInfo> {
    adapters().iter().map(|a| AdapterInfo::of(&a.get_info())).collect()
}

/// Bytes read back at a time: what is on the way is held a second time.
const READ_BYTES: u64 = 8 << 20;

/// Storage textures of a stage that tables are bound as, where there are so many: no kernel has more tables.
pub const STORAGE_TEXTURES: u32 = 17;

/// What an adapter that has `limits` is asked for: room for large scenes and films, and for tables as textures; in all else no more than core WebGPU has.
fn limits(limits: &wgpu::Limits) -> wgpu::Limits {
    wgpu::Limits {
        max_texture_dimension_2d: limits.max_texture_dimension_2d,
        max_buffer_size: limits.max_buffer_size,
        max_storage_buffer_binding_size: limits.max_storage_buffer_binding_size,
        max_storage_textures_per_shader_stage: limits.max_storage_textures_per_shader_stage.min(STORAGE_TEXTURES),
        max_compute_workgroups_per_dimension: limits.max_compute_workgroups_per_dimension,
        ..wgpu::Limits::default().or_worse_values_from(limits)
    }
}

impl Gpu {
    /// Opens the adapter of this number in [`list_adapters`], from 1, or the first whose name, driver or kind contains `wanted` (any case), or the best one.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none, none matches, or it refuses; [`Error::Fault`] if it fails.
    pub fn open(wanted: Option<&str>) -> Result<Self> {
        let faults = Faults::default();
        faults.guard(|| Self::open_watched(wanted, None, &faults))
    }

    /// Likewise; what is bound stays within `most`, as it does on an adapter that has no more.
    ///
    /// # Errors
    /// As [`Gpu::open`].
    pub fn open_within(wanted: Option<&str>, most: &wgpu::Limits) -> Result<Self> {
        let faults = Faults::default();
        faults.guard(|| Self::open_watched(wanted, Some(most), &faults))
    }

    fn open_watched(wanted: Option<&str>, most: Option<&wgpu::Limits>, faults: &Faults) -> Result<Self> {
        let all = adapters();
        let list = all.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
        if all.is_empty() {
            return Err(Error::device(
                "no Vulkan, Metal or DirectX 12 adapter was found",
                "install a driver (a software one on Debian: apt-get install mesa-vulkan-drivers libvulkan1), or use --device reference",
            ));
        }
        let matches = |a: &wgpu::Adapter| {
            let text = AdapterInfo::of(&a.get_info()).to_string().to_lowercase();
            wanted.is_none_or(|w| text.contains(&w.to_lowercase()))
        };
        let numbered = wanted.and_then(|w| w.parse::<usize>().ok()?.checked_sub(1)).filter(|i| *i < all.len());
        let found = numbered.or_else(|| all.iter().position(matches));
        let Some(adapter) = found.and_then(|i| all.into_iter().nth(i)) else {
            return Err(Error::device(
                format!("no adapter matches {:?}", wanted.unwrap_or_default()),
                format!("choose one of: {list}; `abbe devices` lists them"),
            ));
        };
        let info = AdapterInfo::of(&adapter.get_info());
        let has = adapter.limits();
        let limits = limits(&most.map_or(has.clone(), |most| has.or_worse_values_from(most)));
        let tables_in_buffers =
            limits.max_storage_textures_per_shader_stage < STORAGE_TEXTURES || limits.max_texture_dimension_2d < TABLE_WIDTH;
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("abbe"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: limits,
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(request)
            .map_err(|e| Error::device(format!("{} refused a device: {e}", info.name), "choose another adapter with --device"))?;
        faults.watch(&device);
        Ok(Self {
            device,
            queue,
            info,
            tables_in_buffers,
            kernels: Kernels::default(),
            meter: Meter::default(),
            faults: faults.clone(),
        })
    }

    /// Largest storage buffer that may be bound, bytes.
    pub fn max_binding(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// A read-only table of texels of 16 bytes; `data` is padded to whole texels.
    ///
    /// # Errors
    /// [`Error::Device`] if it is larger than the adapter's textures.
    pub fn table<T: bytemuck::Pod>(&self, label: &str, data: &[T]) -> Result<Resource> {
        if self.tables_in_buffers {
            return self.storage(label, data);
        }
        let mut bytes = bytemuck::cast_slice::<T, u8>(data).to_vec();
        let texture = self.texture(label, bytes.len().div_ceil(16) as u64)?;
        let (width, size) = (texture.width(), texture.size());
        bytes.resize((width * texture.height()) as usize * 16, 0);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 16), rows_per_image: None };
        self.queue.write_texture(texture.as_image_copy(), &bytes, layout, size);
        Ok(Resource::Table(texture.create_view(&Default::default()), bytes.len() as u64))
    }

    /// A table of so many texels of 16 bytes for one kernel to write and another to read.
    ///
    /// # Errors
    /// [`Error::Device`] if it is larger than the adapter's textures.
    pub fn empty_table(&self, label: &str, texels: u64) -> Result<Resource> {
        if self.tables_in_buffers {
            return self.empty_storage(label, 16 * texels);
        }
        let texture = self.texture(label, texels)?;
        let bytes = u64::from(texture.width()) * u64::from(texture.height()) * 16;
        Ok(Resource::Table(texture.create_view(&Default::default()), bytes))
    }

    fn texture(&self, label: &str, texels: u64) -> Result<wgpu::Texture> {
        // Small tables need not fill a row.
        let (width, height) = (texels.clamp(1, u64::from(TABLE_WIDTH)) as u32, texels.max(1).div_ceil(u64::from(TABLE_WIDTH)));
        if height > u64::from(self.device.limits().max_texture_dimension_2d) {
            return Err(Error::device(
                format!("the scene's {label} need {} MiB, more than a texture of {} holds", texels >> 16, self.info.name),
                "use a smaller scene or another adapter",
            ));
        }
        let height = height as u32;
        memory::count_on_adapter(u64::from(width) * u64::from(height) * 16);
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        Ok(self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        }))
    }

    /// A storage buffer with this content (never empty: WebGPU has no zero-sized bindings).
    ///
    /// # Errors
    /// [`Error::Device`] if it is larger than the adapter can bind.
    pub fn storage<T: bytemuck::Pod>(&self, label: &str, data: &[T]) -> Result<Resource> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.empty_storage(label, (bytes.len() as u64).max(16))?;
        if let Resource::Buffer(b) = &buffer {
            self.queue.write_buffer(b, 0, bytes);
        }
        Ok(buffer)
    }

    /// A storage buffer of `size` bytes, zeroed.
    ///
    /// # Errors
    /// [`Error::Device`] if it is larger than the adapter can bind.
    pub fn empty_storage(&self, label: &str, size: u64) -> Result<Resource> {
        if size > self.max_binding() {
            return Err(Error::device(
                format!(
                    "the scene's {label} need {} MiB, {} binds at most {} MiB",
                    size >> 20,
                    self.info.name,
                    self.max_binding() >> 20
                ),
                "use a smaller scene or another adapter",
            ));
        }
        memory::count_on_adapter(size);
        Ok(Resource::Buffer(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size.next_multiple_of(16),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })))
    }

    /// A small uniform buffer.
    pub fn uniform(&self, label: &str, size: u64) -> Resource {
        Resource::Buffer(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// Waits until all submitted work is done, and has not failed.
    ///
    /// # Errors
    /// [`Error::Fault`] if the device has failed.
    pub fn wait(&self) -> Result<()> {
        let begun = Instant::now();
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.meter.waited(begun);
        waited.map(|_| ()).map_err(|e| self.lost(&e))?;
        self.faults.check()
    }

    fn lost(&self, e: &dyn fmt::Display) -> Error {
        self.faults.lost(e)
    }

    /// Fills a buffer with zeros.
    pub fn clear(&self, buffer: &Resource) {
        if let Resource::Buffer(b) = buffer {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(b, 0, None);
            self.queue.submit([encoder.finish()]);
        }
    }

    /// Overwrites the start of a buffer.
    pub fn write<T: bytemuck::Pod>(&self, buffer: &Resource, data: &[T]) {
        if let Resource::Buffer(b) = buffer {
            self.queue.write_buffer(b, 0, bytemuck::cast_slice(data));
        }
    }

    /// Copies a buffer's first `size` bytes back.
    ///
    /// # Errors
    /// [`Error::Fault`] if the device has failed.
    pub fn read<T: bytemuck::Pod>(&self, buffer: &Resource, size: u64) -> Result<Vec<T>> {
        let mut values = Vec::with_capacity(size as usize / size_of::<T>());
        self.read_parts(buffer, size, &mut |part| values.extend_from_slice(part))?;
        Ok(values)
    }

    /// Likewise, part by part: a whole copy of a large buffer would be one more beside what becomes of it.
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub fn read_parts<T: bytemuck::Pod>(&self, buffer: &Resource, size: u64, visit: &mut dyn FnMut(&[T])) -> Result<()> {
        let Resource::Buffer(buffer) = buffer else {
            return Err(Error::device("a table was to be read back", "this is a defect of Abbe: please report it"));
        };
        self.read_buffer(buffer, size, visit)
    }

    pub(super) fn read_buffer<T: bytemuck::Pod>(
        &self,
        buffer: &wgpu::Buffer,
        size: u64,
        visit: &mut dyn FnMut(&[T]),
    ) -> Result<()> {
        // Parts are whole values, of lengths that copies can have: multiples of 4 bytes.
        let value = 4 * size_of::<T>() as u64;
        let part = (READ_BYTES / value).max(1) * value;
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: size.min(part),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        for first in (0..size).step_by(part as usize) {
            let count = part.min(size - first);
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(buffer, first, &staging, 0, count);
            self.queue.submit([encoder.finish()]);
            staging.slice(..count).map_async(wgpu::MapMode::Read, |_| {});
            self.wait()?;
            let view = staging.slice(..count).get_mapped_range().map_err(|e| self.lost(&e))?;
            self.meter.read(count);
            visit(bytemuck::cast_slice(&view));
            drop(view);
            staging.unmap();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_asked_for_than_is_needed_and_there() {
        let core = wgpu::Limits::default();
        let generous = wgpu::Limits {
            max_storage_textures_per_shader_stage: 1 << 20,
            max_storage_buffers_per_shader_stage: 1 << 20,
            max_uniform_buffer_binding_size: 1 << 30,
            max_compute_workgroup_storage_size: 1 << 20,
            max_compute_invocations_per_workgroup: 1 << 12,
            max_buffer_size: 1 << 40,
            ..core.clone()
        };
        let textures = STORAGE_TEXTURES;
        let asked = limits(&generous);
        let needed = wgpu::Limits { max_storage_textures_per_shader_stage: textures, max_buffer_size: 1 << 40, ..core.clone() };
        assert_eq!(asked, needed);
        for has in [core, wgpu::Limits::downlevel_defaults()] {
            assert!(limits(&has).check_limits(&has));
        }
    }
}
