//! Several devices, instances and queues in one process.

use ash::vk;

use super::{drawn, halves};
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::Host;
use crate::record::read;
use crate::shader;
use crate::target::TargetPlan;

pub(super) fn two_devices() -> Result<Vec<u8>> {
    let host = Host::new()?;
    two(&Gpu::on(&host, |_| Ok(()))?, &Gpu::on(&host, |_| Ok(()))?)
}

pub(super) fn two_instances() -> Result<Vec<u8>> {
    two(&Gpu::plain()?, &Gpu::plain()?)
}

fn two(first: &Gpu, second: &Gpu) -> Result<Vec<u8>> {
    drawn(first, TargetPlan::default(), |plan| plan.fragment(shader::DISCARD))?;
    drawn(second, TargetPlan::default(), |plan| plan)
}

/// Each queue draws half of the shapes, the second when the first is done.
pub(super) fn two_queues() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.queues = 2;
        Ok(())
    })?;
    let (target, first, then) = halves(&gpu)?;
    // SAFETY: the device was opened with two queues; all lives until they are idle.
    unsafe {
        let semaphore = gpu.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?;
        gpu.at_end(move |d| d.destroy_semaphore(semaphore, None));
        let second = gpu.device.get_device_queue(gpu.family, 1);
        let (buffers, semaphores) = ([first], [semaphore]);
        let info =
            vk::SubmitInfo::default().command_buffers(&buffers).signal_semaphores(&semaphores);
        gpu.submit_info(&info)?;
        let buffers = [then];
        let info = vk::SubmitInfo::default()
            .command_buffers(&buffers)
            .wait_semaphores(&semaphores)
            .wait_dst_stage_mask(&[vk::PipelineStageFlags::ALL_COMMANDS]);
        gpu.device.queue_submit(second, &[info], vk::Fence::null())?;
        gpu.device.queue_wait_idle(second)?;
    }
    gpu.wait()?;
    read(&gpu, target.images.finished())
}
