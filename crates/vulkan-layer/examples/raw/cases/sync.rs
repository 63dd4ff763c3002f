//! Work that waits, on what is there already or comes only after it was submitted.

use std::thread::sleep;
use std::time::Duration;

use ash::khr::timeline_semaphore;
use ash::vk;

use super::halves;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::Opening;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::shapes;
use crate::target::{Target, TargetPlan};

/// How long the host lets submitted work wait.
const LATE: Duration = Duration::from_millis(50);

fn ask(opening: &mut Opening) -> Result<()> {
    opening.extension(timeline_semaphore::NAME)?;
    opening.features::<vk::PhysicalDeviceTimelineSemaphoreFeatures<'_>>(&[(
        |f| &mut f.timeline_semaphore,
        "timelineSemaphore",
    )])
}

fn timeline_semaphore(gpu: &Gpu) -> Result<vk::Semaphore> {
    let mut kind =
        vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
    // SAFETY: the device was opened with timeline semaphores.
    unsafe {
        let semaphore = gpu.device.create_semaphore(&info, None)?;
        gpu.at_end(move |d| d.destroy_semaphore(semaphore, None));
        Ok(semaphore)
    }
}

/// What a submission waits for on a timeline, and what it makes of it.
fn submit(
    gpu: &Gpu,
    queue: vk::Queue,
    buffer: vk::CommandBuffer,
    semaphore: vk::Semaphore,
    [before, after]: [u64; 2],
) -> Result<()> {
    let (buffers, semaphores, before, after) = ([buffer], [semaphore], [before], [after]);
    let mut values = vk::TimelineSemaphoreSubmitInfo::default()
        .wait_semaphore_values(&before)
        .signal_semaphore_values(&after);
    let info = vk::SubmitInfo::default()
        .command_buffers(&buffers)
        .wait_semaphores(&semaphores)
        .wait_dst_stage_mask(&[vk::PipelineStageFlags::ALL_COMMANDS])
        .signal_semaphores(&semaphores)
        .push_next(&mut values);
    // SAFETY: what the structure points at lives until the call's end.
    Ok(unsafe { gpu.device.queue_submit(queue, &[info], vk::Fence::null()) }?)
}

/// The host lets both halves go long after they were submitted.
pub(super) fn timeline() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let calls = timeline_semaphore::Device::new(&gpu.host.instance, &gpu.device);
    let semaphore = timeline_semaphore(&gpu)?;
    let (target, first, then) = halves(&gpu)?;
    submit(&gpu, gpu.queue, first, semaphore, [1, 2])?;
    submit(&gpu, gpu.queue, then, semaphore, [2, 3])?;
    sleep(LATE);
    signal(&calls, semaphore, 1)?;
    wait(&calls, semaphore, 3)?;
    read(&gpu, target.images.finished())
}

/// The queue lets the second half go when the first is drawn.
pub(super) fn timeline_queue() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let calls = timeline_semaphore::Device::new(&gpu.host.instance, &gpu.device);
    let semaphore = timeline_semaphore(&gpu)?;
    let (target, first, then) = halves(&gpu)?;
    submit(&gpu, gpu.queue, first, semaphore, [0, 1])?;
    submit(&gpu, gpu.queue, then, semaphore, [1, 2])?;
    wait(&calls, semaphore, 2)?;
    read(&gpu, target.images.finished())
}

/// A command buffer twice, each time in a submission that the host lets go later.
pub(super) fn timeline_twice() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let calls = timeline_semaphore::Device::new(&gpu.host.instance, &gpu.device);
    let semaphore = timeline_semaphore(&gpu)?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let recorder = Recorder::new(&gpu, vk::CommandBufferUsageFlags::SIMULTANEOUS_USE)?;
    recorder.pass(&target);
    recorder.bind(pipeline);
    recorder.shapes(plan.layout, &shapes());
    recorder.end_pass();
    let buffer = recorder.end()?;
    submit(&gpu, gpu.queue, buffer, semaphore, [1, 2])?;
    submit(&gpu, gpu.queue, buffer, semaphore, [2, 3])?;
    signal(&calls, semaphore, 1)?;
    wait(&calls, semaphore, 3)?;
    read(&gpu, target.images.finished())
}

/// A submission that waits for the host, and one behind it that does not.
pub(super) fn timeline_behind() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let calls = timeline_semaphore::Device::new(&gpu.host.instance, &gpu.device);
    let semaphore = timeline_semaphore(&gpu)?;
    let (target, first, then) = halves(&gpu)?;
    submit(&gpu, gpu.queue, first, semaphore, [1, 2])?;
    gpu.submit(&[then])?;
    signal(&calls, semaphore, 1)?;
    gpu.wait()?;
    read(&gpu, target.images.finished())
}

/// One queue waits for the other, which is given its work later.
pub(super) fn timeline_two_queues() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.queues = 2;
        ask(opening)
    })?;
    let calls = timeline_semaphore::Device::new(&gpu.host.instance, &gpu.device);
    let semaphore = timeline_semaphore(&gpu)?;
    let (target, first, then) = halves(&gpu)?;
    // SAFETY: the device was opened with two queues.
    let second = unsafe { gpu.device.get_device_queue(gpu.family, 1) };
    submit(&gpu, second, then, semaphore, [1, 2])?;
    sleep(LATE);
    submit(&gpu, gpu.queue, first, semaphore, [0, 1])?;
    wait(&calls, semaphore, 2)?;
    read(&gpu, target.images.finished())
}

fn signal(calls: &timeline_semaphore::Device, semaphore: vk::Semaphore, value: u64) -> Result<()> {
    let info = vk::SemaphoreSignalInfo::default().semaphore(semaphore).value(value);
    // SAFETY: the semaphore is the device's.
    Ok(unsafe { calls.signal_semaphore(&info) }?)
}

fn wait(calls: &timeline_semaphore::Device, semaphore: vk::Semaphore, value: u64) -> Result<()> {
    let (semaphores, values) = ([semaphore], [value]);
    let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
    // SAFETY: the semaphore is the device's.
    Ok(unsafe { calls.wait_semaphores(&info, u64::MAX) }?)
}

/// The command buffer waits for an event that the host sets after it was submitted.
pub(super) fn events() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let (target, first, then) = halves(&gpu)?;
    let recorder = Recorder::once(&gpu)?;
    // SAFETY: the event lives until the device is idle.
    let event = unsafe {
        let event = gpu.device.create_event(&vk::EventCreateInfo::default(), None)?;
        gpu.at_end(move |d| d.destroy_event(event, None));
        gpu.device.cmd_wait_events(
            recorder.buffer,
            &[event],
            vk::PipelineStageFlags::HOST,
            vk::PipelineStageFlags::ALL_COMMANDS,
            &[],
            &[],
            &[],
        );
        event
    };
    let waits = recorder.end()?;
    gpu.submit(&[waits, first, then])?;
    sleep(LATE);
    // SAFETY: the event is the device's.
    unsafe { gpu.device.set_event(event) }?;
    gpu.wait()?;
    read(&gpu, target.images.finished())
}
