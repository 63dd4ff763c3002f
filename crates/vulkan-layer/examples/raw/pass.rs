//! Render passes of a target's plan.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::target::TargetPlan;

/// Which of the target's colours a subpass draws to, and which it reads.
#[derive(Clone, Default)]
pub(crate) struct Subpass {
    pub(crate) colours: Vec<u32>,
    pub(crate) inputs: Vec<u32>,
}

impl Subpass {
    pub(crate) fn to(colours: &[u32]) -> Self {
        Self { colours: colours.to_vec(), inputs: Vec::new() }
    }
}

/// The references of one subpass, for the create-info to point at.
struct References {
    colours: Vec<vk::AttachmentReference>,
    resolves: Vec<vk::AttachmentReference>,
    inputs: Vec<vk::AttachmentReference>,
    depth: Option<vk::AttachmentReference>,
    /// What a later subpass still needs.
    preserved: Vec<u32>,
}

impl TargetPlan {
    /// A render pass. All those of one plan suit its framebuffer.
    pub(crate) fn pass(&self, gpu: &Gpu, load: bool) -> Result<vk::RenderPass> {
        let attachments = self.attachments(load);
        let references: Vec<_> = self.subpasses.iter().map(|s| self.references(s)).collect();
        let subpasses: Vec<_> = references
            .iter()
            .map(|references| {
                let mut subpass = vk::SubpassDescription::default()
                    .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
                    .color_attachments(&references.colours)
                    .input_attachments(&references.inputs)
                    .preserve_attachments(&references.preserved);
                if self.resolves() {
                    subpass = subpass.resolve_attachments(&references.resolves);
                }
                if let Some(depth) = &references.depth {
                    subpass = subpass.depth_stencil_attachment(depth);
                }
                subpass
            })
            .collect();
        let dependencies = dependencies(subpasses.len() as u32);
        let masks = vec![(1 << self.layers) - 1; subpasses.len()];
        let mut views = vk::RenderPassMultiviewCreateInfo::default().view_masks(&masks);
        let mut info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses)
            .dependencies(&dependencies);
        if self.multiview {
            info = info.push_next(&mut views);
        }
        // SAFETY: what the structures point at lives until the end of the block.
        unsafe {
            let pass = gpu.device.create_render_pass(&info, None)?;
            gpu.at_end(move |d| d.destroy_render_pass(pass, None));
            Ok(pass)
        }
    }

    /// The same in the structures of VK_KHR_create_renderpass2; of one subpass.
    pub(crate) fn pass_2(
        &self,
        gpu: &Gpu,
        calls: &ash::khr::create_renderpass2::Device,
    ) -> Result<vk::RenderPass> {
        let attachments: Vec<_> = self
            .attachments(false)
            .iter()
            .map(|a| {
                vk::AttachmentDescription2::default()
                    .format(a.format)
                    .samples(a.samples)
                    .load_op(a.load_op)
                    .store_op(a.store_op)
                    .stencil_load_op(a.stencil_load_op)
                    .stencil_store_op(a.stencil_store_op)
                    .initial_layout(a.initial_layout)
                    .final_layout(a.final_layout)
            })
            .collect();
        let references = self.references(&self.subpasses[0]);
        let second = |aspects: vk::ImageAspectFlags| {
            move |r: &vk::AttachmentReference| {
                vk::AttachmentReference2::default()
                    .attachment(r.attachment)
                    .layout(r.layout)
                    .aspect_mask(aspects)
            }
        };
        let colour = second(vk::ImageAspectFlags::COLOR);
        let colours: Vec<_> = references.colours.iter().map(colour).collect();
        let depth = references.depth.iter().map(second(vk::ImageAspectFlags::DEPTH)).next();
        let mut subpass = vk::SubpassDescription2::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&colours);
        if let Some(depth) = &depth {
            subpass = subpass.depth_stencil_attachment(depth);
        }
        let dependencies: Vec<_> = dependencies(1)
            .iter()
            .map(|d| {
                vk::SubpassDependency2::default()
                    .src_subpass(d.src_subpass)
                    .dst_subpass(d.dst_subpass)
                    .src_stage_mask(d.src_stage_mask)
                    .dst_stage_mask(d.dst_stage_mask)
                    .src_access_mask(d.src_access_mask)
                    .dst_access_mask(d.dst_access_mask)
            })
            .collect();
        let info = vk::RenderPassCreateInfo2::default()
            .attachments(&attachments)
            .subpasses(std::slice::from_ref(&subpass))
            .dependencies(&dependencies);
        // SAFETY: what the structures point at lives until the end of the block.
        unsafe {
            let pass = calls.create_render_pass2(&info, None)?;
            gpu.at_end(move |d| d.destroy_render_pass(pass, None));
            Ok(pass)
        }
    }

    /// Colours, what they are resolved to, depth.
    fn attachments(&self, load: bool) -> Vec<vk::AttachmentDescription> {
        let attachment = |format, samples, op, fin| {
            let before =
                if op == vk::AttachmentLoadOp::LOAD { fin } else { vk::ImageLayout::UNDEFINED };
            vk::AttachmentDescription::default()
                .format(format)
                .samples(samples)
                .load_op(op)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(op)
                .stencil_store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(before)
                .final_layout(fin)
        };
        let op = if load { vk::AttachmentLoadOp::LOAD } else { vk::AttachmentLoadOp::CLEAR };
        let read = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let colour = |samples, op| move |&format| attachment(format, samples, op, read);
        let mut all: Vec<_> = self.colours.iter().map(colour(self.samples, op)).collect();
        if self.resolves() {
            let (one, any) = (vk::SampleCountFlags::TYPE_1, vk::AttachmentLoadOp::DONT_CARE);
            all.extend(self.colours.iter().map(colour(one, any)));
        }
        let depth = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        all.extend(self.depth.map(|format| attachment(format, self.samples, op, depth)));
        all
    }

    fn references(&self, subpass: &Subpass) -> References {
        let reference = |attachment: u32, layout| vk::AttachmentReference { attachment, layout };
        let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        let depth = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        let count = self.colours.len() as u32;
        let depth_at = if self.resolves() { 2 * count } else { count };
        let used = |c: &u32| subpass.colours.contains(c) || subpass.inputs.contains(c);
        References {
            colours: subpass.colours.iter().map(|&c| reference(c, drawn)).collect(),
            resolves: subpass.colours.iter().map(|&c| reference(c + count, drawn)).collect(),
            inputs: subpass.inputs.iter().map(|&c| reference(c, read)).collect(),
            depth: self.depth.map(|_| reference(depth_at, depth)),
            preserved: (0..count).filter(|c| !used(c)).collect(),
        }
    }
}

/// Each subpass waits for what was drawn before it, and what comes after for the last.
fn dependencies(subpasses: u32) -> Vec<vk::SubpassDependency> {
    let draws = vk::PipelineStageFlags::FRAGMENT_SHADER
        | vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
        | vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
        | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
    let writes =
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let reads = vk::AccessFlags::COLOR_ATTACHMENT_READ
        | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ
        | vk::AccessFlags::INPUT_ATTACHMENT_READ;
    let outside = draws | vk::PipelineStageFlags::TRANSFER;
    let between = |from, to| {
        vk::SubpassDependency::default()
            .src_subpass(from)
            .dst_subpass(to)
            .src_stage_mask(if from == vk::SUBPASS_EXTERNAL { outside } else { draws })
            .src_access_mask(writes)
            .dst_stage_mask(draws)
            .dst_access_mask(writes | reads)
    };
    let mut all = vec![between(vk::SUBPASS_EXTERNAL, 0)];
    all.extend((1..subpasses).map(|i| between(i - 1, i)));
    all.push(
        between(subpasses - 1, vk::SUBPASS_EXTERNAL)
            .dst_stage_mask(outside)
            .dst_access_mask(writes | reads | vk::AccessFlags::TRANSFER_READ),
    );
    all
}
