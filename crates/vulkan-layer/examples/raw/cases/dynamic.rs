//! State that commands set.

use ash::ext::{extended_dynamic_state as one, extended_dynamic_state3 as three};
use ash::vk;
use vk::DynamicState as State;

use super::one_pass;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::{OPAQUE, OVER, Plan, blend};
use crate::scene::shapes;
use crate::target::{Target, TargetPlan};

/// Opaque, tested shapes; blended ones that write no depth; added ones of some colours.
pub(super) fn dynamic_state() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.extension(one::NAME)?;
        opening.extension(three::NAME)?;
        opening.features::<vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT<'_>>(&[(
            |f| &mut f.extended_dynamic_state,
            "extendedDynamicState",
        )])?;
        opening.features::<vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT<'_>>(&[
            (|f| &mut f.extended_dynamic_state3_color_blend_enable, "colour blend enable"),
            (|f| &mut f.extended_dynamic_state3_color_blend_equation, "colour blend equation"),
            (|f| &mut f.extended_dynamic_state3_color_write_mask, "colour write mask"),
        ])
    })?;
    let first = one::Device::new(&gpu.host.instance, &gpu.device);
    let third = three::Device::new(&gpu.host.instance, &gpu.device);
    let target = Target::new(&gpu, TargetPlan::with_depth())?;
    // What the plan itself says of these states does not count.
    let dynamic = vec![
        State::DEPTH_TEST_ENABLE,
        State::DEPTH_WRITE_ENABLE,
        State::DEPTH_COMPARE_OP,
        State::COLOR_BLEND_ENABLE_EXT,
        State::COLOR_BLEND_EQUATION_EXT,
        State::COLOR_WRITE_MASK_EXT,
    ];
    let plan = Plan { dynamic, ..Plan::new(&gpu, &target)?.blend(OPAQUE) };
    let pipeline = plan.create(&gpu)?;
    let (all, red) = (vk::ColorComponentFlags::RGBA, vk::ColorComponentFlags::R);
    let added = blend(vk::BlendFactor::ONE, vk::BlendFactor::ONE);
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        let at = recorder.buffer;
        let set = |tests, writes, state: vk::PipelineColorBlendAttachmentState, mask| {
            // SAFETY: the device was opened with this dynamic state.
            unsafe {
                first.cmd_set_depth_test_enable(at, tests);
                first.cmd_set_depth_write_enable(at, writes);
                first.cmd_set_depth_compare_op(at, vk::CompareOp::LESS_OR_EQUAL);
                third.cmd_set_color_blend_enable(at, 0, &[state.blend_enable]);
                third.cmd_set_color_blend_equation(at, 0, &[equation(state)]);
                third.cmd_set_color_write_mask(at, 0, &[mask]);
            }
        };
        set(true, true, OPAQUE, all);
        recorder.shapes(plan.layout, &shapes()[..2]);
        set(true, false, OVER, all);
        recorder.shapes(plan.layout, &shapes()[2..5]);
        set(false, false, added, red);
        recorder.shapes(plan.layout, &shapes()[5..]);
    })
}

fn equation(state: vk::PipelineColorBlendAttachmentState) -> vk::ColorBlendEquationEXT {
    vk::ColorBlendEquationEXT {
        src_color_blend_factor: state.src_color_blend_factor,
        dst_color_blend_factor: state.dst_color_blend_factor,
        color_blend_op: state.color_blend_op,
        src_alpha_blend_factor: state.src_alpha_blend_factor,
        dst_alpha_blend_factor: state.dst_alpha_blend_factor,
        alpha_blend_op: state.alpha_blend_op,
    }
}

/// Two viewports one after the other, each with a scissor.
pub(super) fn viewports() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let dynamic = vec![State::VIEWPORT, State::SCISSOR];
    let plan = Plan { dynamic, ..Plan::new(&gpu, &target)? };
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        for (x, height) in [(0, 150.0), (90, 75.0)] {
            // The second is upside down, as programs for OpenGL's axes draw.
            let viewport = vk::Viewport {
                x: x as f32,
                y: if x == 0 { 0.0 } else { height },
                width: 110.0,
                height: if x == 0 { height } else { -height },
                min_depth: 0.2,
                max_depth: 0.9,
            };
            let scissor = vk::Rect2D {
                offset: vk::Offset2D { x: x + 5, y: 5 },
                extent: vk::Extent2D { width: 100, height: 120 },
            };
            let at = recorder.buffer;
            // SAFETY: the pipeline takes both from commands.
            unsafe {
                gpu.device.cmd_set_viewport(at, 0, &[viewport]);
                gpu.device.cmd_set_scissor(at, 0, &[scissor]);
            }
            recorder.shapes(plan.layout, &shapes());
        }
    })
}
