//! One pass of draws, with and without a depth buffer.

use ash::vk;

use super::{drawn, one_pass};
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::{OPAQUE, Plan, layout};
use crate::scene::{Shape, shapes};
use crate::shader::{self, Shader};
use crate::target::{Target, TargetPlan};

pub(super) fn plain() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::default(), |plan| plan)
}

pub(super) fn msaa4() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::multisampled(), |plan| plan)
}

pub(super) fn depth() -> Result<Vec<u8>> {
    depth_test(TargetPlan::with_depth(), vk::CompareOp::LESS, shader::COLOUR)
}

pub(super) fn depth_msaa4() -> Result<Vec<u8>> {
    let target = TargetPlan { depth: Some(vk::Format::D32_SFLOAT), ..TargetPlan::multisampled() };
    depth_test(target, vk::CompareOp::LESS, shader::COLOUR)
}

pub(super) fn reversed() -> Result<Vec<u8>> {
    let target = TargetPlan { clear_depth: 0.0, ..TargetPlan::with_depth() };
    depth_test(target, vk::CompareOp::GREATER_OR_EQUAL, shader::COLOUR)
}

pub(super) fn depth_output() -> Result<Vec<u8>> {
    depth_test(TargetPlan::with_depth(), vk::CompareOp::LESS, shader::DEPTH_OUTPUT)
}

pub(super) fn early_tests() -> Result<Vec<u8>> {
    depth_test(TargetPlan::with_depth(), vk::CompareOp::LESS, shader::EARLY_TESTS)
}

/// Opaque shapes, then blended ones that are tested against them.
fn depth_test(target: TargetPlan, compare: vk::CompareOp, shader: Shader) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, target)?;
    let plan = Plan::new(&gpu, &target)?.fragment(shader);
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

pub(super) fn no_fragment_output() -> Result<Vec<u8>> {
    prepass(|mut plan| {
        plan.stages.truncate(1);
        // Without a shader colours are not defined.
        plan.blends[0].color_write_mask = vk::ColorComponentFlags::empty();
        plan
    })
}

pub(super) fn prepass_discard() -> Result<Vec<u8>> {
    prepass(|mut plan| {
        plan.blends[0].color_write_mask = vk::ColorComponentFlags::empty();
        plan.fragment(shader::DISCARD)
    })
}

/// Depth first, then colour where depth is the same.
fn prepass(first: impl FnOnce(Plan) -> Plan) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::with_depth())?;
    let plan = Plan::new(&gpu, &target)?;
    let depth = first(plan.clone()).depth(vk::CompareOp::LESS, true).create(&gpu)?;
    let colour = plan.clone().depth(vk::CompareOp::EQUAL, false).create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        for pipeline in [depth, colour] {
            recorder.bind(pipeline);
            recorder.shapes(plan.layout, &shapes());
        }
    })
}

pub(super) fn stencil() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let format = vk::Format::D32_SFLOAT_S8_UINT;
    let target = TargetPlan { depth: Some(format), ..TargetPlan::default() };
    let target = Target::new(&gpu, target)?;
    let plan = Plan::new(&gpu, &target)?;
    let state = vk::StencilOpState {
        fail_op: vk::StencilOp::KEEP,
        pass_op: vk::StencilOp::INCREMENT_AND_CLAMP,
        depth_fail_op: vk::StencilOp::KEEP,
        compare_op: vk::CompareOp::ALWAYS,
        compare_mask: 255,
        write_mask: 255,
        reference: 2,
    };
    let count = plan.clone().stencil(state).create(&gpu)?;
    let test = vk::StencilOpState {
        pass_op: vk::StencilOp::KEEP,
        compare_op: vk::CompareOp::LESS_OR_EQUAL,
        ..state
    };
    let tested = plan.clone().stencil(test).create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(count);
        recorder.shapes(plan.layout, &shapes()[..4]);
        recorder.bind(tested);
        recorder.shapes(plan.layout, &shapes()[4..]);
    })
}

pub(super) fn discard() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::default(), |plan| plan.fragment(shader::DISCARD))
}

pub(super) fn mask_output() -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::multisampled(), |plan| plan.fragment(shader::MASK_OUTPUT))
}

/// By the shader, which asks which sample it is.
pub(super) fn per_sample() -> Result<Vec<u8>> {
    let gpu = sample_rate()?;
    drawn(&gpu, TargetPlan::multisampled(), |plan| plan.fragment(shader::PER_SAMPLE))
}

/// By the pipeline; the shader is as always.
pub(super) fn sample_shading() -> Result<Vec<u8>> {
    let gpu = sample_rate()?;
    drawn(&gpu, TargetPlan::multisampled(), |plan| Plan { sample_shading: true, ..plan })
}

fn sample_rate() -> Result<Gpu> {
    Gpu::with(|opening| opening.core((|f| &mut f.sample_rate_shading, "sampleRateShading")))
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

pub(super) fn many_draws() -> Result<Vec<u8>> {
    let spread = |i: u16, by: u16| f32::from(i.wrapping_mul(by) % 1000) / 500.0 - 1.0;
    let small = (0..5000_u16).map(|i| Shape {
        vertices: if i.is_multiple_of(2) { 6 } else { 3 },
        instances: 1,
        place: [spread(i, 397), spread(i, 211), 0.05, f32::from(i) / 5000.0],
        colour: [spread(i, 89).abs(), spread(i, 53).abs(), spread(i, 17).abs(), 0.5],
    });
    many(small.collect())
}

/// Four million fragments.
pub(super) fn grow() -> Result<Vec<u8>> {
    let full = (0..134_u8).map(|i| Shape {
        vertices: 6,
        instances: 1,
        place: [-1.0, -1.0, 2.0, 0.1],
        colour: [f32::from(i % 3) * 0.4, f32::from(i % 5) * 0.2, f32::from(i % 7) * 0.15, 0.05],
    });
    many(full.collect())
}

fn many(shapes: Vec<Shape>) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes);
    })
}

pub(super) fn integer_target() -> Result<Vec<u8>> {
    format(vk::Format::R8G8B8A8_UINT, |plan| plan.blend(OPAQUE).fragment(shader::INTEGER))
}

pub(super) fn float_target() -> Result<Vec<u8>> {
    format(vk::Format::R16G16B16A16_SFLOAT, |plan| plan)
}

pub(super) fn bgra() -> Result<Vec<u8>> {
    format(vk::Format::B8G8R8A8_UNORM, |plan| plan)
}

pub(super) fn srgb() -> Result<Vec<u8>> {
    format(vk::Format::R8G8B8A8_SRGB, |plan| plan)
}

fn format(format: vk::Format, change: impl FnOnce(Plan) -> Plan) -> Result<Vec<u8>> {
    drawn(&Gpu::plain()?, TargetPlan::format(format), change)
}
