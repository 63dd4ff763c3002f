//! Finding a GPU, and talking to it without a panic.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::options::Adapter;
use screendoor_trace::error::{Error, Result};

/// What to install where there is no adapter.
const INSTALL: &str = "install a Vulkan driver: that of the graphics card, or Mesa's software \
                       driver (Debian and Ubuntu: mesa-vulkan-drivers)";

impl Adapter {
    fn of(adapter: &wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        Adapter {
            name: info.name.trim().to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_string(),
            backend: info.backend.to_str().to_string(),
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete GPU",
                wgpu::DeviceType::IntegratedGpu => "integrated GPU",
                wgpu::DeviceType::VirtualGpu => "virtual GPU",
                wgpu::DeviceType::Cpu => "CPU",
                wgpu::DeviceType::Other => "other",
            },
            subgroup: [info.subgroup_min_size, info.subgroup_max_size],
        }
    }

    /// The kinds from the most to the least wanted.
    fn rank(&self) -> usize {
        let kinds = ["discrete GPU", "integrated GPU", "virtual GPU", "other", "CPU"];
        kinds.iter().position(|k| *k == self.kind).unwrap_or(kinds.len())
    }
}

/// A GPU that is open.
///
/// What goes wrong on it is kept, and told by the next call that returns a [`Result`].
#[derive(Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: Adapter,
    fault: Arc<Mutex<Option<Fault>>>,
    pipelines: Mutex<HashMap<(String, String), wgpu::ComputePipeline>>,
}

/// How long a device may take to say why it failed.
const PATIENCE: Duration = Duration::from_secs(5);

/// What went wrong.
#[derive(Clone, Debug)]
enum Fault {
    Memory,
    Lost(String),
    Other(String),
}

impl Gpu {
    /// The adapters of this machine, the most wanted first.
    pub fn adapters() -> Vec<Adapter> {
        found().into_iter().map(|(adapter, _)| adapter).collect()
    }

    /// Opens the adapter whose name or driver holds `name`, in whatever case; the most
    /// wanted where none is named.
    ///
    /// # Errors
    /// [`Error::Gpu`] where there is no adapter or it cannot be opened, [`Error::Config`]
    /// where there is none of that name.
    pub fn open(name: Option<&str>) -> Result<Self> {
        let all = found();
        if all.is_empty() {
            return Err(Error::gpu("no GPU", "no adapter was found", INSTALL));
        }
        let names: Vec<String> = all.iter().map(|(adapter, _)| adapter.to_string()).collect();
        let wanted = |(adapter, _): &(Adapter, wgpu::Adapter)| {
            name.is_none_or(|name| {
                adapter.to_string().to_lowercase().contains(&name.to_lowercase())
            })
        };
        let Some((adapter, inner)) = all.into_iter().find(wanted) else {
            return Err(Error::config(
                format_args!("there is no adapter '{}'", name.unwrap_or_default()),
                format_args!("there are: {}", names.join("; ")),
            ));
        };
        Self::request(adapter, &inner)
    }

    fn request(adapter: Adapter, inner: &wgpu::Adapter) -> Result<Self> {
        let wanted = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::SUBGROUP;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("screendoor"),
            required_features: inner.features() & wanted,
            // All that it has: what is needed depends on the trace.
            required_limits: inner.limits(),
            ..Default::default()
        };
        let opened = pollster::block_on(inner.request_device(&descriptor));
        let (device, queue) = opened.map_err(|e| {
            Error::gpu(&adapter, format_args!("it cannot be opened: {e}"), "choose another")
        })?;
        let fault = Arc::new(Mutex::new(None));
        // The first is the cause of the others.
        let keep = |fault: &Arc<Mutex<Option<Fault>>>, found| {
            fault.lock().expect("no thread panicked").get_or_insert(found);
        };
        let kept = fault.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let found = match error {
                wgpu::Error::OutOfMemory { .. } => Fault::Memory,
                other => Fault::Other(other.to_string()),
            };
            keep(&kept, found);
        }));
        let kept = fault.clone();
        // One that is dropped is lost as well; then nobody asks any more.
        device.set_device_lost_callback(move |_, why| keep(&kept, Fault::Lost(why)));
        Ok(Gpu { device, queue, adapter, fault, pipelines: Mutex::default() })
    }

    /// Gives the device up, as if the card had been taken out: whatever is asked of it from
    /// now on is an error. For trying what happens then.
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// What it says about itself.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Its limits.
    pub(super) fn limits(&self) -> wgpu::Limits {
        self.device.limits()
    }

    /// Whether it can tell when its programs begin and end.
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Whether threads that run in step can look at each other's values.
    pub fn has_subgroups(&self) -> bool {
        self.device.features().contains(wgpu::Features::SUBGROUP)
    }

    /// An error on this adapter.
    pub(super) fn error(&self, what: impl fmt::Display, hint: impl fmt::Display) -> Error {
        Error::gpu(&self.adapter, what, hint)
    }

    /// Why memory could not be reached: what went wrong on the device, if it knows.
    fn failed(&self, doing: &str, why: &dyn fmt::Display) -> Error {
        // A device tells that it is lost when it is asked, and when its last work is over.
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        let polled = self.device.poll(wait);
        let cause = self.check(doing).err();
        cause.unwrap_or_else(|| match polled {
            Err(e) => self.error(format_args!("{doing} failed: {e}"), "try again"),
            Ok(_) => self.error(format_args!("{doing} failed: {why}"), "try again"),
        })
    }

    /// Whether all went well until now.
    ///
    /// # Errors
    /// [`Error::Gpu`] with the first thing that went wrong.
    pub(super) fn check(&self, doing: &str) -> Result<()> {
        match &*self.fault.lock().expect("no thread panicked") {
            None => Ok(()),
            Some(Fault::Memory) => Err(self.error(
                format_args!("its memory is full ({doing})"),
                "close other programs, choose fewer samples, or do without the GPU",
            )),
            Some(Fault::Lost(why)) => Err(self.error(
                match why.as_str() {
                    "" => format!("it was lost ({doing})"),
                    why => format!("it was lost ({doing}): {why}"),
                },
                "try again; if it happens again, look at the system's log and its driver",
            )),
            Some(Fault::Other(why)) => Err(self.error(
                format_args!(
                    "{doing} failed: {}",
                    why.split_whitespace().collect::<Vec<_>>().join(" ")
                ),
                "this is a fault of screendoor or of the driver: do without the GPU",
            )),
        }
    }

    /// An empty buffer.
    ///
    /// # Errors
    /// [`Error::Gpu`] where it is too large or there is no memory.
    pub(super) fn buffer(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        self.create(label, bytes, usage, false)
    }

    /// A buffer that holds `bytes`.
    ///
    /// # Errors
    /// As [`Gpu::buffer`].
    pub(super) fn filled(
        &self,
        label: &str,
        bytes: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        let contents = if bytes.is_empty() { &[0; 4] } else { bytes };
        self.mapped(label, contents.len() as u64, usage, |mut to| {
            to.slice(..contents.len()).copy_from_slice(contents);
            Ok(())
        })
    }

    /// A buffer of so many bytes that `fill` fills.
    ///
    /// # Errors
    /// As [`Gpu::buffer`] and `fill`.
    pub(super) fn mapped(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
        fill: impl FnOnce(wgpu::WriteOnly<'_, [u8]>) -> Result<()>,
    ) -> Result<wgpu::Buffer> {
        let buffer = self.create(label, bytes, usage, true)?;
        {
            let view = buffer.get_mapped_range_mut(..);
            let mut view = view.map_err(|e| self.failed(&format!("uploading {label}"), &e))?;
            fill(view.slice(..))?;
        }
        buffer.unmap();
        self.check(&format!("uploading {label}"))?;
        Ok(buffer)
    }

    /// A buffer, mapped so that it can be filled or not.
    fn create(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
        mapped_at_creation: bool,
    ) -> Result<wgpu::Buffer> {
        let most = most_bytes(&self.device);
        if bytes > most {
            return Err(self.error(
                format_args!("{label} take {bytes} bytes, and a buffer holds {most} at most"),
                "do without the GPU",
            ));
        }
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            // Bindings must not be empty.
            size: bytes.max(4).next_multiple_of(4),
            usage,
            mapped_at_creation,
        });
        self.check(&format!("making room for {label}"))?;
        Ok(buffer)
    }

    /// The program `entry` of a shader; compiled once.
    ///
    /// # Errors
    /// [`Error::Gpu`] where it does not compile.
    pub(super) fn pipeline(
        &self,
        source: &str,
        entry: &str,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<wgpu::ComputePipeline> {
        /// Programs that are kept: enough for every design at several sample counts, which
        /// the suite of hard cases goes through again and again.
        const KEPT: usize = 512;
        let key = (source.to_string(), entry.to_string());
        let mut pipelines = self.pipelines.lock().expect("no thread panicked");
        if let Some(pipeline) = pipelines.get(&key) {
            return Ok(pipeline.clone());
        }
        if pipelines.len() >= KEPT {
            pipelines.clear();
        }
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(entry),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        self.check(&format!("compiling the shader of '{entry}'"))?;
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            bind_group_layouts: &[Some(layout)],
            ..Default::default()
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        });
        self.check(&format!("compiling '{entry}'"))?;
        pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }

    /// The layout of bindings with these numbers.
    pub(super) fn layout(&self, bindings: &[(u32, Access)]) -> wgpu::BindGroupLayout {
        let entry = |(binding, access): &(u32, Access)| wgpu::BindGroupLayoutEntry {
            binding: *binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match access {
                    Access::Uniform => wgpu::BufferBindingType::Uniform,
                    Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
                    Access::Write => wgpu::BufferBindingType::Storage { read_only: false },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<_> = bindings.iter().map(entry).collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries };
        self.device.create_bind_group_layout(&descriptor)
    }

    /// Buffers under their numbers.
    pub(super) fn bind(
        &self,
        layout: &wgpu::BindGroupLayout,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = buffers
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        self.device.create_bind_group(&descriptor)
    }

    /// Starts what was encoded.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub(super) fn submit(&self, encoder: wgpu::CommandEncoder, doing: &str) -> Result<()> {
        self.queue.submit([encoder.finish()]);
        self.check(doing)
    }

    /// Waits until everything is done.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub(super) fn wait(&self, doing: &str) -> Result<()> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check(doing)?;
        polled.map_err(|e| self.error(format_args!("{doing} did not end: {e}"), "try again"))?;
        Ok(())
    }

    /// Brings a buffer back and hands it to `look`.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub(super) fn read<T>(
        &self,
        buffer: &wgpu::Buffer,
        doing: &str,
        look: impl FnOnce(&[u32]) -> T,
    ) -> Result<T> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let copy = self.buffer("what comes back", buffer.size(), usage)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        self.submit(encoder, doing)?;
        let (sender, receiver) = std::sync::mpsc::channel();
        copy.map_async(wgpu::MapMode::Read, .., move |result| {
            // Nobody waits any more where waiting has failed.
            let _ = sender.send(result);
        });
        self.wait(doing)?;
        match receiver.recv() {
            Ok(Ok(())) => {}
            Ok(Err(e)) => return Err(self.failed(doing, &e)),
            Err(e) => return Err(self.failed(doing, &e)),
        }
        let view = copy.get_mapped_range(..).map_err(|e| self.failed(doing, &e))?;
        Ok(look(bytemuck::cast_slice(&view)))
    }

    /// How many groups to start in each dimension so that there are at least `groups`.
    pub(super) fn spread(&self, groups: u64) -> [u32; 2] {
        let most = u64::from(self.limits().max_compute_workgroups_per_dimension);
        let rows = groups.div_ceil(most).max(1);
        [groups.div_ceil(rows) as u32, rows as u32]
    }
}

/// The most bytes that a buffer of a device can have and still be bound.
pub(super) fn most_bytes(device: &wgpu::Device) -> u64 {
    let limits = device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

/// What a program does with a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Access {
    Uniform,
    Read,
    Write,
}

/// The adapters, the most wanted first.
fn found() -> Vec<(Adapter, wgpu::Adapter)> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // The user is told of errors by their results, not by layers that may be installed.
    descriptor.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(descriptor);
    let all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let mut all: Vec<_> = all.into_iter().map(|inner| (Adapter::of(&inner), inner)).collect();
    all.sort_by_key(|(adapter, _)| adapter.rank());
    all
}
