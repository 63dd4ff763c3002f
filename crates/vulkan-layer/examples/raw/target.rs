//! What is drawn into: images, and a render pass and framebuffer of them.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;
use crate::memory::{Image, ImagePlan, aspects};
use crate::pass::Subpass;

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
    pub(crate) subpasses: Vec<Subpass>,
    /// Several samples are left for a command to resolve.
    pub(crate) unresolved: bool,
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
            subpasses: vec![Subpass::to(&[0])],
            unresolved: false,
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

    /// Two colours, both drawn to by each draw.
    pub(crate) fn two() -> Self {
        Self {
            colours: vec![vk::Format::R8G8B8A8_UNORM; 2],
            subpasses: vec![Subpass::to(&[0, 1])],
            ..Self::default()
        }
    }

    /// Whether the pass resolves several samples.
    pub(crate) fn resolves(&self) -> bool {
        self.samples != vk::SampleCountFlags::TYPE_1 && !self.unresolved
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
            let mut usage = if aspects(format) == vk::ImageAspectFlags::COLOR {
                vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC
            } else {
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
            };
            if plan.subpasses.iter().any(|s| !s.inputs.is_empty()) {
                usage |= vk::ImageUsageFlags::INPUT_ATTACHMENT;
            }
            let (extent, layers) = (plan.extent, plan.layers);
            Image::new(gpu, ImagePlan { format, extent, layers, samples, usage })
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
        Self::of(gpu, plan, images)
    }

    pub(crate) fn of(gpu: &Gpu, plan: TargetPlan, images: Images) -> Result<Self> {
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
