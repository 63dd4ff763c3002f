//! Recording of command buffers.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::memory::{Buffer, Image, aspects};
use crate::pipeline::STAGES;
use crate::scene::Shape;
use crate::target::Target;

pub(crate) struct Recorder<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) buffer: vk::CommandBuffer,
}

impl<'a> Recorder<'a> {
    /// A primary command buffer, begun.
    pub(crate) fn new(gpu: &'a Gpu, flags: vk::CommandBufferUsageFlags) -> Result<Self> {
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        Self::begin(gpu, vk::CommandBufferLevel::PRIMARY, &info)
    }

    /// A primary that is submitted once.
    pub(crate) fn once(gpu: &'a Gpu) -> Result<Self> {
        Self::new(gpu, vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT)
    }

    /// A secondary for a target's subpass 0.
    pub(crate) fn secondary(
        gpu: &'a Gpu,
        target: &Target,
        flags: vk::CommandBufferUsageFlags,
    ) -> Result<Self> {
        let inherited = vk::CommandBufferInheritanceInfo::default()
            .render_pass(target.pass)
            .framebuffer(target.framebuffer);
        let info = vk::CommandBufferBeginInfo::default()
            .flags(flags | vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(&inherited);
        Self::begin(gpu, vk::CommandBufferLevel::SECONDARY, &info)
    }

    pub(crate) fn begin(
        gpu: &'a Gpu,
        level: vk::CommandBufferLevel,
        info: &vk::CommandBufferBeginInfo<'_>,
    ) -> Result<Self> {
        let allocation = vk::CommandBufferAllocateInfo::default()
            .command_pool(gpu.pool)
            .level(level)
            .command_buffer_count(1);
        // SAFETY: the pool is the device's; what `info` points at lives as long as it.
        unsafe {
            let buffer = gpu.device.allocate_command_buffers(&allocation)?[0];
            gpu.device.begin_command_buffer(buffer, info)?;
            Ok(Self { gpu, buffer })
        }
    }

    pub(crate) fn pass(&self, target: &Target) {
        self.pass_of(target, target.pass, vk::SubpassContents::INLINE);
    }

    /// Begins a pass that suits the target's framebuffer.
    pub(crate) fn pass_of(
        &self,
        target: &Target,
        pass: vk::RenderPass,
        contents: vk::SubpassContents,
    ) {
        let clears = target.plan.clears();
        let views = target.images.views();
        let mut images = vk::RenderPassAttachmentBeginInfo::default().attachments(&views);
        let mut info = vk::RenderPassBeginInfo::default()
            .render_pass(pass)
            .framebuffer(target.framebuffer)
            .render_area(target.plan.extent.into())
            .clear_values(&clears);
        if target.plan.imageless {
            info = info.push_next(&mut images);
        }
        // SAFETY: what the structure points at lives until the call's end.
        unsafe { self.gpu.device.cmd_begin_render_pass(self.buffer, &info, contents) }
    }

    pub(crate) fn next_subpass(&self) {
        let contents = vk::SubpassContents::INLINE;
        // SAFETY: a pass with another subpass was begun.
        unsafe { self.gpu.device.cmd_next_subpass(self.buffer, contents) }
    }

    pub(crate) fn end_pass(&self) {
        // SAFETY: a pass was begun.
        unsafe { self.gpu.device.cmd_end_render_pass(self.buffer) }
    }

    pub(crate) fn bind(&self, pipeline: vk::Pipeline) {
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the pipeline is the device's.
        unsafe { self.gpu.device.cmd_bind_pipeline(self.buffer, point, pipeline) }
    }

    pub(crate) fn push(&self, layout: vk::PipelineLayout, values: &[f32]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
        // SAFETY: the layout has as many bytes of push constants.
        unsafe { self.gpu.device.cmd_push_constants(self.buffer, layout, STAGES, 0, &bytes) }
    }

    pub(crate) fn draw(&self, vertices: u32, instances: u32) {
        // SAFETY: a pipeline is bound in a pass.
        unsafe { self.gpu.device.cmd_draw(self.buffer, vertices, instances, 0, 0) }
    }

    /// A shape by itself, with its push constants.
    pub(crate) fn shape(&self, layout: vk::PipelineLayout, shape: &Shape) {
        self.push(layout, &shape.constants());
        self.draw(shape.vertices, shape.instances);
    }

    pub(crate) fn shapes(&self, layout: vk::PipelineLayout, shapes: &[Shape]) {
        shapes.iter().for_each(|shape| self.shape(layout, shape));
    }

    pub(crate) fn execute(&self, secondaries: &[vk::CommandBuffer]) {
        // SAFETY: the secondaries are recorded for the pass that was begun.
        unsafe { self.gpu.device.cmd_execute_commands(self.buffer, secondaries) }
    }

    /// Makes what was written before visible to all that follows.
    pub(crate) fn barrier(&self, images: &[vk::ImageMemoryBarrier<'_>]) {
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let flags = vk::DependencyFlags::empty();
        // SAFETY: the images are the device's, in the layouts that are said.
        unsafe {
            self.gpu.device.cmd_pipeline_barrier(
                self.buffer,
                all,
                all,
                flags,
                &memory,
                &[],
                images,
            );
        }
    }

    /// Puts an image into another layout.
    pub(crate) fn relayout(&self, image: &Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        let barrier = vk::ImageMemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.handle)
            .subresource_range(image.range());
        self.barrier(&[barrier]);
    }

    /// All layers of an image that a pass has left for reading.
    pub(crate) fn copy(&self, image: &Image, to: &Buffer) {
        let vk::Extent2D { width, height } = image.extent;
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(aspects(image.format))
            .layer_count(image.layers);
        let region = vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(vk::Extent3D { width, height, depth: 1 });
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: the buffer is as large as the image.
        unsafe {
            self.gpu.device.cmd_copy_image_to_buffer(
                self.buffer,
                image.handle,
                layout,
                to.handle,
                &[region],
            );
        }
    }

    pub(crate) fn end(self) -> Result<vk::CommandBuffer> {
        // SAFETY: recording was begun.
        unsafe { self.gpu.device.end_command_buffer(self.buffer) }?;
        Ok(self.buffer)
    }

    /// Ends, submits, waits.
    pub(crate) fn run(self) -> Result<()> {
        let gpu = self.gpu;
        gpu.run(&[self.end()?])
    }
}

/// The bytes of images that a pass has left for reading, one after the other.
pub(crate) fn read(gpu: &Gpu, images: &[Image]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    for image in images {
        let texel = if image.format == vk::Format::R16G16B16A16_SFLOAT { 8 } else { 4 };
        let vk::Extent2D { width, height } = image.extent;
        let size = u64::from(width * height * image.layers) * texel;
        let buffer = Buffer::new(gpu, size, vk::BufferUsageFlags::TRANSFER_DST)?;
        let recorder = Recorder::once(gpu)?;
        recorder.barrier(&[]);
        recorder.copy(image, &buffer);
        recorder.barrier(&[]);
        recorder.run()?;
        bytes.extend(buffer.read(gpu)?);
    }
    Ok(bytes)
}
