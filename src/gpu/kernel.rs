//! A compute pipeline whose buffers and textures are bound by the names they have in its WGSL.

use super::{Gpu, Resource, Timer, layout, shader, tables};
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use wgpu::naga::{Expression, Literal};

/// WGSL of the kernel of root file `root`; `constants` and `features` are the plan's and the scene's. An error says where in `shaders/`
/// something is amiss.
pub fn kernel_source(root: &str, constants: &str, features: &BTreeMap<&str, bool>) -> std::result::Result<String, String> {
    shader::assemble(root, &(layout::wgsl_prelude() + constants), features)
}

fn defect(name: &str, problem: &str) -> Error {
    Error::device(format!("shader {name}: {problem}"), "this is a defect of Abbe: please report it with the scene")
}

/// Kernels that a device keeps: those of some five scenes. A software driver holds about 12 MB for each.
const MOST_KEPT: usize = 16;

/// Compiled kernels of a device.
#[derive(Debug, Default)]
pub(super) struct Kernels {
    /// With root file and text, that used last at the end.
    kept: Mutex<Vec<(String, String, Kernel)>>,
    compilations: AtomicUsize,
}

impl Kernels {
    fn find(&self, root: &str, source: &str) -> Option<Kernel> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let place = kept.iter().position(|(r, s, _)| r == root && s == source)?;
        kept[place..].rotate_left(1);
        kept.last().map(|(_, _, kernel)| kernel.clone())
    }

    fn keep(&self, root: &str, source: String, kernel: Kernel) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= MOST_KEPT {
            kept.remove(0);
        }
        kept.push((root.to_string(), source, kernel));
    }
}

impl Gpu {
    /// How many kernels were compiled so far.
    pub fn compilations(&self) -> usize {
        self.kernels.compilations.load(Ordering::Relaxed)
    }
}

/// A compiled kernel.
#[derive(Debug, Clone)]
pub struct Kernel {
    pipeline: wgpu::ComputePipeline,
    /// (name, binding) of every resource in use.
    bindings: Vec<(String, u32)>,
    /// Likewise of tables that are packed into one buffer, in use or not.
    packed: Vec<(String, u32)>,
}

impl Kernel {
    /// Compiles the kernel of root file `root`, or takes it if `gpu` keeps it from before; see [`kernel_source`].
    ///
    /// # Errors
    /// [`Error::Device`] if assembly or compilation fails, which is a defect of Abbe or of the driver.
    pub fn new(gpu: &Gpu, root: &str, constants: &str, features: &BTreeMap<&str, bool>) -> Result<Self> {
        let mut features = features.clone();
        if gpu.tables_in_buffers {
            features.insert(shader::TABLES_IN_BUFFERS, true);
        }
        let source = kernel_source(root, constants, &features).map_err(|e| defect(root, &e))?;
        if let Some(kernel) = gpu.kernels.find(root, &source) {
            return Ok(kernel);
        }
        let kernel = Self::compile(gpu, root, source.clone())?;
        gpu.kernels.keep(root, source, kernel.clone());
        Ok(kernel)
    }

    /// Compiles WGSL whose entry point is `main`; `name` stands for it in messages.
    ///
    /// # Errors
    /// [`Error::Device`] if that fails.
    pub fn compile(gpu: &Gpu, name: &str, source: String) -> Result<Self> {
        gpu.kernels.compilations.fetch_add(1, Ordering::Relaxed);
        let defect = |e: String| defect(name, &e);
        let module = wgpu::naga::front::wgsl::parse_str(&source).map_err(|e| defect(e.emit_to_string(&source)))?;
        // Only what `main` uses is in the pipeline's layout.
        let info = Validator::new(ValidationFlags::empty(), Capabilities::all()).validate(&module);
        let info = info.map_err(|e| defect(e.emit_to_string(&source)))?;
        let used = module.global_variables.iter().filter(|(handle, _)| !info.get_entry_point(0)[*handle].is_empty());
        let bindings = used.filter_map(|(_, v)| Some((v.name.clone()?, v.binding.as_ref()?.binding))).collect();
        let packed = module.constants.iter().filter_map(|(_, c)| {
            let name = c.name.as_deref()?.strip_prefix(tables::PACKED)?;
            match module.global_expressions[c.init] {
                Expression::Literal(Literal::U32(binding)) => Some((name.to_string(), binding)),
                _ => None,
            }
        });
        let packed = packed.collect();
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        let scopes = [Internal, OutOfMemory, Validation].map(|filter| gpu.device.push_error_scope(filter));
        let descriptor = wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(source.into()) };
        // SAFETY: indices are made by the host from the same lists as the buffers, and every loop is bounded or ends with a path; the tests run
        // the same text with all checks on.
        let shader = unsafe {
            let checks = wgpu::ShaderRuntimeChecks::all(std::env::var_os("ABBE_CHECKED_SHADERS").is_some());
            gpu.device.create_shader_module_trusted(descriptor, checks)
        };
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &shader,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        // The last pushed is the first popped.
        let errors: Vec<_> = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop())).collect();
        // What is not the text's fault is the device's, and told first: whatever is made of what failed is invalid, too.
        gpu.wait()?;
        if let Some(e) = errors.iter().find(|e| !matches!(e, wgpu::Error::Validation { .. })) {
            gpu.faults.record_error(e);
            gpu.faults.check()?;
        }
        if let Some(e) = errors.first() {
            return Err(defect(e.to_string()));
        }
        Ok(Self { pipeline, bindings, packed })
    }

    /// Binds resources by name; those that this kernel does not have are passed over.
    ///
    /// # Errors
    /// [`Error::Device`] if one that the kernel has is missing.
    pub fn bind(&self, gpu: &Gpu, resources: &[(&str, &Resource)]) -> Result<wgpu::BindGroup> {
        let mut entries = Vec::new();
        let packed = self.pack(gpu, resources)?;
        let packed = packed.iter().flat_map(|[tables, first]| [("packed_tables", tables), ("first_texels", first)]);
        let resources: Vec<(&str, &Resource)> = resources.iter().copied().chain(packed).collect();
        for (name, binding) in &self.bindings {
            let Some((_, resource)) = resources.iter().find(|(n, _)| n == name) else {
                return Err(Error::device(
                    format!("the kernel's resource {name} was not given"),
                    "this is a defect of Abbe: please report it",
                ));
            };
            entries.push(wgpu::BindGroupEntry { binding: *binding, resource: resource.binding() });
        }
        let layout = self.pipeline.get_bind_group_layout(0);
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries }))
    }

    /// Copies of the tables given that are to be in one buffer, and where each begins in it; `None` where tables are textures.
    fn pack(&self, gpu: &Gpu, resources: &[(&str, &Resource)]) -> Result<Option<[Resource; 2]>> {
        let buffer = |name: &str| match resources.iter().find(|(n, _)| *n == name) {
            Some((_, Resource::Buffer(buffer))) => Some(buffer),
            _ => None,
        };
        let tables: Vec<_> = self.packed.iter().filter_map(|(name, binding)| Some((*binding, buffer(name)?))).collect();
        if tables.is_empty() {
            return Ok(None);
        }
        let all = gpu.empty_storage("tables together", tables.iter().map(|(_, table)| table.size()).sum())?;
        let first = gpu.uniform("where tables begin", 4 * u64::from(tables::PACKED_TABLES));
        let (mut bytes, mut texels) = (0, [0u32; tables::PACKED_TABLES as usize]);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for (binding, table) in tables {
            if let Resource::Buffer(all) = &all {
                encoder.copy_buffer_to_buffer(table, 0, all, bytes, table.size());
            }
            texels[binding as usize] = (bytes / 16) as u32;
            bytes += table.size();
        }
        gpu.write(&first, &texels);
        gpu.queue.submit([encoder.finish()]);
        Ok(Some([all, first]))
    }

    /// Appends a dispatch of `groups` workgroups.
    pub fn dispatch(&self, encoder: &mut wgpu::CommandEncoder, bindings: &wgpu::BindGroup, groups: u32) {
        self.dispatch_timed(encoder, bindings, groups, None);
    }

    /// Likewise; where there is a timer, it reads the adapter's clock before and after, for the kernel of this number.
    pub fn dispatch_timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &wgpu::BindGroup,
        groups: u32,
        timer: Option<(&Timer, u32)>,
    ) {
        let timestamp_writes = timer.map(|(timer, kernel)| timer.writes(kernel));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: None, timestamp_writes });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bindings, &[]);
        pass.dispatch_workgroups(groups, 1, 1);
    }
}
