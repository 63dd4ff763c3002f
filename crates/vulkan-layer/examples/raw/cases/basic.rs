//! One pass of draws.

use ash::vk;

use super::{drawn, one_pass};
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::{OPAQUE, Plan, layout};
use crate::scene::shapes;
use crate::shader;
use crate::target::{Target, TargetPlan};

pub(super) fn plain() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, &TargetPlan::default(), |plan| plan)
}

pub(super) fn msaa4() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, &TargetPlan::multisampled(), |plan| plan)
}

pub(super) fn depth() -> Result<Vec<u8>> {
    depth_test(TargetPlan::with_depth(), vk::CompareOp::LESS)
}

/// Opaque shapes, then blended ones that are tested against them.
fn depth_test(target: TargetPlan, compare: vk::CompareOp) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, target)?;
    let plan = Plan::new(&gpu, &target)?;
    let solid = plan.clone().blend(OPAQUE).depth(compare, true).create(&gpu)?;
    let clear = plan.clone().depth(compare, false).create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        let (first, then) = (&shapes()[..3], &shapes()[3..]);
        recorder.bind(solid);
        recorder.shapes(plan.layout, first);
        recorder.bind(clear);
        recorder.shapes(plan.layout, then);
    })
}

pub(super) fn discard() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, &TargetPlan::default(), |plan| plan.fragment(shader::DISCARD))
}

pub(super) fn push() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let layout = layout(&gpu, &[], 128)?;
    let plan = Plan { layout, ..Plan::new(&gpu, &target)? }
        .vertex(shader::PUSH_VERTEX)
        .fragment(shader::PUSH);
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        for (shape, k) in shapes().iter().zip(0_u8..) {
            let lean = f32::from(k) * 0.05;
            let mut values = shape.constants().to_vec();
            // Corners with each one's way to the next instance, then two tints.
            values.extend([0.0, lean, 0.1, 0.1, 1.0, 0.0, 0.15, 0.1]);
            values.extend([lean, 1.0, 0.1, 0.15, 1.0, 1.0 - lean, 0.05, 0.1]);
            values.extend([1.0, 0.8, 0.9, 1.0, 0.4, 1.0, 1.0 - lean, 0.7]);
            recorder.push(layout, &values);
            recorder.draw(6, shape.instances);
        }
    })
}
