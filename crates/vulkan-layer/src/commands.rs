//! Command buffers: when they are recorded, and what they bind.

use std::collections::BTreeSet;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk::{self, Handle};

use crate::abi::slice;
use crate::device::{Device, device};
use crate::dynamic::Dynamic;
use crate::guard;
use crate::log::{self, Event};
use crate::objects::Objects;
use crate::pipelines::Pipeline;
use crate::rendering::Begun;
use crate::sets::Sets;
use crate::steps::Step;
use crate::table::next;

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
    pub slots: Vec<u32>,
    pub pipeline: Option<Arc<Pipeline>>,
    /// The program's own pipeline is bound where ours could be.
    pub own: bool,
    pub dynamic: Dynamic,
    pub sets: Sets,
    pub open: Option<Open>,
    /// The images of the pass, and why what is drawn in it cannot be told.
    pub images: BTreeSet<u64>,
    pub refused: &'static str,
    /// Its draws may be left out by what lies in a buffer.
    pub conditional: bool,
    /// It waits for an event, which the host may set.
    pub waits: bool,
    /// Nothing is captured when it is recorded: its draws are the program's own.
    pub plain: bool,
    /// Why what it does to the images of the pass that it is executed in is not told.
    pub spoils: &'static str,
    /// It is being recorded and not plain.
    recording: bool,
    labels: Vec<String>,
    /// All labels around what comes now, outermost first.
    pub label: Arc<str>,
}

pub(crate) const PLAIN: &str = "draws recorded before the capture was to begin";
pub(crate) const CONDITIONAL: &str = "it is drawn on a condition that lies in a buffer";

impl Commands {
    /// Forgets all but the numbers of draws. Says whether it was being recorded.
    pub(crate) fn clear(&mut self) -> bool {
        let slots = std::mem::take(&mut self.slots);
        std::mem::replace(self, Self { slots, ..Self::default() }).recording
    }

    pub(crate) fn push_label(&mut self, label: String) {
        self.labels.push(label);
        self.label = self.labels.join(" / ").into();
    }

    pub(crate) fn pop_label(&mut self) {
        self.labels.pop();
        self.label = self.labels.join(" / ").into();
    }

    pub(crate) fn write(&mut self, image: u64, command: &str) {
        let event = Event::Write(log::Write { image, command: command.into() });
        self.steps.push(Step::Event(event));
    }

    /// What is done to the images of the pass cannot be told.
    pub(crate) fn spoil(&mut self, why: &'static str) {
        for image in self.images.clone() {
            self.write(image, why);
        }
        self.spoils = why;
    }
}

/// Does something with the commands of a buffer, unless it is plain.
pub(crate) fn with(d: &Device, buffer: vk::CommandBuffer, what: impl FnOnce(&mut Commands)) {
    if d.idle() {
        return;
    }
    with_objects(d, |objects| {
        let commands = objects.recording(buffer);
        if !commands.plain {
            what(commands);
        }
    });
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

/// Forgets what command buffers hold, and `gone` ones altogether.
fn reset_all(d: &Device, buffers: impl FnOnce(&mut Objects) -> Vec<u64>, gone: bool) {
    let pending = d.pending.load(Ordering::Acquire);
    with_objects(d, |objects| {
        for buffer in buffers(objects) {
            let recording = match gone {
                true => objects.forget(buffer, pending),
                false => objects.reset(buffer, pending),
            };
            d.recorded(recording);
        }
    });
}

pub(crate) unsafe extern "system" fn free(
    handle: vk::Device,
    pool: vk::CommandPool,
    n: u32,
    buffers: *const vk::CommandBuffer,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    let freed = |objects: &mut Objects| {
        let all: BTreeSet<u64> = unsafe { slice(buffers, n) }.iter().map(|b| b.as_raw()).collect();
        if let Some(pool) = objects.pools.get_mut(&pool.as_raw()) {
            pool.retain(|b| !all.contains(b));
        }
        all.into_iter().collect()
    };
    reset_all(&d, freed, true);
    next!(d.table.free_command_buffers, handle, pool, n, buffers)
}

pub(crate) unsafe extern "system" fn destroy_pool(
    handle: vk::Device,
    pool: vk::CommandPool,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    reset_all(&d, |objects| objects.pools.remove(&pool.as_raw()).unwrap_or_default(), true);
    next!(d.table.destroy_command_pool, handle, pool, allocator)
}

pub(crate) unsafe extern "system" fn reset_pool(
    handle: vk::Device,
    pool: vk::CommandPool,
    flags: vk::CommandPoolResetFlags,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let all = |objects: &mut Objects| objects.pools.get(&pool.as_raw()).cloned();
    reset_all(&d, |objects| all(objects).unwrap_or_default(), false);
    next!(d.table.reset_command_pool, handle, pool, flags)
}

pub(crate) unsafe extern "system" fn reset(
    buffer: vk::CommandBuffer,
    flags: vk::CommandBufferResetFlags,
) -> vk::Result {
    let Some(d) = (unsafe { device(buffer) }) else { return vk::Result::ERROR_DEVICE_LOST };
    reset_all(&d, |_| vec![buffer.as_raw()], false);
    next!(d.table.reset_command_buffer, buffer, flags)
}

pub(crate) unsafe extern "system" fn begin(
    buffer: vk::CommandBuffer,
    info: *const vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    let Some(d) = (unsafe { device(buffer) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let once = unsafe { (*info).flags }.contains(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    let plain = d.over() || once && !d.soon.load(Ordering::Acquire);
    // To begin is to reset.
    reset_all(&d, |_| vec![buffer.as_raw()], false);
    with_objects(&d, |objects| {
        let commands = objects.recording(buffer);
        (commands.plain, commands.recording) = (plain, !plain);
        if plain {
            commands.spoils = PLAIN;
        } else {
            d.busy.fetch_add(1, Ordering::AcqRel);
        }
    });
    next!(d.table.begin, buffer, info)
}

pub(crate) unsafe extern "system" fn end(buffer: vk::CommandBuffer) -> vk::Result {
    let Some(d) = (unsafe { device(buffer) }) else { return vk::Result::ERROR_DEVICE_LOST };
    with(&d, buffer, |commands| d.recorded(std::mem::take(&mut commands.recording)));
    next!(d.table.end, buffer)
}

pub(crate) unsafe extern "system" fn bind_pipeline(
    buffer: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let mut ours = pipeline;
    if point == vk::PipelineBindPoint::GRAPHICS && !d.idle() {
        with_objects(&d, |objects| {
            let bound = objects.pipelines.get(&pipeline.as_raw()).cloned();
            let commands = objects.recording(buffer);
            if commands.plain {
                return;
            }
            if let Some(bound) = &bound
                && !bound.ours.is_null()
            {
                ours = bound.ours;
            }
            (commands.pipeline, commands.own) = (bound, false);
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
    if point == vk::PipelineBindPoint::GRAPHICS && !d.idle() {
        with_objects(&d, |objects| {
            let info = objects.layouts.pipeline(layout).cloned();
            let (sets, offsets) = unsafe { (slice(sets, n), slice(offsets, offset_count)) };
            let bound = &mut objects.recording(buffer).sets;
            match info {
                Some(info) => bound.bind(&info, first, sets, offsets),
                None => bound.lose(first, n),
            }
        });
    }
    next!(d.table.bind_sets, buffer, point, layout, first, n, sets, offset_count, offsets)
}

/// The program pushes descriptors for drawing.
fn push(d: &Device, buffer: vk::CommandBuffer, layout: vk::PipelineLayout, set: u32) {
    with_objects(d, |objects| {
        let info = objects.layouts.pipeline(layout).cloned().unwrap_or_default();
        objects.recording(buffer).sets.push(&info, set);
    });
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
    if point == vk::PipelineBindPoint::GRAPHICS && !d.idle() {
        push(&d, buffer, layout, set);
    }
    next!(d.table.push_set, buffer, point, layout, set, n, writes)
}

pub(crate) unsafe extern "system" fn push_set_template(
    buffer: vk::CommandBuffer,
    template: vk::DescriptorUpdateTemplate,
    layout: vk::PipelineLayout,
    set: u32,
    data: *const c_void,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    if !d.idle() && d.objects().templates.contains(&template.as_raw()) {
        push(&d, buffer, layout, set);
    }
    next!(d.table.push_set_template, buffer, template, layout, set, data)
}

pub(crate) unsafe extern "system" fn execute(
    buffer: vk::CommandBuffer,
    n: u32,
    buffers: *const vk::CommandBuffer,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let all: Vec<u64> = unsafe { slice(buffers, n) }.iter().map(|b| b.as_raw()).collect();
    if !d.over() {
        with_objects(&d, |objects| {
            let executed = all.iter().filter_map(|buffer| objects.commands.get(buffer));
            let (mut spoils, mut waits) = ("", false);
            for secondary in executed {
                waits |= secondary.waits;
                if spoils.is_empty() {
                    spoils = secondary.spoils;
                }
            }
            let commands = objects.recording(buffer);
            commands.waits |= waits;
            if spoils.is_empty() {
                spoils = if commands.conditional { CONDITIONAL } else { commands.refused };
            }
            commands.steps.push(Step::Execute(all.clone()));
            if !spoils.is_empty() {
                commands.spoil(spoils);
            }
            // What they leave bound is undefined.
            commands.pipeline = None;
            commands.sets = Sets::default();
            commands.dynamic = Dynamic::default();
        });
    }
    next!(d.table.execute, buffer, n, buffers)
}
