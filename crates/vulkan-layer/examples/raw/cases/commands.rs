//! Command buffers: secondaries, and the same one submitted again.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::shapes;
use crate::target::{Target, TargetPlan};

const SIMULTANEOUS: vk::CommandBufferUsageFlags = vk::CommandBufferUsageFlags::SIMULTANEOUS_USE;

pub(super) fn secondaries() -> Result<Vec<u8>> {
    executed(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT, |first, second| vec![second, first])
}

/// Records two secondaries and executes them as `order` says.
fn executed(
    flags: vk::CommandBufferUsageFlags,
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

    let recorder = Recorder::new(&gpu, SIMULTANEOUS)?;
    recorder.pass_of(&target, loading, vk::SubpassContents::INLINE);
    recorder.bind(pipeline);
    recorder.shapes(plan.layout, &shapes());
    recorder.end_pass();
    submit(&gpu, recorder.end()?)?;
    read(&gpu, target.images.finished())
}
