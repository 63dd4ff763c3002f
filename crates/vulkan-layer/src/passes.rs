//! Render passes and framebuffers, as they are made and as they are begun.

use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::commands::{Move, Open, Step, with_objects};
use crate::device::{SETTINGS, device};
use crate::guard;
use crate::log;
use crate::objects::{AttachmentInfo, Framebuffer, Objects, RenderPass, Subpass};
use crate::table::next;

/// The hooks of both versions of a render pass: their structures have fields of one name.
macro_rules! create_pass {
    ($hook:ident, $next:ident, $info:ty, $reference:ty, |$subpass:ident, $all:ident, $n:ident| $views:expr) => {
        pub(crate) unsafe extern "system" fn $hook(
            handle: vk::Device,
            info: *const $info,
            allocator: *const vk::AllocationCallbacks<'_>,
            out: *mut vk::RenderPass,
        ) -> vk::Result {
            let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
            let result = next!(d.table.$next, handle, info, allocator, out);
            if result != vk::Result::SUCCESS {
                return result;
            }
            guard(|| unsafe {
                let $all = &*info;
                let attachments = slice($all.p_attachments, $all.attachment_count)
                    .iter()
                    .map(|a| AttachmentInfo { load: a.load_op, after: a.final_layout })
                    .collect();
                let used = |r: Option<&$reference>| {
                    r.map(|r| r.attachment).filter(|&a| a != vk::ATTACHMENT_UNUSED)
                };
                let at = SETTINGS.location as usize;
                let subpasses = slice($all.p_subpasses, $all.subpass_count)
                    .iter()
                    .enumerate()
                    .map(|($n, $subpass)| {
                        let n = $subpass.color_attachment_count;
                        let colours = slice($subpass.p_color_attachments, n);
                        let resolves = slice($subpass.p_resolve_attachments, n);
                        Subpass {
                            colour: used(colours.get(at)),
                            resolve: used(resolves.get(at)),
                            depth: used($subpass.p_depth_stencil_attachment.as_ref()),
                            colours: colours.iter().filter_map(|r| used(Some(r))).collect(),
                            views: $views,
                        }
                    })
                    .collect();
                let pass = RenderPass { attachments, subpasses };
                d.objects().passes.insert((*out).as_raw(), Arc::new(pass));
            });
            result
        }
    };
}

create_pass!(
    create_render_pass,
    create_render_pass,
    vk::RenderPassCreateInfo<'_>,
    vk::AttachmentReference,
    |subpass, all, n| {
        let s_type = vk::StructureType::RENDER_PASS_MULTIVIEW_CREATE_INFO;
        let masks = find::<vk::RenderPassMultiviewCreateInfo<'_>>(all.p_next, s_type);
        let masks = masks.map_or(&[][..], |m| slice((*m).p_view_masks, (*m).subpass_count));
        masks.get(n).map_or(0, |mask| mask.count_ones())
    }
);

create_pass!(
    create_render_pass2,
    create_render_pass2,
    vk::RenderPassCreateInfo2<'_>,
    vk::AttachmentReference2<'_>,
    |subpass, all, n| {
        let _ = n;
        subpass.view_mask.count_ones()
    }
);

pub(crate) unsafe extern "system" fn destroy_render_pass(
    handle: vk::Device,
    pass: vk::RenderPass,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().passes.remove(&pass.as_raw()));
    next!(d.table.destroy_render_pass, handle, pass, allocator)
}

pub(crate) unsafe extern "system" fn create_framebuffer(
    handle: vk::Device,
    info: *const vk::FramebufferCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Framebuffer,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_framebuffer, handle, info, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            let info = &*info;
            let imageless = info.flags.contains(vk::FramebufferCreateFlags::IMAGELESS);
            let views = if imageless {
                Vec::new()
            } else {
                slice(info.p_attachments, info.attachment_count)
                    .iter()
                    .map(|v| v.as_raw())
                    .collect()
            };
            let framebuffer = Framebuffer { views, layers: info.layers };
            d.objects().framebuffers.insert((*out).as_raw(), Arc::new(framebuffer));
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_framebuffer(
    handle: vk::Device,
    framebuffer: vk::Framebuffer,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().framebuffers.remove(&framebuffer.as_raw()));
    next!(d.table.destroy_framebuffer, handle, framebuffer, allocator)
}

fn area(rect: &vk::Rect2D) -> [i32; 4] {
    let (at, size) = (rect.offset, rect.extent);
    [at.x, at.y, size.width as i32, size.height as i32]
}

/// A clear value as four numbers; depth in the first.
fn clear_value(value: &vk::ClearValue) -> [f32; 4] {
    unsafe { value.color.float32 }
}

/// An attachment through a view.
fn attachment(
    objects: &Objects,
    view: u64,
    load: vk::AttachmentLoadOp,
    clear: [f32; 4],
) -> Option<log::Attachment> {
    let view = objects.views.get(&view)?;
    Some(log::Attachment {
        image: view.image,
        format: view.format.as_raw(),
        layer: view.layer,
        level: view.level,
        load: load.as_raw(),
        clear,
    })
}

/// A pass of a render pass, begun in a command buffer.
#[derive(Clone, Default)]
pub(crate) struct Begun {
    pass: Arc<RenderPass>,
    views: Vec<u64>,
    layers: u32,
    area: [i32; 4],
    clears: Vec<[f32; 4]>,
    subpass: usize,
    /// Attachments that a subpass has used: the next goes on with what is there.
    used: Vec<u32>,
}

impl Begun {
    /// The pass as the log has it, for the subpass that begins.
    fn enter(&mut self, objects: &Objects, label: String) -> Option<log::Pass> {
        let subpass = self.pass.subpasses.get(self.subpass)?.clone();
        let get = |n: Option<u32>, resolve: bool| {
            let n = n?;
            let info = self.pass.attachments.get(n as usize)?;
            let load = match self.used.contains(&n) || resolve {
                true => vk::AttachmentLoadOp::LOAD,
                false => info.load,
            };
            let clear = self.clears.get(n as usize).copied().unwrap_or_default();
            attachment(objects, *self.views.get(n as usize)?, load, clear)
        };
        let colours = subpass.colours.len() as u32;
        let pass = log::Pass {
            colour: get(subpass.colour, false),
            resolve: get(subpass.resolve, true),
            depth: get(subpass.depth, false),
            others: colours - u32::from(subpass.colour.is_some()).min(colours),
            area: self.area,
            layers: subpass.views.max(self.layers).max(1),
            label,
        };
        self.used.extend(subpass.colours.iter().copied().chain(subpass.depth));
        Some(pass)
    }

    /// The layouts in which its images are after it.
    fn layouts(&self, objects: &Objects) -> Vec<(u64, vk::ImageLayout)> {
        let image = |n: usize| objects.views.get(self.views.get(n)?).map(|view| view.image);
        let all = self.pass.attachments.iter().enumerate();
        all.filter_map(|(n, info)| Some((image(n)?, info.after))).collect()
    }
}

unsafe fn begin(buffer: vk::CommandBuffer, info: *const vk::RenderPassBeginInfo<'_>) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with_objects(&d, |objects| {
        let info = unsafe { &*info };
        let pass = objects.passes.get(&info.render_pass.as_raw()).cloned().unwrap_or_default();
        let made =
            objects.framebuffers.get(&info.framebuffer.as_raw()).cloned().unwrap_or_default();
        let s_type = vk::StructureType::RENDER_PASS_ATTACHMENT_BEGIN_INFO;
        let given = unsafe {
            find::<vk::RenderPassAttachmentBeginInfo<'_>>(info.p_next, s_type)
                .map(|given| slice((*given).p_attachments, (*given).attachment_count))
        };
        let views = match given {
            Some(given) => given.iter().map(|view| view.as_raw()).collect(),
            None => made.views.clone(),
        };
        let clears = unsafe { slice(info.p_clear_values, info.clear_value_count) };
        let mut begun = Begun {
            pass,
            views,
            layers: made.layers,
            area: area(&info.render_area),
            clears: clears.iter().map(clear_value).collect(),
            ..Begun::default()
        };
        let label = objects.recording(buffer).label();
        let entered = begun.enter(objects, label);
        let commands = objects.recording(buffer);
        commands.open = Some(Open::Pass(begun));
        commands.steps.extend(entered.map(|pass| Step::Event(log::Event::Pass(pass))));
    });
}

fn next_subpass(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with_objects(&d, |objects| {
        let commands = objects.recording(buffer);
        let label = commands.label();
        let Some(Open::Pass(mut begun)) = commands.open.take() else { return };
        begun.subpass += 1;
        let entered = begun.enter(objects, label);
        let commands = objects.recording(buffer);
        commands.open = Some(Open::Pass(begun));
        commands.steps.extend(entered.map(|pass| Step::Event(log::Event::Pass(pass))));
    });
}

fn end(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with_objects(&d, |objects| {
        let open = objects.recording(buffer).open.take();
        let layouts = match open {
            Some(Open::Pass(begun)) => begun.layouts(objects),
            Some(Open::Rendering(layouts)) => layouts,
            None => Vec::new(),
        };
        let moves = layouts.into_iter().map(|(image, layout)| Move::Layout(image, layout));
        objects.recording(buffer).moves.extend(moves);
    });
}

pub(crate) unsafe extern "system" fn begin_pass(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: vk::SubpassContents,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    unsafe { begin(buffer, info) };
    next!(d.table.begin_pass, buffer, info, contents)
}

pub(crate) unsafe extern "system" fn begin_pass2(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: *const vk::SubpassBeginInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    unsafe { begin(buffer, info) };
    next!(d.table.begin_pass2, buffer, info, contents)
}

pub(crate) unsafe extern "system" fn subpass(
    buffer: vk::CommandBuffer,
    contents: vk::SubpassContents,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    next_subpass(buffer);
    next!(d.table.next_subpass, buffer, contents)
}

pub(crate) unsafe extern "system" fn subpass2(
    buffer: vk::CommandBuffer,
    contents: *const vk::SubpassBeginInfo<'_>,
    after: *const vk::SubpassEndInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    next_subpass(buffer);
    next!(d.table.next_subpass2, buffer, contents, after)
}

pub(crate) unsafe extern "system" fn end_pass(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    end(buffer);
    next!(d.table.end_pass, buffer)
}

pub(crate) unsafe extern "system" fn end_pass2(
    buffer: vk::CommandBuffer,
    info: *const vk::SubpassEndInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    end(buffer);
    next!(d.table.end_pass2, buffer, info)
}

pub(crate) unsafe extern "system" fn end_rendering(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    end(buffer);
    next!(d.table.end_rendering, buffer)
}

pub(crate) unsafe extern "system" fn begin_rendering(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderingInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with_objects(&d, |objects| {
        let info = unsafe { &*info };
        let resumes = info.flags.contains(vk::RenderingFlags::RESUMING);
        let get = |objects: &Objects, a: &vk::RenderingAttachmentInfo<'_>| {
            let load = if resumes { vk::AttachmentLoadOp::LOAD } else { a.load_op };
            attachment(objects, a.image_view.as_raw(), load, clear_value(&a.clear_value))
        };
        let colours = unsafe { slice(info.p_color_attachments, info.color_attachment_count) };
        let ours = colours.get(SETTINGS.location as usize);
        let depth = unsafe { info.p_depth_attachment.as_ref() };
        let used = colours.iter().filter(|a| !a.image_view.is_null()).count() as u32;
        let colour = ours.and_then(|a| get(objects, a));
        let resolve = ours.filter(|a| !a.resolve_mode.is_empty()).and_then(|a| {
            let load = vk::AttachmentLoadOp::LOAD;
            attachment(objects, a.resolve_image_view.as_raw(), load, [0.0; 4])
        });
        let mut layouts = Vec::new();
        for a in colours {
            let all =
                [(a.image_view, a.image_layout), (a.resolve_image_view, a.resolve_image_layout)];
            for (view, layout) in all {
                layouts.extend(objects.views.get(&view.as_raw()).map(|v| (v.image, layout)));
            }
        }
        let label = objects.recording(buffer).label();
        let pass = log::Pass {
            others: used - u32::from(colour.is_some()).min(used),
            colour,
            resolve,
            depth: depth.and_then(|a| get(objects, a)),
            area: area(&info.render_area),
            layers: info.layer_count.max(info.view_mask.count_ones()).max(1),
            label,
        };
        let commands = objects.recording(buffer);
        commands.open = Some(Open::Rendering(layouts));
        commands.steps.push(Step::Event(log::Event::Pass(pass)));
    });
    next!(d.table.begin_rendering, buffer, info)
}
