//! Graphics pipelines: a plan with a usual value for each state, and what is made of it.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::shader::{self, Shader};
use crate::target::{Target, TargetPlan};

/// Blending: source alpha over what is there.
pub(crate) const OVER: vk::PipelineColorBlendAttachmentState =
    blend(vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);

pub(crate) const OPAQUE: vk::PipelineColorBlendAttachmentState =
    vk::PipelineColorBlendAttachmentState {
        blend_enable: vk::FALSE,
        ..blend(vk::BlendFactor::ONE, vk::BlendFactor::ZERO)
    };

pub(crate) const fn blend(
    source: vk::BlendFactor,
    destination: vk::BlendFactor,
) -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState {
        blend_enable: vk::TRUE,
        src_color_blend_factor: source,
        dst_color_blend_factor: destination,
        color_blend_op: vk::BlendOp::ADD,
        src_alpha_blend_factor: vk::BlendFactor::ONE,
        dst_alpha_blend_factor: vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
        alpha_blend_op: vk::BlendOp::ADD,
        color_write_mask: vk::ColorComponentFlags::RGBA,
    }
}

/// Push constants that a layout has; the others have the 32 bytes of a shape.
pub(crate) const SHAPE: u32 = 32;

pub(crate) const STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

pub(crate) fn layout(
    gpu: &Gpu,
    sets: &[vk::DescriptorSetLayout],
    push: u32,
) -> Result<vk::PipelineLayout> {
    let ranges = [vk::PushConstantRange { stage_flags: STAGES, offset: 0, size: push }];
    let info =
        vk::PipelineLayoutCreateInfo::default().set_layouts(sets).push_constant_ranges(&ranges);
    // SAFETY: what the structure points at lives until the end of the block.
    unsafe {
        let layout = gpu.device.create_pipeline_layout(&info, None)?;
        gpu.at_end(move |d| d.destroy_pipeline_layout(layout, None));
        Ok(layout)
    }
}

/// All of a pipeline's state.
#[derive(Clone)]
pub(crate) struct Plan {
    pub(crate) stages: Vec<Shader>,
    pub(crate) layout: vk::PipelineLayout,
    /// None where the pipeline is used with dynamic rendering.
    pub(crate) pass: vk::RenderPass,
    pub(crate) subpass: u32,
    pub(crate) extent: vk::Extent2D,
    pub(crate) topology: vk::PrimitiveTopology,
    pub(crate) samples: vk::SampleCountFlags,
    pub(crate) sample_shading: bool,
    pub(crate) alpha_to_coverage: bool,
    pub(crate) depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    pub(crate) blends: Vec<vk::PipelineColorBlendAttachmentState>,
    pub(crate) logic: Option<vk::LogicOp>,
    pub(crate) constants: [f32; 4],
    pub(crate) dynamic: Vec<vk::DynamicState>,
    pub(crate) bindings: Vec<vk::VertexInputBindingDescription>,
    pub(crate) attributes: Vec<vk::VertexInputAttributeDescription>,
}

impl Plan {
    /// Blended shapes, without a depth test.
    pub(crate) fn new(gpu: &Gpu, target: &Target) -> Result<Self> {
        let layout = layout(gpu, &[], SHAPE)?;
        Ok(Self::of(&target.plan, layout, target.pass))
    }

    pub(crate) fn of(plan: &TargetPlan, layout: vk::PipelineLayout, pass: vk::RenderPass) -> Self {
        Self {
            stages: vec![shader::SHAPE, shader::COLOUR],
            layout,
            pass,
            subpass: 0,
            extent: plan.extent,
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            samples: plan.samples,
            sample_shading: false,
            alpha_to_coverage: false,
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            blends: vec![OVER; plan.subpasses[0].colours.len()],
            logic: None,
            constants: [0.0; 4],
            dynamic: Vec::new(),
            bindings: Vec::new(),
            attributes: Vec::new(),
        }
    }

    pub(crate) fn vertex(mut self, shader: Shader) -> Self {
        self.stages[0] = shader;
        self
    }

    pub(crate) fn fragment(mut self, shader: Shader) -> Self {
        self.stages[1] = shader;
        self
    }

    pub(crate) fn blend(mut self, blend: vk::PipelineColorBlendAttachmentState) -> Self {
        self.blends.fill(blend);
        self
    }

    /// With a depth test.
    pub(crate) fn depth(mut self, compare: vk::CompareOp, write: bool) -> Self {
        self.depth_stencil = self
            .depth_stencil
            .depth_test_enable(true)
            .depth_compare_op(compare)
            .depth_write_enable(write);
        self
    }

    /// With a stencil test of both faces.
    pub(crate) fn stencil(mut self, state: vk::StencilOpState) -> Self {
        self.depth_stencil = self.depth_stencil.stencil_test_enable(true).front(state).back(state);
        self
    }

    /// The pipeline. Its modules are gone afterwards, as in most programs.
    pub(crate) fn create(&self, gpu: &Gpu) -> Result<vk::Pipeline> {
        self.describe(gpu, |info| pipeline(gpu, info))
    }

    /// Calls `make` with the plan as Vulkan has it.
    pub(crate) fn describe<R>(
        &self,
        gpu: &Gpu,
        make: impl FnOnce(&vk::GraphicsPipelineCreateInfo<'_>) -> Result<R>,
    ) -> Result<R> {
        let mark = gpu.mark();
        let stages: Vec<_> = self.stages.iter().map(|s| s.stage(gpu)).collect::<Result<_>>()?;
        let modules = gpu.take_since(mark);
        let made = self.describe_with(&stages, make);
        modules.into_iter().for_each(|end| end(&gpu.device));
        made
    }

    pub(crate) fn describe_with<R>(
        &self,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
        make: impl FnOnce(&vk::GraphicsPipelineCreateInfo<'_>) -> Result<R>,
    ) -> Result<R> {
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&self.bindings)
            .vertex_attribute_descriptions(&self.attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(self.topology);
        let patches = vk::PipelineTessellationStateCreateInfo::default().patch_control_points(3);
        let areas = [self.extent.into()];
        let viewports = [vk::Viewport::default()
            .width(self.extent.width as f32)
            .height(self.extent.height as f32)
            .max_depth(1.0)];
        let viewport =
            vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&areas);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(self.samples)
            .sample_shading_enable(self.sample_shading)
            .min_sample_shading(1.0)
            .alpha_to_coverage_enable(self.alpha_to_coverage);
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .attachments(&self.blends)
            .logic_op_enable(self.logic.is_some())
            .logic_op(self.logic.unwrap_or_default())
            .blend_constants(self.constants);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&self.dynamic);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .tessellation_state(&patches)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&self.depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .render_pass(self.pass)
            .subpass(self.subpass);
        make(&info)
    }
}

pub(crate) fn pipeline(
    gpu: &Gpu,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Result<vk::Pipeline> {
    let info = std::slice::from_ref(info);
    // SAFETY: what the structure points at lives as long as it.
    unsafe {
        let made = gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), info, None);
        let pipeline = made.map_err(|(_, result)| result)?[0];
        gpu.at_end(move |d| d.destroy_pipeline(pipeline, None));
        Ok(pipeline)
    }
}
