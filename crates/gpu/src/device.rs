//! Finding a GPU, and talking to it without a panic.

use std::fmt;

use crate::guard::Guard;
use crate::kept::Store;
use crate::options::Adapter;
use crate::program::Compiled;
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
/// What goes wrong on it is told by the call that asked for it.
#[derive(Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) programs: Compiled,
    pub(super) kept: Store,
    adapter: Adapter,
    guard: Guard,
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
        let gpu = Self::of(adapter, device, queue);
        gpu.guard.watch(&gpu.device);
        Ok(gpu)
    }

    /// A device that its owner has opened and goes on using: an engine's own, say. Nothing
    /// of it is changed: no handler of errors, no callback. Time stamps and subgroups are used
    /// where it has these features, and chunks are as large as its limits allow.
    pub fn from_device(adapter: &wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        Self::of(Adapter::of(adapter), device, queue)
    }

    fn of(adapter: Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let guard = Guard::new(&adapter);
        let (programs, kept) = (Compiled::default(), Store::default());
        Gpu { device, queue, programs, kept, adapter, guard }
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
    pub(crate) fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// Whether threads that run in step can look at each other's values.
    pub(crate) fn has_subgroups(&self) -> bool {
        self.device.features().contains(wgpu::Features::SUBGROUP)
    }

    /// An error on this adapter.
    pub(super) fn error(&self, what: impl fmt::Display, hint: impl fmt::Display) -> Error {
        self.guard.error(what, hint)
    }

    /// Runs `work`; what the device says against it becomes an error.
    ///
    /// # Errors
    /// As [`Guard::run`].
    pub(super) fn run<T>(&self, doing: &str, work: impl FnOnce() -> T) -> Result<T> {
        self.guard.run(&self.device, doing, work)
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
        let doing = format!("uploading {label}");
        {
            let view = buffer.get_mapped_range_mut(..);
            let mut view = view.map_err(|e| self.guard.failed(&self.device, &doing, e))?;
            fill(view.slice(..))?;
        }
        self.run(&doing, || buffer.unmap())?;
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
        self.run(&format!("making room for {label}"), || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                // Bindings must not be empty.
                size: bytes.max(4).next_multiple_of(4),
                usage,
                mapped_at_creation,
            })
        })
    }

    /// Has the device do what `encode` asks of it.
    ///
    /// # Errors
    /// As [`Gpu::run`] and `encode`.
    pub(super) fn submit(
        &self,
        doing: &str,
        encode: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<()> {
        self.run(doing, || {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encode(&mut encoder)?;
            self.queue.submit([encoder.finish()]);
            Ok(())
        })?
    }

    /// Waits until everything is done.
    ///
    /// # Errors
    /// As [`Guard::wait`].
    pub(super) fn wait(&self, doing: &str) -> Result<()> {
        self.guard.wait(&self.device, doing)
    }

    /// Brings a buffer back and hands it to `look`.
    ///
    /// # Errors
    /// As [`Guard::read`].
    pub(super) fn read<T>(
        &self,
        buffer: &wgpu::Buffer,
        doing: &str,
        look: impl FnOnce(&[u32]) -> T,
    ) -> Result<T> {
        let whole = (buffer, 0..buffer.size());
        self.guard.read((&self.device, &self.queue), whole, doing, look)
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
