//! What there is of the program's objects: images and views, passes and framebuffers, layouts,
//! shaders, pipelines and command buffers, each by its handle.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::commands::Commands;
use crate::device::Device;
use crate::layouts::Layouts;
use crate::log;
use crate::pipelines::Pipeline;
use crate::recorder::SLOTS;

/// An image that can be drawn into.
#[derive(Clone)]
pub(crate) struct Image {
    pub number: u64,
    pub handle: vk::Image,
    pub name: String,
    pub format: vk::Format,
    pub extent: vk::Extent3D,
    pub samples: u32,
    pub swapchain: bool,
    /// Whether its pixels can be copied from it.
    pub readable: bool,
    /// As it is after all that has been submitted.
    pub layout: vk::ImageLayout,
}

impl Image {
    pub(crate) fn log(&self) -> log::Image {
        log::Image {
            number: self.number,
            name: self.name.clone(),
            format: self.format.as_raw(),
            width: self.extent.width,
            height: self.extent.height,
            samples: self.samples,
            swapchain: self.swapchain,
        }
    }
}

/// A view of an image.
#[derive(Clone, Copy)]
pub(crate) struct View {
    pub image: u64,
    pub format: vk::Format,
    pub layer: u32,
    pub level: u32,
}

/// An attachment of a render pass.
#[derive(Clone, Copy)]
pub(crate) struct AttachmentInfo {
    pub load: vk::AttachmentLoadOp,
    pub after: vk::ImageLayout,
}

/// What a subpass draws into, by attachment.
#[derive(Clone, Default)]
pub(crate) struct Subpass {
    pub colour: Option<u32>,
    pub resolve: Option<u32>,
    pub depth: Option<u32>,
    /// All colour attachments.
    pub colours: Vec<u32>,
    pub views: u32,
}

#[derive(Clone, Default)]
pub(crate) struct RenderPass {
    pub attachments: Vec<AttachmentInfo>,
    pub subpasses: Vec<Subpass>,
}

#[derive(Clone, Default)]
pub(crate) struct Framebuffer {
    /// None where it is imageless.
    pub views: Vec<u64>,
    pub layers: u32,
}

#[derive(Clone)]
pub(crate) struct Swapchain {
    pub format: vk::Format,
    pub extent: vk::Extent2D,
    pub readable: bool,
    /// The images' numbers, by their index.
    pub images: Vec<u64>,
}

#[derive(Default)]
pub(crate) struct Objects {
    numbers: u64,
    pub images: HashMap<u64, Image>,
    /// Numbers of images by handle: a handle may be used again.
    pub image_numbers: HashMap<u64, u64>,
    pub views: HashMap<u64, View>,
    pub swapchains: HashMap<u64, Swapchain>,
    pub passes: HashMap<u64, Arc<RenderPass>>,
    pub framebuffers: HashMap<u64, Arc<Framebuffer>>,
    pub shaders: HashMap<u64, Arc<[u32]>>,
    pub layouts: Layouts,
    pub pipelines: HashMap<u64, Arc<Pipeline>>,
    pub commands: HashMap<u64, Commands>,
    /// Command buffers of each pool.
    pub pools: HashMap<u64, Vec<u64>>,
    /// Semaphores that hold a counter.
    pub timelines: std::collections::HashSet<u64>,
    /// Queue families by queue.
    pub queues: HashMap<u64, u32>,
    pub slots: Slots,
}

impl Objects {
    /// A number that nothing else has.
    pub(crate) fn number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    /// The image of a handle.
    pub(crate) fn image(&self, handle: vk::Image) -> Option<&Image> {
        self.images.get(self.image_numbers.get(&handle.as_raw())?)
    }

    /// The commands of a command buffer that is being recorded.
    pub(crate) fn recording(&mut self, buffer: vk::CommandBuffer) -> &mut Commands {
        self.commands.entry(buffer.as_raw()).or_default()
    }

    /// Forgets what a command buffer holds.
    pub(crate) fn reset(&mut self, buffer: u64) {
        if let Some(commands) = self.commands.get_mut(&buffer) {
            self.slots.give_back(&mut commands.slots);
            commands.clear();
        }
    }

    /// Forgets a command buffer.
    pub(crate) fn forget(&mut self, buffer: u64) {
        self.reset(buffer);
        self.commands.remove(&buffer);
    }

    pub(crate) fn destroy(&mut self, device: &Device) {
        self.layouts.destroy(device);
    }
}

/// Draws' numbers, each given to one draw at a time.
#[derive(Default)]
pub(crate) struct Slots {
    fresh: u32,
    free: Vec<u32>,
}

impl Slots {
    /// One that no draw has; `None` where all are in use.
    pub(crate) fn take(&mut self) -> Option<u32> {
        self.free.pop().or_else(|| {
            let slot = self.fresh;
            self.fresh = (slot + 1).min(SLOTS);
            (slot < SLOTS).then_some(slot)
        })
    }

    fn give_back(&mut self, slots: &mut Vec<u32>) {
        self.free.append(slots);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_given_once() {
        let mut slots = Slots::default();
        let mut all: Vec<u32> = std::iter::from_fn(|| slots.take()).collect();
        assert_eq!(all, (0..SLOTS).collect::<Vec<_>>());
        slots.give_back(&mut all);
        assert!(slots.take().is_some() && all.is_empty());
    }
}
