//! What there is of the program's objects: images and views, passes and framebuffers, layouts,
//! shaders, pipelines and command buffers, each by its handle.

use std::collections::HashSet;
use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::commands::Commands;
use crate::device::Device;
use crate::instance::Map;
use crate::layouts::Layouts;
use crate::log;
use crate::pipelines::Pipeline;
use crate::resources::SLOTS;

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
    /// Of a swapchain: it is the program's now.
    pub acquired: bool,
    /// Whether its pixels can be copied from it.
    pub readable: bool,
    /// Of its first level and layer, after all that has been submitted.
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
    /// Why what is drawn in it cannot be told; empty where it can.
    pub refused: &'static str,
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

#[derive(Clone, Copy, Default)]
pub(crate) struct Semaphore {
    /// It holds a counter.
    pub timeline: bool,
    /// Others may signal it than this device's queues.
    pub foreign: bool,
    /// Of one without a counter: a queue was given what signals it, and that may wait for what the
    /// program does later.
    pub signalled: bool,
    pub late: bool,
}

#[derive(Default)]
pub(crate) struct Objects {
    numbers: u64,
    pub images: Map<u64, Image>,
    /// Numbers of images by handle: a handle may be used again.
    pub image_numbers: Map<u64, u64>,
    pub views: Map<u64, View>,
    pub swapchains: Map<u64, Swapchain>,
    pub passes: Map<u64, Arc<RenderPass>>,
    pub framebuffers: Map<u64, Arc<Framebuffer>>,
    pub shaders: Map<u64, Arc<[u32]>>,
    pub layouts: Layouts,
    pub pipelines: Map<u64, Arc<Pipeline>>,
    pub commands: Map<u64, Commands>,
    /// Command buffers of each pool.
    pub pools: Map<u64, Vec<u64>>,
    pub semaphores: Map<u64, Semaphore>,
    /// Of update templates that push descriptors for drawing: by which.
    pub templates: HashSet<u64>,
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

    /// The labels around what a command buffer does now.
    pub(crate) fn label(&self, buffer: vk::CommandBuffer) -> String {
        self.commands.get(&buffer.as_raw()).map_or_else(String::new, |c| c.label.to_string())
    }

    /// Forgets what a command buffer holds.
    /// Draws' numbers are kept back while something is `pending`: its records may have them.
    /// Says whether it was being recorded.
    pub(crate) fn reset(&mut self, buffer: u64, pending: bool) -> bool {
        self.commands.get_mut(&buffer).is_some_and(|commands| {
            self.slots.give_back(&mut commands.slots, pending);
            commands.clear()
        })
    }

    /// Forgets a command buffer.
    pub(crate) fn forget(&mut self, buffer: u64, pending: bool) -> bool {
        let recording = self.reset(buffer, pending);
        self.commands.remove(&buffer);
        recording
    }

    pub(crate) fn destroy(&mut self, device: &Device) {
        self.layouts.destroy(device);
    }
}

/// The number of draws that get none of their own.
pub(crate) const OVERFLOW: u32 = SLOTS - 1;

/// Draws' numbers, each given to one draw at a time.
#[derive(Default)]
pub(crate) struct Slots {
    fresh: u32,
    free: Vec<u32>,
    /// Free as soon as nothing is pending.
    kept: Vec<u32>,
}

impl Slots {
    /// One that no draw has; `None` where all are in use.
    pub(crate) fn take(&mut self) -> Option<u32> {
        self.free.pop().or_else(|| {
            let slot = self.fresh;
            self.fresh = (slot + 1).min(OVERFLOW);
            (slot < OVERFLOW).then_some(slot)
        })
    }

    /// How many there are still.
    pub(crate) fn left(&self) -> u32 {
        OVERFLOW - self.fresh + self.free.len() as u32
    }

    fn give_back(&mut self, slots: &mut Vec<u32>, pending: bool) {
        if pending { self.kept.append(slots) } else { self.free.append(slots) }
    }

    /// Nothing is pending any more.
    pub(crate) fn release(&mut self) {
        self.free.append(&mut self.kept);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_given_once() {
        let mut slots = Slots::default();
        let mut all: Vec<u32> = std::iter::from_fn(|| slots.take()).collect();
        assert_eq!(all, (0..OVERFLOW).collect::<Vec<_>>());
        slots.give_back(&mut all, true);
        assert!(slots.take().is_none() && all.is_empty());
        slots.release();
        assert!(slots.take().is_some());
    }
}
