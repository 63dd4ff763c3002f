//! What writes images besides draws: clears and transfers.

use ash::vk;

use crate::abi::slice;
use crate::commands::{CONDITIONAL, with, with_objects};
use crate::device::{Device, SETTINGS, device};
use crate::log::{self, Event};
use crate::steps::Step;
use crate::table::next;

pub(crate) unsafe extern "system" fn clear_attachments(
    buffer: vk::CommandBuffer,
    n: u32,
    attachments: *const vk::ClearAttachment,
    rect_count: u32,
    rects: *const vk::ClearRect,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| {
        if commands.conditional {
            return commands.spoil(CONDITIONAL);
        }
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
    if d.over() {
        return;
    }
    with_objects(d, |objects| {
        let Some(image) = objects.image(image).map(|image| image.number) else { return };
        objects.recording(buffer).write(image, command);
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
    clear_depth_image: clear_depth_image, "vkCmdClearDepthStencilImage", (),
        (layout: vk::ImageLayout, value: *const vk::ClearDepthStencilValue, n: u32,
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

pub(crate) unsafe extern "system" fn begin_condition(
    buffer: vk::CommandBuffer,
    info: *const vk::ConditionalRenderingBeginInfoEXT<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.conditional = true);
    next!(d.table.begin_condition, buffer, info)
}

pub(crate) unsafe extern "system" fn end_condition(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.conditional = false);
    next!(d.table.end_condition, buffer)
}
