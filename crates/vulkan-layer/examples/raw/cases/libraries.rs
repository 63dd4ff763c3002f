//! Pipelines that are put together of parts.

use ash::vk;
use vk::GraphicsPipelineLibraryFlagsEXT as Part;

use super::one_pass;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::Opening;
use crate::pipeline::{Plan, pipeline};
use crate::scene::shapes;
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
    let pipeline = linked(&gpu, &plan)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
    })
}

/// The plan's pipeline, linked of its four parts.
fn linked(gpu: &Gpu, plan: &Plan) -> Result<vk::Pipeline> {
    let parts = plan.describe(gpu, |whole| {
        let empty = vk::GraphicsPipelineCreateInfo::default();
        let stages = |at: usize| vk::GraphicsPipelineCreateInfo {
            stage_count: 1,
            // SAFETY: the plan has two stages.
            p_stages: unsafe { whole.p_stages.add(at) },
            layout: whole.layout,
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
