//! Barriers, by which images change their layouts, and names that programs give.

use std::ffi::CStr;

use ash::vk;

use crate::abi::slice;
use crate::commands::{with, with_objects};
use crate::device::{Device, device};
use crate::steps::Step;
use crate::table::next;

/// Images change their layouts. Their first level and layer are followed, and no other.
fn transitions(
    d: &Device,
    buffer: vk::CommandBuffer,
    waits: bool,
    all: impl Iterator<Item = (vk::Image, vk::ImageSubresourceRange, vk::ImageLayout, vk::ImageLayout)>,
) {
    if d.over() {
        return;
    }
    with_objects(d, |objects| {
        objects.recording(buffer).waits |= waits;
        let first = |range: &vk::ImageSubresourceRange| {
            range.base_mip_level == 0 && range.base_array_layer == 0
        };
        for (image, range, before, after) in all {
            if before == after || !first(&range) {
                continue;
            }
            let Some(image) = objects.image(image).map(|image| image.number) else { continue };
            objects.recording(buffer).steps.push(Step::Layout(image, after));
        }
    });
}

/// What barriers of either version say.
macro_rules! change {
    ($all:expr) => {
        $all.iter().map(|b| (b.image, b.subresource_range, b.old_layout, b.new_layout))
    };
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
    transitions(&d, buffer, false, change!(all));
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
    transitions(&d, buffer, false, change!(all));
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
    let all = unsafe { slice(images, image_count) };
    transitions(&d, buffer, true, change!(all));
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
    for info in unsafe { slice(infos, n) } {
        let all = unsafe { slice(info.p_image_memory_barriers, info.image_memory_barrier_count) };
        transitions(&d, buffer, true, change!(all));
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
        with(&d, buffer, |commands| commands.push_label(text));
    }
    next!(d.table.begin_label, buffer, label)
}

pub(crate) unsafe extern "system" fn end_label(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.pop_label());
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
