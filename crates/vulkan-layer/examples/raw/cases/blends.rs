//! What becomes of the shader's colour.

use ash::vk;
use vk::BlendFactor as Factor;

use super::{drawn, one_pass};
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::{OPAQUE, OVER, Plan, blend};
use crate::scene::shapes;
use crate::shader;
use crate::target::{Target, TargetPlan};

pub(super) fn premultiplied() -> Result<Vec<u8>> {
    let over = blend(Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA);
    drawn(&Gpu::plain()?, TargetPlan::default(), |plan| {
        plan.blend(over).fragment(shader::PREMULTIPLIED)
    })
}

pub(super) fn one_one() -> Result<Vec<u8>> {
    blended(blend(Factor::ONE, Factor::ONE))
}

/// Greatest of both, which knows no factors.
pub(super) fn max() -> Result<Vec<u8>> {
    let (color_blend_op, alpha_blend_op) = (vk::BlendOp::MAX, vk::BlendOp::MAX);
    blended(vk::PipelineColorBlendAttachmentState { color_blend_op, alpha_blend_op, ..OVER })
}

pub(super) fn write_mask() -> Result<Vec<u8>> {
    let color_write_mask = vk::ColorComponentFlags::R | vk::ColorComponentFlags::B;
    blended(vk::PipelineColorBlendAttachmentState { color_write_mask, ..OVER })
}

fn blended(state: vk::PipelineColorBlendAttachmentState) -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::default(), |plan| plan.blend(state))
}

pub(super) fn constant_blend() -> Result<Vec<u8>> {
    constant([0.4; 4])
}

pub(super) fn constant_colour() -> Result<Vec<u8>> {
    constant([0.7, 0.2, 0.5, 0.4])
}

/// Of the pipeline for the first shapes, of the command buffer for the others.
fn constant(constants: [f32; 4]) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let state = blend(Factor::CONSTANT_COLOR, Factor::ONE_MINUS_CONSTANT_COLOR);
    let plan = Plan { constants, ..Plan::new(&gpu, &target)?.blend(state) };
    let fixed = plan.create(&gpu)?;
    let dynamic = Plan { dynamic: vec![vk::DynamicState::BLEND_CONSTANTS], ..plan.clone() };
    let dynamic = dynamic.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(fixed);
        recorder.shapes(plan.layout, &shapes()[..4]);
        recorder.bind(dynamic);
        for shape in &shapes()[4..] {
            let more = constants.map(|c| c + 0.1 * shape.place[3]);
            // SAFETY: the command buffer is being recorded.
            unsafe { gpu.device.cmd_set_blend_constants(recorder.buffer, &more) }
            recorder.shape(plan.layout, shape);
        }
    })
}

pub(super) fn dual_source() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.core((|f| &mut f.dual_src_blend, "dualSrcBlend")))?;
    let state = blend(Factor::ONE, Factor::ONE_MINUS_SRC1_COLOR);
    drawn(&gpu, TargetPlan::default(), |plan| plan.blend(state).fragment(shader::DUAL_SOURCE))
}

pub(super) fn logic_op() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.core((|f| &mut f.logic_op, "logicOp")))?;
    drawn(&gpu, TargetPlan::default(), |plan| Plan {
        logic: Some(vk::LogicOp::XOR),
        ..plan.blend(OPAQUE)
    })
}

pub(super) fn alpha_to_coverage() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::multisampled(), |plan| Plan {
        alpha_to_coverage: true,
        ..plan.blend(OPAQUE)
    })
}

/// As weighted transparency does: sums in one, what is let through in the other.
pub(super) fn two_targets() -> Result<Vec<u8>> {
    let gpu =
        Gpu::with(|opening| opening.core((|f| &mut f.independent_blend, "independentBlend")))?;
    drawn(&gpu, TargetPlan::two(), |plan| Plan {
        blends: vec![
            blend(Factor::ONE, Factor::ONE),
            blend(Factor::ZERO, Factor::ONE_MINUS_SRC_ALPHA),
        ],
        ..plan.fragment(shader::TWO_TARGETS)
    })
}
