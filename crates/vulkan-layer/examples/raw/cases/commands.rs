//! Command buffers: secondaries, and the same one submitted again.

use ash::ext::conditional_rendering;
use ash::vk;
use vk::CommandBufferUsageFlags as Usage;

use super::one_pass;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::memory::Buffer;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::{Shape, shapes};
use crate::target::{Target, TargetPlan};

pub(super) fn secondaries() -> Result<Vec<u8>> {
    executed(Usage::ONE_TIME_SUBMIT, |first, second| vec![second, first])
}

/// Of two halves, one is drawn on a condition that holds, the other on none that does.
pub(super) fn conditional() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.extension(conditional_rendering::NAME)?;
        opening.features::<vk::PhysicalDeviceConditionalRenderingFeaturesEXT<'_>>(&[(
            |f| &mut f.conditional_rendering,
            "conditionalRendering",
        )])
    })?;
    let calls = conditional_rendering::Device::new(&gpu.host.instance, &gpu.device);
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let usage = vk::BufferUsageFlags::CONDITIONAL_RENDERING_EXT;
    let conditions = Buffer::of(&gpu, &[1, 0], usage)?;
    let all = shapes();
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &all[..2]);
        for (at, some) in [(0, &all[2..4]), (4, &all[4..])] {
            let info = vk::ConditionalRenderingBeginInfoEXT::default()
                .buffer(conditions.handle)
                .offset(at);
            // SAFETY: the buffer holds two conditions.
            unsafe { (calls.fp().cmd_begin_conditional_rendering_ext)(recorder.buffer, &info) }
            recorder.shapes(plan.layout, some);
            // SAFETY: it was begun.
            unsafe { (calls.fp().cmd_end_conditional_rendering_ext)(recorder.buffer) }
        }
    })
}

pub(super) fn secondary_twice() -> Result<Vec<u8>> {
    executed(Usage::SIMULTANEOUS_USE, |first, second| vec![first, second, first])
}

/// Records two secondaries and executes them as `order` says.
fn executed(
    flags: Usage,
    order: impl FnOnce(vk::CommandBuffer, vk::CommandBuffer) -> Vec<vk::CommandBuffer>,
) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let secondary = |shapes| {
        let recorder = Recorder::secondary(&gpu, &target, flags)?;
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, shapes);
        recorder.end()
    };
    let all = shapes();
    let (first, second) = (secondary(&all[..4])?, secondary(&all[4..])?);
    let recorder = Recorder::once(&gpu)?;
    recorder.pass_of(&target, target.pass, vk::SubpassContents::SECONDARY_COMMAND_BUFFERS);
    recorder.execute(&order(first, second));
    recorder.end_pass();
    recorder.run()?;
    read(&gpu, target.images.finished())
}

pub(super) fn twice() -> Result<Vec<u8>> {
    repeated(|gpu, primary| gpu.run(&[primary, primary]))
}

pub(super) fn again() -> Result<Vec<u8>> {
    repeated(|gpu, primary| {
        gpu.submit(&[primary])?;
        gpu.run(&[primary])
    })
}

/// Records a primary that draws onto what is there, and submits it as `submit` says.
fn repeated(submit: impl FnOnce(&Gpu, vk::CommandBuffer) -> Result<()>) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let loading = target.plan.pass(&gpu, true)?;

    let cleared = Recorder::once(&gpu)?;
    cleared.pass(&target);
    cleared.end_pass();
    cleared.run()?;

    let recorder = Recorder::new(&gpu, Usage::SIMULTANEOUS_USE)?;
    recorder.pass_of(&target, loading, vk::SubpassContents::INLINE);
    recorder.bind(pipeline);
    recorder.shapes(plan.layout, &shapes());
    recorder.end_pass();
    submit(&gpu, recorder.end()?)?;
    read(&gpu, target.images.finished())
}

/// Recorded, thrown away with its pool's memory, recorded again, submitted.
pub(super) fn recorded_again() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let recorder = Recorder::once(&gpu)?;
    let draw = |recorder: &Recorder<'_>, shapes: &[Shape]| {
        recorder.pass(&target);
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, shapes);
        recorder.end_pass();
    };
    draw(&recorder, &shapes()[..2]);
    let buffer = recorder.end()?;
    // SAFETY: no buffer of the pool was submitted.
    unsafe {
        gpu.device.reset_command_pool(gpu.pool, vk::CommandPoolResetFlags::RELEASE_RESOURCES)?;
        let info = vk::CommandBufferBeginInfo::default().flags(Usage::ONE_TIME_SUBMIT);
        gpu.device.begin_command_buffer(buffer, &info)?;
    }
    let recorder = Recorder { gpu: &gpu, buffer };
    draw(&recorder, &shapes()[2..]);
    recorder.run()?;
    read(&gpu, target.images.finished())
}
