//! What is drawn into: images, and a render pass and framebuffer of them.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::memory::{Image, ImagePlan, aspects};

pub(crate) const EXTENT: vk::Extent2D = vk::Extent2D { width: 200, height: 150 };

/// What each target is cleared to.
pub(crate) const BACKGROUND: [f32; 4] = [0.1, 0.15, 0.2, 1.0];

/// What a target is to be.
#[derive(Clone)]
pub(crate) struct TargetPlan {
    pub(crate) colours: Vec<vk::Format>,
    pub(crate) depth: Option<vk::Format>,
    pub(crate) clear_depth: f32,
    pub(crate) samples: vk::SampleCountFlags,
    pub(crate) extent: vk::Extent2D,
    pub(crate) layers: u32,
    /// Draw to each layer at once.
    pub(crate) multiview: bool,
    /// Make the framebuffer without its images.
    pub(crate) imageless: bool,
    /// Which colours each subpass draws to.
    pub(crate) subpasses: Vec<Vec<u32>>,
}

impl Default for TargetPlan {
    fn default() -> Self {
        Self {
            colours: vec![vk::Format::R8G8B8A8_UNORM],
            depth: None,
            clear_depth: 1.0,
            samples: vk::SampleCountFlags::TYPE_1,
            extent: EXTENT,
            layers: 1,
            multiview: false,
            imageless: false,
            subpasses: vec![vec![0]],
        }
    }
}

impl TargetPlan {
    pub(crate) fn with_depth() -> Self {
        Self { depth: Some(vk::Format::D32_SFLOAT), ..Self::default() }
    }

    pub(crate) fn multisampled() -> Self {
        Self { samples: vk::SampleCountFlags::TYPE_4, ..Self::default() }
    }

    pub(crate) fn format(format: vk::Format) -> Self {
        Self { colours: vec![format], ..Self::default() }
    }

    fn resolves(&self) -> bool {
        self.samples != vk::SampleCountFlags::TYPE_1
    }

    /// In the order of the attachments: colours, what they are resolved to, depth.
    pub(crate) fn clears(&self) -> Vec<vk::ClearValue> {
        let colour = |&format: &vk::Format| match format {
            vk::Format::R8G8B8A8_UINT => vk::ClearColorValue { uint32: [20, 30, 40, 255] },
            _ => vk::ClearColorValue { float32: BACKGROUND },
        };
        let colours = self.colours.iter().map(colour);
        let depth_stencil = vk::ClearDepthStencilValue { depth: self.clear_depth, stencil: 0 };
        let mut clears: Vec<_> = colours.map(|color| vk::ClearValue { color }).collect();
        if self.resolves() {
            clears.extend_from_within(..);
        }
        clears.extend(self.depth.map(|_| vk::ClearValue { depth_stencil }));
        clears
    }

    /// All render passes that are made of a plan suit its framebuffer.
    pub(crate) fn pass(&self, gpu: &Gpu, load: bool) -> Result<vk::RenderPass> {
        let attachments = self.attachments(load);
        let count = self.colours.len();
        let depth = vk::AttachmentReference {
            attachment: attachments.len() as u32 - 1,
            layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
        };
        let reference = |attachment| vk::AttachmentReference {
            attachment,
            layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        };
        let colours: Vec<Vec<_>> =
            self.subpasses.iter().map(|s| s.iter().map(|&c| reference(c)).collect()).collect();
        let resolves: Vec<Vec<_>> = self
            .subpasses
            .iter()
            .map(|s| s.iter().map(|&c| reference(c + count as u32)).collect())
            .collect();
        let subpasses: Vec<_> = colours
            .iter()
            .zip(&resolves)
            .map(|(colours, resolves)| {
                let mut subpass = vk::SubpassDescription::default().color_attachments(colours);
                if self.resolves() {
                    subpass = subpass.resolve_attachments(resolves);
                }
                if self.depth.is_some() {
                    subpass = subpass.depth_stencil_attachment(&depth);
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

    fn attachments(&self, load: bool) -> Vec<vk::AttachmentDescription> {
        let attachment = |format, samples, fin| {
            let (load, before) = if load {
                (vk::AttachmentLoadOp::LOAD, fin)
            } else {
                (vk::AttachmentLoadOp::CLEAR, vk::ImageLayout::UNDEFINED)
            };
            vk::AttachmentDescription::default()
                .format(format)
                .samples(samples)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(load)
                .stencil_store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(before)
                .final_layout(fin)
        };
        let read = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let mut all: Vec<_> =
            self.colours.iter().map(|&format| attachment(format, self.samples, read)).collect();
        if self.resolves() {
            let one = vk::SampleCountFlags::TYPE_1;
            all.extend(self.colours.iter().map(|&format| attachment(format, one, read)));
        }
        let depth = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        all.extend(self.depth.map(|format| attachment(format, self.samples, depth)));
        all
    }
}

/// Each subpass waits for what was drawn before it, and what comes after for the last.
fn dependencies(subpasses: u32) -> Vec<vk::SubpassDependency> {
    let draws = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
        | vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
        | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
    let writes =
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let reads =
        vk::AccessFlags::COLOR_ATTACHMENT_READ | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ;
    let before = |i: u32| if i == 0 { vk::SUBPASS_EXTERNAL } else { i - 1 };
    let mut all: Vec<_> = (0..subpasses)
        .map(|i| {
            vk::SubpassDependency::default()
                .src_subpass(before(i))
                .dst_subpass(i)
                .src_stage_mask(draws | vk::PipelineStageFlags::TRANSFER)
                .src_access_mask(writes)
                .dst_stage_mask(draws)
                .dst_access_mask(writes | reads)
        })
        .collect();
    all.push(
        vk::SubpassDependency::default()
            .src_subpass(subpasses - 1)
            .dst_subpass(vk::SUBPASS_EXTERNAL)
            .src_stage_mask(draws)
            .src_access_mask(writes)
            .dst_stage_mask(draws | vk::PipelineStageFlags::TRANSFER)
            .dst_access_mask(writes | reads | vk::AccessFlags::TRANSFER_READ),
    );
    all
}

/// The images of a plan.
pub(crate) struct Images {
    pub(crate) colours: Vec<Image>,
    /// What is resolved to, of several samples.
    pub(crate) resolves: Vec<Image>,
    pub(crate) depth: Option<Image>,
}

impl Images {
    pub(crate) fn new(gpu: &Gpu, plan: &TargetPlan) -> Result<Self> {
        let image = |format, samples| {
            let drawn = if aspects(format) == vk::ImageAspectFlags::COLOR {
                vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC
            } else {
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
            };
            let (extent, layers) = (plan.extent, plan.layers);
            Image::new(gpu, ImagePlan { format, extent, layers, samples, usage: drawn })
        };
        let of = |samples| plan.colours.iter().map(|&f| image(f, samples)).collect::<Result<_>>();
        Ok(Self {
            colours: of(plan.samples)?,
            resolves: if plan.resolves() { of(vk::SampleCountFlags::TYPE_1)? } else { Vec::new() },
            depth: plan.depth.map(|format| image(format, plan.samples)).transpose()?,
        })
    }

    /// Those that hold the picture.
    pub(crate) fn finished(&self) -> &[Image] {
        if self.resolves.is_empty() { &self.colours } else { &self.resolves }
    }

    pub(crate) fn views(&self) -> Vec<vk::ImageView> {
        self.colours.iter().chain(&self.resolves).chain(&self.depth).map(|i| i.view).collect()
    }
}

pub(crate) struct Target {
    pub(crate) plan: TargetPlan,
    pub(crate) images: Images,
    pub(crate) pass: vk::RenderPass,
    pub(crate) framebuffer: vk::Framebuffer,
}

impl Target {
    pub(crate) fn new(gpu: &Gpu, plan: TargetPlan) -> Result<Self> {
        let images = Images::new(gpu, &plan)?;
        let pass = plan.pass(gpu, false)?;
        let framebuffer = framebuffer(gpu, &plan, pass, &images.views())?;
        Ok(Self { plan, images, pass, framebuffer })
    }
}

pub(crate) fn framebuffer(
    gpu: &Gpu,
    plan: &TargetPlan,
    pass: vk::RenderPass,
    views: &[vk::ImageView],
) -> Result<vk::Framebuffer> {
    let info = vk::FramebufferCreateInfo::default()
        .render_pass(pass)
        .width(plan.extent.width)
        .height(plan.extent.height)
        .layers(if plan.multiview { 1 } else { plan.layers });
    // What an imageless framebuffer is told in place of its images.
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let formats: Vec<_> = plan.colours.iter().map(std::slice::from_ref).collect();
    let described: Vec<_> = formats
        .iter()
        .map(|format| {
            vk::FramebufferAttachmentImageInfo::default()
                .usage(usage)
                .width(plan.extent.width)
                .height(plan.extent.height)
                .layer_count(plan.layers)
                .view_formats(format)
        })
        .collect();
    let mut imageless =
        vk::FramebufferAttachmentsCreateInfo::default().attachment_image_infos(&described);
    let info = if plan.imageless {
        vk::FramebufferCreateInfo {
            flags: vk::FramebufferCreateFlags::IMAGELESS,
            attachment_count: described.len() as u32,
            ..info.push_next(&mut imageless)
        }
    } else {
        info.attachments(views)
    };
    // SAFETY: what the structures point at lives until the end of the block.
    unsafe {
        let framebuffer = gpu.device.create_framebuffer(&info, None)?;
        gpu.at_end(move |d| d.destroy_framebuffer(framebuffer, None));
        Ok(framebuffer)
    }
}
