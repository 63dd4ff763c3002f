//! Dynamic rendering: no passes, no framebuffers.

use ash::khr::dynamic_rendering;
use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::{Host, Opening};
use crate::pipeline::{Plan, SHAPE, layout, pipeline};
use crate::record::{Recorder, read};
use crate::scene::shapes;
use crate::target::{Images, TargetPlan};

fn ask(opening: &mut Opening) -> Result<()> {
    opening.extension(ash::khr::create_renderpass2::NAME)?;
    opening.extension(ash::khr::depth_stencil_resolve::NAME)?;
    opening.extension(dynamic_rendering::NAME)?;
    opening.features::<vk::PhysicalDeviceDynamicRenderingFeatures<'_>>(&[(
        |f| &mut f.dynamic_rendering,
        "dynamicRendering",
    )])
}

/// With a depth buffer.
pub(super) fn dynamic() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let calls = dynamic_rendering::Device::new(&gpu.host.instance, &gpu.device);
    let target = Rendering::new(&gpu, TargetPlan::with_depth())?;
    let recorder = target.begin(&gpu)?;
    target.describe(vk::RenderingFlags::empty(), |info| {
        // SAFETY: what the structure points at lives until the call's end.
        unsafe { calls.cmd_begin_rendering(recorder.buffer, info) }
    });
    target.draw(&recorder);
    // SAFETY: rendering was begun.
    unsafe { calls.cmd_end_rendering(recorder.buffer) }
    target.finish(recorder)
}

/// By the names of Vulkan 1.3; four samples.
pub(super) fn dynamic_core() -> Result<Vec<u8>> {
    let gpu = Gpu::on(&Host::with(vk::API_VERSION_1_3, &[])?, |opening| {
        opening.features::<vk::PhysicalDeviceVulkan13Features<'_>>(&[(
            |f| &mut f.dynamic_rendering,
            "dynamicRendering",
        )])
    })?;
    let target = Rendering::new(&gpu, TargetPlan::multisampled())?;
    let recorder = target.begin(&gpu)?;
    target.describe(vk::RenderingFlags::empty(), |info| {
        // SAFETY: what the structure points at lives until the call's end.
        unsafe { gpu.device.cmd_begin_rendering(recorder.buffer, info) }
    });
    target.draw(&recorder);
    // SAFETY: rendering was begun.
    unsafe { gpu.device.cmd_end_rendering(recorder.buffer) }
    target.finish(recorder)
}

/// The draws are a secondary's.
pub(super) fn secondary() -> Result<Vec<u8>> {
    let gpu = Gpu::with(ask)?;
    let calls = dynamic_rendering::Device::new(&gpu.host.instance, &gpu.device);
    let target = Rendering::new(&gpu, TargetPlan::default())?;
    let mut formats = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&target.plan.colours)
        .rasterization_samples(target.plan.samples);
    let inherited = vk::CommandBufferInheritanceInfo::default().push_next(&mut formats);
    let flags = vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE
        | vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
    let info = vk::CommandBufferBeginInfo::default().flags(flags).inheritance_info(&inherited);
    let secondary = Recorder::begin(&gpu, vk::CommandBufferLevel::SECONDARY, &info)?;
    target.draw(&secondary);
    let secondary = secondary.end()?;

    let recorder = target.begin(&gpu)?;
    target.describe(vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS, |info| {
        // SAFETY: what the structure points at lives until the call's end.
        unsafe { calls.cmd_begin_rendering(recorder.buffer, info) }
    });
    recorder.execute(&[secondary]);
    // SAFETY: rendering was begun.
    unsafe { calls.cmd_end_rendering(recorder.buffer) }
    target.finish(recorder)
}

struct Rendering {
    plan: TargetPlan,
    images: Images,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
}

impl Rendering {
    fn new(gpu: &Gpu, plan: TargetPlan) -> Result<Self> {
        let images = Images::new(gpu, &plan)?;
        let layout = layout(gpu, &[], SHAPE)?;
        let mut draws = Plan::of(&plan, layout, vk::RenderPass::null());
        let mut formats =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&plan.colours);
        if let Some(depth) = plan.depth {
            formats = formats.depth_attachment_format(depth);
            draws = draws.depth(vk::CompareOp::LESS, true);
        }
        let pipeline = draws.describe(gpu, |info| pipeline(gpu, &info.push_next(&mut formats)))?;
        Ok(Self { plan, images, layout, pipeline })
    }

    /// A command buffer that has made the images ready to be drawn to.
    fn begin<'a>(&self, gpu: &'a Gpu) -> Result<Recorder<'a>> {
        let recorder = Recorder::once(gpu)?;
        let before = vk::ImageLayout::UNDEFINED;
        for image in self.images.colours.iter().chain(&self.images.resolves) {
            recorder.relayout(image, before, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        }
        if let Some(image) = &self.images.depth {
            recorder.relayout(image, before, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
        }
        Ok(recorder)
    }

    fn draw(&self, recorder: &Recorder<'_>) {
        recorder.bind(self.pipeline);
        recorder.shapes(self.layout, &shapes());
    }

    fn describe(&self, flags: vk::RenderingFlags, begin: impl FnOnce(&vk::RenderingInfo<'_>)) {
        let clears = self.plan.clears();
        let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let attachment = |view, layout, clear| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(clear)
        };
        let mut colour = attachment(self.images.colours[0].view, drawn, clears[0]);
        if let Some(resolved) = self.images.resolves.first() {
            colour = colour
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(resolved.view)
                .resolve_image_layout(drawn);
        }
        let depth = self.images.depth.as_ref().zip(clears.last()).map(|(image, &clear)| {
            attachment(image.view, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, clear)
        });
        let mut info = vk::RenderingInfo::default()
            .flags(flags)
            .render_area(self.plan.extent.into())
            .layer_count(1)
            .color_attachments(std::slice::from_ref(&colour));
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        begin(&info);
    }

    fn finish(&self, recorder: Recorder<'_>) -> Result<Vec<u8>> {
        let gpu = recorder.gpu;
        let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        for image in self.images.finished() {
            recorder.relayout(image, drawn, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        }
        recorder.run()?;
        read(gpu, self.images.finished())
    }
}
