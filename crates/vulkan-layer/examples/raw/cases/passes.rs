//! Render passes and what is not drawn in them.

use ash::vk;

use super::{drawn, halves, one_pass, recorded};
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::memory::{Image, ImagePlan};
use crate::pass::Subpass;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::shapes;
use crate::target::{EXTENT, Images, Target, TargetPlan};

pub(super) fn load() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let (target, first, then) = halves(&gpu)?;
    gpu.run(&[first])?;
    gpu.run(&[then])?;
    read(&gpu, target.images.finished())
}

pub(super) fn imageless() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.extension(ash::khr::image_format_list::NAME)?;
        opening.extension(ash::khr::imageless_framebuffer::NAME)?;
        opening.features::<vk::PhysicalDeviceImagelessFramebufferFeatures<'_>>(&[(
            |f| &mut f.imageless_framebuffer,
            "imagelessFramebuffer",
        )])
    })?;
    drawn(&gpu, TargetPlan { imageless: true, ..TargetPlan::default() }, |plan| plan)
}

/// The second structures and commands for passes.
pub(super) fn pass_2() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.extension(ash::khr::create_renderpass2::NAME))?;
    let calls = ash::khr::create_renderpass2::Device::new(&gpu.host.instance, &gpu.device);
    let mut target = Target::new(&gpu, TargetPlan::with_depth())?;
    target.pass = target.plan.pass_2(&gpu, &calls)?;
    let plan = Plan::new(&gpu, &target)?.depth(vk::CompareOp::LESS, true);
    let pipeline = plan.create(&gpu)?;
    let recorder = Recorder::once(&gpu)?;
    let clears = target.plan.clears();
    let info = vk::RenderPassBeginInfo::default()
        .render_pass(target.pass)
        .framebuffer(target.framebuffer)
        .render_area(EXTENT.into())
        .clear_values(&clears);
    let contents = vk::SubpassBeginInfo::default().contents(vk::SubpassContents::INLINE);
    // SAFETY: what the structures point at lives until the calls' end.
    unsafe {
        calls.cmd_begin_render_pass2(recorder.buffer, &info, &contents);
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
        calls.cmd_end_render_pass2(recorder.buffer, &vk::SubpassEndInfo::default());
    }
    recorder.run()?;
    read(&gpu, target.images.finished())
}

/// Both subpasses draw to the same colour.
pub(super) fn subpasses() -> Result<Vec<u8>> {
    let subpasses = vec![Subpass::to(&[0]); 2];
    in_subpasses(TargetPlan { subpasses, ..TargetPlan::default() })
}

/// Each draws to one of its own.
pub(super) fn subpasses_apart() -> Result<Vec<u8>> {
    let subpasses = vec![Subpass::to(&[0]), Subpass::to(&[1])];
    in_subpasses(TargetPlan { subpasses, ..TargetPlan::two() })
}

fn in_subpasses(target: TargetPlan) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, target)?;
    let plan = Plan::new(&gpu, &target)?;
    let first = plan.create(&gpu)?;
    let then = Plan { subpass: 1, ..plan.clone() }.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(first);
        recorder.shapes(plan.layout, &shapes()[..4]);
        recorder.next_subpass();
        recorder.bind(then);
        recorder.shapes(plan.layout, &shapes()[4..]);
    })
}

pub(super) fn clear_attachments() -> Result<Vec<u8>> {
    cleared(EXTENT.into())
}

pub(super) fn clear_part() -> Result<Vec<u8>> {
    cleared(vk::Rect2D {
        offset: vk::Offset2D { x: 50, y: 40 },
        extent: vk::Extent2D { width: 90, height: 60 },
    })
}

/// Colour and depth of an area are cleared between draws.
fn cleared(rect: vk::Rect2D) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::with_depth())?;
    let plan = Plan::new(&gpu, &target)?.depth(vk::CompareOp::LESS, true);
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes()[..4]);
        let color = vk::ClearColorValue { float32: [0.4, 0.3, 0.2, 1.0] };
        let depth_stencil = vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 };
        let clears = [
            vk::ClearAttachment::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .clear_value(vk::ClearValue { color }),
            vk::ClearAttachment::default()
                .aspect_mask(vk::ImageAspectFlags::DEPTH)
                .clear_value(vk::ClearValue { depth_stencil }),
        ];
        let rects = [vk::ClearRect { rect, base_array_layer: 0, layer_count: 1 }];
        // SAFETY: the pass has both attachments.
        unsafe { gpu.device.cmd_clear_attachments(recorder.buffer, &clears, &rects) }
        recorder.shapes(plan.layout, &shapes()[4..]);
    })
}

/// The picture is copied into another image, upside down.
pub(super) fn blit() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .layer_count(1);
    let corner = |x, y, z| vk::Offset3D { x, y, z };
    let (right, bottom) = (EXTENT.width.cast_signed(), EXTENT.height.cast_signed());
    let region = vk::ImageBlit::default()
        .src_subresource(layers)
        .src_offsets([corner(0, 0, 0), corner(right, bottom, 1)])
        .dst_subresource(layers)
        .dst_offsets([corner(0, bottom, 0), corner(right, 0, 1)]);
    moved(&gpu, &target, |recorder, from, to, [reads, writes]| {
        let (at, filter) = (recorder.buffer, vk::Filter::NEAREST);
        // SAFETY: the images are as large as the region.
        unsafe { gpu.device.cmd_blit_image(at, from, reads, to, writes, &[region], filter) }
    })
}

/// The target is overwritten by copies of its own upper half, and drawn onto again.
pub(super) fn overwritten() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let plan = TargetPlan::default();
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::TRANSFER_SRC
        | vk::ImageUsageFlags::TRANSFER_DST;
    let (extent, samples) = (plan.extent, plan.samples);
    let image = ImagePlan { format: plan.colours[0], extent, layers: 1, samples, usage };
    let colours = vec![Image::new(&gpu, image)?];
    let target = Target::of(&gpu, plan, Images { colours, resolves: Vec::new(), depth: None })?;
    let loading = target.plan.pass(&gpu, true)?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let picture = &target.images.colours[0];
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .layer_count(1);
    let half = EXTENT.height / 2;
    let region = vk::ImageCopy::default()
        .src_subresource(layers)
        .dst_subresource(layers)
        .dst_offset(vk::Offset3D { x: 0, y: half.cast_signed(), z: 0 })
        .extent(vk::Extent3D { width: EXTENT.width, height: half, depth: 1 });
    let recorder = recorded(&gpu, &target, target.pass, &plan, &shapes()[..4])?;
    let (reads, both) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::GENERAL);
    recorder.relayout(picture, reads, both);
    // SAFETY: the halves do not overlap.
    unsafe {
        let (at, image) = (recorder.buffer, picture.handle);
        gpu.device.cmd_copy_image(at, image, both, image, both, &[region]);
    }
    recorder.relayout(picture, both, reads);
    recorder.pass_of(&target, loading, vk::SubpassContents::INLINE);
    recorder.bind(pipeline);
    recorder.shapes(plan.layout, &shapes()[4..]);
    recorder.end_pass();
    recorder.run()?;
    read(&gpu, target.images.finished())
}

/// Four samples, resolved by a command after the pass.
pub(super) fn resolve_command() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let plan = TargetPlan { unresolved: true, ..TargetPlan::multisampled() };
    let target = Target::new(&gpu, plan)?;
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .layer_count(1);
    let region = vk::ImageResolve::default()
        .src_subresource(layers)
        .dst_subresource(layers)
        .extent(vk::Extent3D { width: EXTENT.width, height: EXTENT.height, depth: 1 });
    moved(&gpu, &target, |recorder, from, to, [reads, writes]| {
        // SAFETY: the images are as large as the region.
        unsafe { gpu.device.cmd_resolve_image(recorder.buffer, from, reads, to, writes, &[region]) }
    })
}

/// Draws, has `carry` bring the picture to another image, and reads that.
fn moved(
    gpu: &Gpu,
    target: &Target,
    carry: impl FnOnce(&Recorder<'_>, vk::Image, vk::Image, [vk::ImageLayout; 2]),
) -> Result<Vec<u8>> {
    let other = ImagePlan {
        format: vk::Format::R8G8B8A8_UNORM,
        extent: EXTENT,
        layers: 1,
        samples: vk::SampleCountFlags::TYPE_1,
        usage: vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST,
    };
    let other = Image::new(gpu, other)?;
    let plan = Plan::new(gpu, target)?;
    let recorder = recorded(gpu, target, target.pass, &plan, &shapes())?;
    let [reads, writes] =
        [vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL];
    recorder.relayout(&other, vk::ImageLayout::UNDEFINED, writes);
    carry(&recorder, target.images.colours[0].handle, other.handle, [reads, writes]);
    recorder.relayout(&other, writes, reads);
    recorder.run()?;
    read(gpu, &[other])
}
