//! An open device with a queue, and what was made on it, destroyed with it.

use std::cell::RefCell;
use std::rc::Rc;

use ash::vk;

use crate::failure::{Failure, Result};
use crate::host::{Host, Opening};

pub(crate) type Ending = Box<dyn FnOnce(&ash::Device)>;

pub(crate) struct Gpu {
    pub(crate) host: Rc<Host>,
    pub(crate) device: ash::Device,
    pub(crate) family: u32,
    pub(crate) queue: vk::Queue,
    pub(crate) pool: vk::CommandPool,
    endings: RefCell<Vec<Ending>>,
}

impl Gpu {
    /// With nothing beyond Vulkan 1.1.
    pub(crate) fn plain() -> Result<Self> {
        Self::with(|_| Ok(()))
    }

    /// With what `ask` asks for.
    pub(crate) fn with(ask: impl FnOnce(&mut Opening) -> Result<()>) -> Result<Self> {
        Self::on(&Host::new()?, ask)
    }

    pub(crate) fn on(
        host: &Rc<Host>,
        ask: impl FnOnce(&mut Opening) -> Result<()>,
    ) -> Result<Self> {
        let mut opening = Opening::new(host);
        ask(&mut opening)?;
        opening.open()
    }

    pub(crate) fn new(host: Rc<Host>, device: ash::Device, family: u32) -> Result<Self> {
        // SAFETY: the family is the device's.
        unsafe {
            let queue = device.get_device_queue(family, 0);
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
            let pool = device.create_command_pool(&info, None)?;
            Ok(Self { host, device, family, queue, pool, endings: RefCell::default() })
        }
    }

    /// What is to be called before the device is destroyed, the last first.
    pub(crate) fn at_end(&self, ending: impl FnOnce(&ash::Device) + 'static) {
        self.endings.borrow_mut().push(Box::new(ending));
    }

    /// How much there is to destroy now: for [`Self::take_since`].
    pub(crate) fn mark(&self) -> usize {
        self.endings.borrow().len()
    }

    /// What destroys what was made since the mark, for the caller to call, the last first.
    pub(crate) fn take_since(&self, mark: usize) -> Vec<Ending> {
        let mut endings = self.endings.borrow_mut().split_off(mark);
        endings.reverse();
        endings
    }

    /// Memory for what has these requirements, of a kind with these properties.
    pub(crate) fn memory(
        &self,
        requirements: vk::MemoryRequirements,
        properties: vk::MemoryPropertyFlags,
    ) -> Result<vk::DeviceMemory> {
        // SAFETY: the device is the host's.
        unsafe {
            let host = &self.host;
            let kinds = host.instance.get_physical_device_memory_properties(host.physical);
            let kind = (0..kinds.memory_type_count).find(|&i| {
                requirements.memory_type_bits & 1 << i != 0
                    && kinds.memory_types[i as usize].property_flags.contains(properties)
            });
            let kind = kind.ok_or_else(|| Failure::unsupported("no memory of a kind"))?;
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(requirements.size)
                .memory_type_index(kind);
            let memory = self.device.allocate_memory(&info, None)?;
            self.at_end(move |d| d.free_memory(memory, None));
            Ok(memory)
        }
    }

    /// Submits command buffers and waits until they are done.
    pub(crate) fn run(&self, buffers: &[vk::CommandBuffer]) -> Result<()> {
        self.submit(buffers)?;
        self.wait()
    }

    pub(crate) fn submit(&self, buffers: &[vk::CommandBuffer]) -> Result<()> {
        self.submit_info(&vk::SubmitInfo::default().command_buffers(buffers))
    }

    pub(crate) fn submit_info(&self, info: &vk::SubmitInfo<'_>) -> Result<()> {
        let info = std::slice::from_ref(info);
        // SAFETY: the caller's buffers are recorded and live.
        Ok(unsafe { self.device.queue_submit(self.queue, info, vk::Fence::null()) }?)
    }

    pub(crate) fn wait(&self) -> Result<()> {
        // SAFETY: no other thread uses the queue.
        Ok(unsafe { self.device.queue_wait_idle(self.queue) }?)
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // A device that is lost is destroyed all the same.
        // SAFETY: no other thread uses the device.
        unsafe {
            let _ = self.device.device_wait_idle();
            let endings = self.endings.take();
            endings.into_iter().rev().for_each(|end| end(&self.device));
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
    }
}
