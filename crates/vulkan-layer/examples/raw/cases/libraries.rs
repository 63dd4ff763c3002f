//! Pipelines that are put together of parts.

use ash::vk;
use vk::GraphicsPipelineLibraryFlagsEXT as Part;

use super::descriptors::{PARTS, bind, tints};
use super::one_pass;
use crate::failure::{Failure, Result};
use crate::gpu::Gpu;
use crate::host::Opening;
use crate::pipeline::{Plan, SHAPE, STAGES, pipeline};
use crate::scene::shapes;
use crate::shader;
use crate::target::{Target, TargetPlan};

fn ask(opening: &mut Opening) -> Result<()> {
    opening.extension(ash::khr::pipeline_library::NAME)?;
    opening.extension(ash::ext::graphics_pipeline_library::NAME)?;
    opening.features::<vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT<'_>>(&[(
        |f| &mut f.graphics_pipeline_library,
        "graphicsPipelineLibrary",
    )])
}

pub(super) fn libraries() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = linked(&gpu, &plan, [plan.layout; 2])?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
    })
}

/// The parts of vertices and of fragments each have a layout with the sets that they need.
pub(super) fn libraries_apart() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let tints = tints(&gpu, &PARTS, vk::DescriptorType::UNIFORM_BUFFER)?;
    let layout = |n: usize| {
        let ranges = [vk::PushConstantRange { stage_flags: STAGES, offset: 0, size: SHAPE }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .flags(vk::PipelineLayoutCreateFlags::INDEPENDENT_SETS_EXT)
            .set_layouts(&tints.layouts[..n])
            .push_constant_ranges(&ranges);
        // SAFETY: what the structure points at lives until the end of the block.
        unsafe {
            let layout = gpu.device.create_pipeline_layout(&info, None)?;
            gpu.at_end(move |d| d.destroy_pipeline_layout(layout, None));
            Ok(layout)
        }
    };
    let layouts: Result<Vec<_>> = [2, 1, 2].into_iter().map(layout).collect();
    let [whole, vertices, fragments] = layouts?[..] else {
        return Err(Failure::unsupported("three layouts"));
    };
    let plan = Plan { layout: whole, ..Plan::new(&gpu, &target)? }.fragment(shader::TWO_SETS);
    let pipeline = linked(&gpu, &plan, [vertices, fragments])?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        bind(recorder, whole, 0, &tints.sets[..2], &[]);
        recorder.shapes(whole, &shapes());
    })
}

/// The plan's pipeline, linked of its four parts, with the layouts of vertices and of fragments.
fn linked(gpu: &Gpu, plan: &Plan, layouts: [vk::PipelineLayout; 2]) -> Result<vk::Pipeline> {
    let parts = plan.describe(gpu, |whole| {
        let empty = vk::GraphicsPipelineCreateInfo::default();
        let stages = |at: usize| vk::GraphicsPipelineCreateInfo {
            stage_count: 1,
            // SAFETY: the plan has two stages.
            p_stages: unsafe { whole.p_stages.add(at) },
            layout: layouts[at],
            ..empty
        };
        let input = vk::GraphicsPipelineCreateInfo {
            p_vertex_input_state: whole.p_vertex_input_state,
            p_input_assembly_state: whole.p_input_assembly_state,
            ..empty
        };
        let before = vk::GraphicsPipelineCreateInfo {
            p_viewport_state: whole.p_viewport_state,
            p_rasterization_state: whole.p_rasterization_state,
            ..stages(0)
        };
        let fragments = vk::GraphicsPipelineCreateInfo {
            p_multisample_state: whole.p_multisample_state,
            p_depth_stencil_state: whole.p_depth_stencil_state,
            ..stages(1)
        };
        let output = vk::GraphicsPipelineCreateInfo {
            p_multisample_state: whole.p_multisample_state,
            p_color_blend_state: whole.p_color_blend_state,
            ..empty
        };
        let library = |part, info: vk::GraphicsPipelineCreateInfo<'_>| {
            let mut kind = vk::GraphicsPipelineLibraryCreateInfoEXT::default().flags(part);
            let info = info
                .flags(vk::PipelineCreateFlags::LIBRARY_KHR)
                .render_pass(whole.render_pass)
                .push_next(&mut kind);
            pipeline(gpu, &info)
        };
        Ok([
            library(Part::VERTEX_INPUT_INTERFACE, input)?,
            library(Part::PRE_RASTERIZATION_SHADERS, before)?,
            library(Part::FRAGMENT_SHADER, fragments)?,
            library(Part::FRAGMENT_OUTPUT_INTERFACE, output)?,
        ])
    })?;
    let mut linked = vk::PipelineLibraryCreateInfoKHR::default().libraries(&parts);
    let info = vk::GraphicsPipelineCreateInfo::default().layout(plan.layout).push_next(&mut linked);
    pipeline(gpu, &info)
}

/// Shaders in the stages' own structures, with no modules.
pub(super) fn module_in_pnext() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let words: Vec<_> = plan.stages.iter().map(|shader| shader.words()).collect();
    let mut codes: Vec<_> =
        words.iter().map(|words| vk::ShaderModuleCreateInfo::default().code(words)).collect();
    let stages: Vec<_> = codes
        .iter_mut()
        .zip(&plan.stages)
        .map(|(code, shader)| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(shader.kind)
                .name(c"main")
                .push_next(code)
        })
        .collect();
    let pipeline = plan.describe_with(&stages, |info| pipeline(&gpu, info))?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
    })
}
