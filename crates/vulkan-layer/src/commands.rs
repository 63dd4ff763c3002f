//! Command buffers: what they hold, in its order, apart from draws.

use std::ffi::CStr;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk::{self, Handle};

use crate::abi::slice;
use crate::device::{Device, SETTINGS, device};
use crate::dynamic::Dynamic;
use crate::guard;
use crate::log::{self, Event};
use crate::objects::Objects;
use crate::passes::Begun;
use crate::pipelines::Pipeline;
use crate::sets::Sets;
use crate::table::next;

/// What a command buffer does.
#[derive(Clone)]
pub(crate) enum Step {
    Event(Event),
    /// Secondary command buffers.
    Execute(Vec<u64>),
    /// It waits for an event, which the host may set.
    Waits,
}

/// What it does to images' layouts, which are followed whether or not anything is captured.
pub(crate) enum Move {
    /// An image is in this layout from here on.
    Layout(u64, vk::ImageLayout),
    /// Secondary command buffers.
    Execute(Vec<u64>),
}

/// A pass that has begun.
pub(crate) enum Open {
    Pass(Begun),
    /// The layouts in which its images are.
    Rendering(Vec<(u64, vk::ImageLayout)>),
}

/// A command buffer.
#[derive(Default)]
pub(crate) struct Commands {
    pub steps: Vec<Step>,
    pub moves: Vec<Move>,
    pub slots: Vec<u32>,
    pub pipeline: Option<Arc<Pipeline>>,
    pub dynamic: Dynamic,
    pub sets: Sets,
    pub open: Option<Open>,
    /// It is run once, before anything is captured: its draws are the program's own.
    pub plain: bool,
    labels: Vec<String>,
}

impl Commands {
    pub(crate) fn clear(&mut self) {
        *self = Self { slots: std::mem::take(&mut self.slots), ..Self::default() };
    }

    /// The labels around what comes now.
    pub(crate) fn label(&self) -> String {
        self.labels.join(" / ")
    }
}

/// Does something with the commands of a buffer.
pub(crate) fn with(d: &Device, buffer: vk::CommandBuffer, what: impl FnOnce(&mut Commands)) {
    with_objects(d, |objects| what(objects.recording(buffer)));
}

/// Does something with a device's objects.
pub(crate) fn with_objects(d: &Device, what: impl FnOnce(&mut Objects)) {
    guard(|| what(&mut d.objects()));
}

pub(crate) unsafe extern "system" fn allocate(
    handle: vk::Device,
    info: *const vk::CommandBufferAllocateInfo<'_>,
    out: *mut vk::CommandBuffer,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.allocate_command_buffers, handle, info, out);
    if result == vk::Result::SUCCESS {
        with_objects(&d, |objects| {
            let info = unsafe { &*info };
            let buffers = unsafe { slice(out, info.command_buffer_count) };
            let pool = objects.pools.entry(info.command_pool.as_raw()).or_default();
            pool.extend(buffers.iter().map(|buffer| buffer.as_raw()));
        });
    }
    result
}

pub(crate) unsafe extern "system" fn free(
    handle: vk::Device,
    pool: vk::CommandPool,
    n: u32,
    buffers: *const vk::CommandBuffer,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    with_objects(&d, |objects| {
        for buffer in unsafe { slice(buffers, n) } {
            objects.forget(buffer.as_raw());
            if let Some(pool) = objects.pools.get_mut(&pool.as_raw()) {
                pool.retain(|b| *b != buffer.as_raw());
            }
        }
    });
    next!(d.table.free_command_buffers, handle, pool, n, buffers)
}

pub(crate) unsafe extern "system" fn destroy_pool(
    handle: vk::Device,
    pool: vk::CommandPool,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    with_objects(&d, |objects| {
        for buffer in objects.pools.remove(&pool.as_raw()).unwrap_or_default() {
            objects.forget(buffer);
        }
    });
    next!(d.table.destroy_command_pool, handle, pool, allocator)
}

pub(crate) unsafe extern "system" fn reset_pool(
    handle: vk::Device,
    pool: vk::CommandPool,
    flags: vk::CommandPoolResetFlags,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    with_objects(&d, |objects| {
        for buffer in objects.pools.get(&pool.as_raw()).cloned().unwrap_or_default() {
            objects.reset(buffer);
        }
    });
    next!(d.table.reset_command_pool, handle, pool, flags)
}

pub(crate) unsafe extern "system" fn reset(
    buffer: vk::CommandBuffer,
    flags: vk::CommandBufferResetFlags,
) -> vk::Result {
    let Some(d) = (unsafe { device(buffer) }) else { return vk::Result::ERROR_DEVICE_LOST };
    with_objects(&d, |objects| objects.reset(buffer.as_raw()));
    next!(d.table.reset_command_buffer, buffer, flags)
}

pub(crate) unsafe extern "system" fn begin(
    buffer: vk::CommandBuffer,
    info: *const vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    let Some(d) = (unsafe { device(buffer) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let once = unsafe { (*info).flags }.contains(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    let plain = once && !d.soon.load(Ordering::Acquire);
    // To begin is to reset.
    with_objects(&d, |objects| {
        objects.reset(buffer.as_raw());
        objects.recording(buffer).plain = plain;
    });
    next!(d.table.begin, buffer, info)
}

pub(crate) unsafe extern "system" fn bind_pipeline(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let mut ours = pipeline;
    if point == vk::PipelineBindPoint::GRAPHICS {
        with_objects(&d, |objects| {
            let bound = objects.pipelines.get(&pipeline.as_raw()).cloned();
            let commands = objects.recording(buffer);
            if let Some(bound) = &bound
                && !commands.plain
                && !bound.ours.is_null()
            {
                ours = bound.ours;
            }
            commands.pipeline = bound;
        });
    }
    next!(d.table.bind_pipeline, buffer, point, ours)
}

pub(crate) unsafe extern "system" fn bind_sets(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    first: u32,
    n: u32,
    sets: *const vk::DescriptorSet,
    offset_count: u32,
    offsets: *const u32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    if point == vk::PipelineBindPoint::GRAPHICS {
        with_objects(&d, |objects| {
            let Some(info) = objects.layouts.pipeline(layout).cloned() else { return };
            let (sets, offsets) = unsafe { (slice(sets, n), slice(offsets, offset_count)) };
            objects.recording(buffer).sets.bind(&info, first, sets, offsets);
        });
    }
    next!(d.table.bind_sets, buffer, point, layout, first, n, sets, offset_count, offsets)
}

pub(crate) unsafe extern "system" fn push_set(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    set: u32,
    n: u32,
    writes: *const vk::WriteDescriptorSet<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.sets.push(set));
    next!(d.table.push_set, buffer, point, layout, set, n, writes)
}

pub(crate) unsafe extern "system" fn push_set_template(
    buffer: vk::CommandBuffer,
    template: vk::DescriptorUpdateTemplate,
    layout: vk::PipelineLayout,
    set: u32,
    data: *const std::ffi::c_void,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.sets.push(set));
    next!(d.table.push_set_template, buffer, template, layout, set, data)
}

pub(crate) unsafe extern "system" fn execute(
    buffer: vk::CommandBuffer,
    n: u32,
    buffers: *const vk::CommandBuffer,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| {
        let all: Vec<u64> = unsafe { slice(buffers, n) }.iter().map(|b| b.as_raw()).collect();
        commands.moves.push(Move::Execute(all.clone()));
        commands.steps.push(Step::Execute(all));
        // What they leave bound is undefined.
        commands.pipeline = None;
        commands.sets = Sets::default();
        commands.dynamic = Dynamic::default();
    });
    next!(d.table.execute, buffer, n, buffers)
}

pub(crate) unsafe extern "system" fn clear_attachments(
    buffer: vk::CommandBuffer,
    n: u32,
    attachments: *const vk::ClearAttachment,
    rect_count: u32,
    rects: *const vk::ClearRect,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| {
        let (all, rects) = unsafe { (slice(attachments, n), slice(rects, rect_count)) };
        for clear in all {
            let depth = clear.aspect_mask.contains(vk::ImageAspectFlags::DEPTH);
            let colour = clear.aspect_mask.contains(vk::ImageAspectFlags::COLOR)
                && clear.color_attachment == SETTINGS.location;
            let value = unsafe { clear.clear_value.color.float32 };
            for rect in rects.iter().filter(|_| depth || colour) {
                let (at, size) = (rect.rect.offset, rect.rect.extent);
                let area = [at.x, at.y, size.width as i32, size.height as i32];
                let event = Event::Clear(log::Clear { depth, value, area });
                commands.steps.push(Step::Event(event));
            }
        }
    });
    next!(d.table.clear_attachments, buffer, n, attachments, rect_count, rects)
}

/// An image is written by a command that is no draw.
fn write(d: &Device, buffer: vk::CommandBuffer, image: vk::Image, command: &str) {
    with_objects(d, |objects| {
        let Some(image) = objects.image(image).map(|image| image.number) else { return };
        let event = Event::Write(log::Write { image, command: command.into() });
        objects.recording(buffer).steps.push(Step::Event(event));
    });
}

/// Hooks of commands that write an image. The arguments from its layout on, or a structure.
macro_rules! writers {
    ($($hook:ident: $next:ident, $command:literal,
       ($($before:ident: $bt:ty),*), ($($after:ident: $at:ty),*);)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(
            buffer: vk::CommandBuffer, $($before: $bt,)* image: vk::Image, $($after: $at),*
        ) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            write(&d, buffer, image, $command);
            next!(d.table.$next, buffer, $($before,)* image, $($after),*)
        }
    )*};
}

writers! {
    clear_colour_image: clear_colour_image, "vkCmdClearColorImage", (),
        (layout: vk::ImageLayout, value: *const vk::ClearColorValue, n: u32,
         ranges: *const vk::ImageSubresourceRange);
    copy_image: copy_image, "vkCmdCopyImage", (source: vk::Image, from: vk::ImageLayout),
        (layout: vk::ImageLayout, n: u32, regions: *const vk::ImageCopy);
    blit_image: blit_image, "vkCmdBlitImage", (source: vk::Image, from: vk::ImageLayout),
        (layout: vk::ImageLayout, n: u32, regions: *const vk::ImageBlit, filter: vk::Filter);
    resolve_image: resolve_image, "vkCmdResolveImage", (source: vk::Image, from: vk::ImageLayout),
        (layout: vk::ImageLayout, n: u32, regions: *const vk::ImageResolve);
    copy_from_buffer: copy_from_buffer, "vkCmdCopyBufferToImage", (source: vk::Buffer),
        (layout: vk::ImageLayout, n: u32, regions: *const vk::BufferImageCopy);
}

macro_rules! writers2 {
    ($($hook:ident: $next:ident, $command:literal, $info:ty;)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(buffer: vk::CommandBuffer, info: *const $info) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            write(&d, buffer, unsafe { (*info).dst_image }, $command);
            next!(d.table.$next, buffer, info)
        }
    )*};
}

writers2! {
    copy_image2: copy_image2, "vkCmdCopyImage2", vk::CopyImageInfo2<'_>;
    blit_image2: blit_image2, "vkCmdBlitImage2", vk::BlitImageInfo2<'_>;
    resolve_image2: resolve_image2, "vkCmdResolveImage2", vk::ResolveImageInfo2<'_>;
    copy_from_buffer2: copy_from_buffer2, "vkCmdCopyBufferToImage2", vk::CopyBufferToImageInfo2<'_>;
}

/// Images change their layouts.
fn transitions(
    d: &Device,
    buffer: vk::CommandBuffer,
    all: impl Iterator<Item = (vk::Image, vk::ImageLayout, vk::ImageLayout)>,
) {
    with_objects(d, |objects| {
        for (image, _, after) in all.filter(|(_, before, after)| before != after) {
            let Some(image) = objects.image(image).map(|image| image.number) else { continue };
            objects.recording(buffer).moves.push(Move::Layout(image, after));
        }
    });
}

pub(crate) unsafe extern "system" fn barrier(
    buffer: vk::CommandBuffer,
    before: vk::PipelineStageFlags,
    after: vk::PipelineStageFlags,
    flags: vk::DependencyFlags,
    memory_count: u32,
    memory: *const vk::MemoryBarrier<'_>,
    buffer_count: u32,
    buffers: *const vk::BufferMemoryBarrier<'_>,
    n: u32,
    images: *const vk::ImageMemoryBarrier<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let all = unsafe { slice(images, n) };
    transitions(&d, buffer, all.iter().map(|b| (b.image, b.old_layout, b.new_layout)));
    next!(
        d.table.barrier,
        buffer,
        before,
        after,
        flags,
        memory_count,
        memory,
        buffer_count,
        buffers,
        n,
        images
    )
}

pub(crate) unsafe extern "system" fn barrier2(
    buffer: vk::CommandBuffer,
    info: *const vk::DependencyInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let dependency = unsafe { &*info };
    let all =
        unsafe { slice(dependency.p_image_memory_barriers, dependency.image_memory_barrier_count) };
    transitions(&d, buffer, all.iter().map(|b| (b.image, b.old_layout, b.new_layout)));
    next!(d.table.barrier2, buffer, info)
}

pub(crate) unsafe extern "system" fn wait_events(
    buffer: vk::CommandBuffer,
    n: u32,
    events: *const vk::Event,
    before: vk::PipelineStageFlags,
    after: vk::PipelineStageFlags,
    memory_count: u32,
    memory: *const vk::MemoryBarrier<'_>,
    buffer_count: u32,
    buffers: *const vk::BufferMemoryBarrier<'_>,
    image_count: u32,
    images: *const vk::ImageMemoryBarrier<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.steps.push(Step::Waits));
    let all = unsafe { slice(images, image_count) };
    transitions(&d, buffer, all.iter().map(|b| (b.image, b.old_layout, b.new_layout)));
    next!(
        d.table.wait_events,
        buffer,
        n,
        events,
        before,
        after,
        memory_count,
        memory,
        buffer_count,
        buffers,
        image_count,
        images
    )
}

pub(crate) unsafe extern "system" fn wait_events2(
    buffer: vk::CommandBuffer,
    n: u32,
    events: *const vk::Event,
    infos: *const vk::DependencyInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.steps.push(Step::Waits));
    for info in unsafe { slice(infos, n) } {
        let all = unsafe { slice(info.p_image_memory_barriers, info.image_memory_barrier_count) };
        transitions(&d, buffer, all.iter().map(|b| (b.image, b.old_layout, b.new_layout)));
    }
    next!(d.table.wait_events2, buffer, n, events, infos)
}

pub(crate) unsafe extern "system" fn begin_label(
    buffer: vk::CommandBuffer,
    label: *const vk::DebugUtilsLabelEXT<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let text = unsafe { (*label).p_label_name };
    if !text.is_null() {
        let text = unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned();
        with(&d, buffer, |commands| commands.labels.push(text));
    }
    next!(d.table.begin_label, buffer, label)
}

pub(crate) unsafe extern "system" fn end_label(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| drop(commands.labels.pop()));
    next!(d.table.end_label, buffer)
}

pub(crate) unsafe extern "system" fn set_name(
    handle: vk::Device,
    info: *const vk::DebugUtilsObjectNameInfoEXT<'_>,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    with_objects(&d, |objects| {
        let info = unsafe { &*info };
        if info.p_object_name.is_null() {
            return;
        }
        let text = unsafe { CStr::from_ptr(info.p_object_name) }.to_string_lossy().into_owned();
        match info.object_type {
            vk::ObjectType::IMAGE => {
                let number = objects.image_numbers.get(&info.object_handle).copied();
                if let Some(image) = number.and_then(|n| objects.images.get_mut(&n)) {
                    image.name = text;
                }
            }
            vk::ObjectType::PIPELINE => {
                if let Some(pipeline) = objects.pipelines.get(&info.object_handle) {
                    pipeline.rename(text);
                }
            }
            _ => {}
        }
    });
    next!(d.table.set_name, handle, info)
}
