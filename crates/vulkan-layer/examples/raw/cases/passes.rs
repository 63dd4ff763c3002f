//! Render passes.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::shapes;
use crate::target::{Target, TargetPlan};

pub(super) fn load() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let loading = target.plan.pass(&gpu, true)?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let all = shapes();
    for (pass, shapes) in [(target.pass, &all[..4]), (loading, &all[4..])] {
        let recorder = Recorder::once(&gpu)?;
        recorder.pass_of(&target, pass, vk::SubpassContents::INLINE);
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, shapes);
        recorder.end_pass();
        recorder.run()?;
    }
    read(&gpu, target.images.finished())
}
