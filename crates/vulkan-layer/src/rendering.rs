//! Passes as they are begun in command buffers, with render passes and without.

use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::commands::{Commands, Open, PLAIN, with, with_objects};
use crate::device::{Device, SETTINGS, device};
use crate::log;
use crate::objects::{Objects, RenderPass};
use crate::passes::{RATED, rated};
use crate::steps::Step;
use crate::table::next;

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

const UNKNOWN: &str = "what its pass draws into is not known";

/// The image of a view that begins with its first level and layer.
fn first(objects: &Objects, view: u64) -> Option<u64> {
    let view = objects.views.get(&view)?;
    (view.layer == 0 && view.level == 0).then_some(view.image)
}

/// A pass, or a subpass of one, begins.
fn enter(commands: &mut Commands, pass: Option<log::Pass>, refused: &'static str) {
    commands.refused = refused;
    let Some(pass) = pass else { return };
    let images = [&pass.colour, &pass.resolve, &pass.depth].into_iter().flatten();
    commands.images = images.map(|a| a.image).collect();
    if commands.plain {
        commands.spoil(PLAIN);
    } else {
        commands.steps.push(Step::Event(log::Event::Pass(pass)));
    }
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

    /// Why its draws cannot be told; empty where they can.
    fn refused(&self, objects: &Objects) -> &'static str {
        let Some(subpass) = self.pass.subpasses.get(self.subpass) else { return UNKNOWN };
        let all = subpass.colours.iter().chain(&subpass.resolve).chain(&subpass.depth);
        let known =
            |n: &u32| self.views.get(*n as usize).is_some_and(|v| objects.views.contains_key(v));
        if all.into_iter().all(known) { self.pass.refused } else { UNKNOWN }
    }

    /// The layouts in which its images are after it.
    fn layouts(&self, objects: &Objects) -> Vec<(u64, vk::ImageLayout)> {
        let image = |n: usize| first(objects, *self.views.get(n)?);
        let all = self.pass.attachments.iter().enumerate();
        all.filter_map(|(n, info)| Some((image(n)?, info.after))).collect()
    }
}

unsafe fn begin(d: &Device, buffer: vk::CommandBuffer, info: *const vk::RenderPassBeginInfo<'_>) {
    if d.over() {
        return;
    }
    with_objects(d, |objects| {
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
        let entered = begun.enter(objects, objects.label(buffer));
        let refused = begun.refused(objects);
        let commands = objects.recording(buffer);
        commands.open = Some(Open::Pass(begun));
        enter(commands, entered, refused);
    });
}

fn next_subpass(d: &Device, buffer: vk::CommandBuffer) {
    if d.over() {
        return;
    }
    with_objects(d, |objects| {
        let Some(Open::Pass(mut begun)) = objects.recording(buffer).open.take() else { return };
        begun.subpass += 1;
        let entered = begun.enter(objects, objects.label(buffer));
        let refused = begun.refused(objects);
        let commands = objects.recording(buffer);
        commands.open = Some(Open::Pass(begun));
        enter(commands, entered, refused);
    });
}

fn end(d: &Device, buffer: vk::CommandBuffer) {
    if d.over() {
        return;
    }
    with_objects(d, |objects| {
        let open = objects.recording(buffer).open.take();
        let layouts = match open {
            Some(Open::Pass(begun)) => begun.layouts(objects),
            Some(Open::Rendering(layouts)) => layouts,
            None => Vec::new(),
        };
        let commands = objects.recording(buffer);
        commands.steps.extend(layouts.into_iter().map(|(i, layout)| Step::Layout(i, layout)));
        commands.images.clear();
        commands.refused = "";
    });
}

pub(crate) unsafe extern "system" fn begin_pass(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: vk::SubpassContents,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    unsafe { begin(&d, buffer, info) };
    next!(d.table.begin_pass, buffer, info, contents)
}

pub(crate) unsafe extern "system" fn begin_pass2(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: *const vk::SubpassBeginInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    unsafe { begin(&d, buffer, info) };
    next!(d.table.begin_pass2, buffer, info, contents)
}

pub(crate) unsafe extern "system" fn subpass(
    buffer: vk::CommandBuffer,
    contents: vk::SubpassContents,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    next_subpass(&d, buffer);
    next!(d.table.next_subpass, buffer, contents)
}

pub(crate) unsafe extern "system" fn subpass2(
    buffer: vk::CommandBuffer,
    contents: *const vk::SubpassBeginInfo<'_>,
    after: *const vk::SubpassEndInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    next_subpass(&d, buffer);
    next!(d.table.next_subpass2, buffer, contents, after)
}

pub(crate) unsafe extern "system" fn end_pass(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    end(&d, buffer);
    next!(d.table.end_pass, buffer)
}

pub(crate) unsafe extern "system" fn end_pass2(
    buffer: vk::CommandBuffer,
    info: *const vk::SubpassEndInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    end(&d, buffer);
    next!(d.table.end_pass2, buffer, info)
}

pub(crate) unsafe extern "system" fn end_rendering(buffer: vk::CommandBuffer) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    end(&d, buffer);
    next!(d.table.end_rendering, buffer)
}

pub(crate) unsafe extern "system" fn begin_rendering(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderingInfo<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let told = |objects: &mut Objects| {
        let info = unsafe { &*info };
        let resumes = info.flags.contains(vk::RenderingFlags::RESUMING);
        let known =
            |view: vk::ImageView| view.is_null() || objects.views.contains_key(&view.as_raw());
        let get = |objects: &Objects, a: &vk::RenderingAttachmentInfo<'_>| {
            let load = if resumes { vk::AttachmentLoadOp::LOAD } else { a.load_op };
            attachment(objects, a.image_view.as_raw(), load, clear_value(&a.clear_value))
        };
        let colours = unsafe { slice(info.p_color_attachments, info.color_attachment_count) };
        let ours = colours.get(SETTINGS.location as usize);
        let depth = unsafe { info.p_depth_attachment.as_ref() };
        let mut views = colours.iter().chain(depth).map(|a| a.image_view);
        let refused = match () {
            () if !views.all(known) => UNKNOWN,
            () if unsafe { rated(info.p_next) } => RATED,
            () => "",
        };
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
                layouts.extend(first(objects, view.as_raw()).map(|image| (image, layout)));
            }
        }
        let pass = log::Pass {
            others: used - u32::from(colour.is_some()).min(used),
            colour,
            resolve,
            depth: depth.and_then(|a| get(objects, a)),
            area: area(&info.render_area),
            layers: info.layer_count.max(info.view_mask.count_ones()).max(1),
            label: objects.label(buffer),
        };
        let commands = objects.recording(buffer);
        commands.open = Some(Open::Rendering(layouts));
        enter(commands, Some(pass), refused);
    };
    if !d.over() {
        with_objects(&d, told);
    }
    next!(d.table.begin_rendering, buffer, info)
}

/// Which output goes to which attachment is no longer the pipeline's to say.
pub(crate) unsafe extern "system" fn set_locations(
    buffer: vk::CommandBuffer,
    info: *const vk::RenderingAttachmentLocationInfoKHR<'_>,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    with(&d, buffer, |commands| commands.refused = "its outputs go to other attachments");
    next!(d.table.set_locations, buffer, info)
}
