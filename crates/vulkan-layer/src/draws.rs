//! Draws: each gets a number, which its fragments carry.

use ash::vk;

use crate::commands::{Step, with_objects};
use crate::device::{Device, device};
use crate::guard;
use crate::log::{self, Event};
use crate::pipelines::Pipeline;
use crate::table::next;

/// A draw about to be recorded.
#[derive(Clone, Copy, Default)]
struct Command {
    name: &'static str,
    vertices: u32,
    instances: u32,
    /// Why its fragments cannot be put in order, or empty.
    refused: &'static str,
}

/// Numbers a draw and binds our set for it.
fn before(d: &Device, buffer: vk::CommandBuffer, command: Command) {
    let mut full = false;
    with_objects(d, |objects| {
        let commands = objects.commands.entry(vk::Handle::as_raw(buffer)).or_default();
        let Some(pipeline) = commands.pipeline.clone() else { return };
        let recorded = pipeline.refused.is_empty() && !commands.plain;
        let slot = if recorded { objects.slots.take() } else { None };
        full = slot.is_none() && recorded;
        let refused = match () {
            () if !pipeline.refused.is_empty() => &*pipeline.refused,
            () if commands.plain => PLAIN,
            () if full => FULL,
            () => command.refused,
        };
        commands.slots.extend(slot);
        let draw = log::Draw {
            slot: slot.unwrap_or(u32::MAX),
            pipeline: pipeline.number,
            command: command.name.into(),
            vertices: command.vertices,
            instances: command.instances,
            state: pipeline.fixed.with(&commands.dynamic),
            refused: refused.into(),
            label: commands.label(),
        };
        commands.steps.push(Step::Event(Event::Draw(draw)));
        let Some(layout) = objects.layouts.pipeline(pipeline.layout) else { return };
        let bind = |at: u32, set: vk::DescriptorSet, offsets: &[u32]| {
            let n = offsets.len() as u32;
            let point = vk::PipelineBindPoint::GRAPHICS;
            let (layout, offsets) = (pipeline.layout, offsets.as_ptr());
            let () = next!(d.table.bind_sets, buffer, point, layout, at, 1, &set, n, offsets);
        };
        for (at, set, offsets) in commands.sets.again(layout) {
            bind(at, set, &offsets);
        }
        // Where there is no number left, that of all such draws.
        let number = slot.or(full.then_some(crate::recorder::SLOTS - 1));
        if let Some((set, offset)) = number.and_then(|slot| d.resources.bind(slot)) {
            bind(d.set_index, set, &[offset]);
            commands.sets.disturb(layout);
        }
    });
    if full {
        guard(|| d.recorder().note(&format!("some draws are not captured: {FULL}")));
    }
}

const PLAIN: &str = "it was recorded before the capture was to begin";
const FULL: &str = "more draws are recorded at a time than can be told apart";

/// The pipeline that is bound.
fn bound(d: &Device, buffer: vk::CommandBuffer) -> Option<std::sync::Arc<Pipeline>> {
    guard(|| d.objects().recording(buffer).pipeline.clone()).flatten()
}

/// Whether the parts of a multi-draw can be drawn one by one: not where a shader asks which of them
/// it is in.
fn apart(d: &Device, buffer: vk::CommandBuffer) -> bool {
    bound(d, buffer).is_some_and(|p| !p.draw_index && p.refused.is_empty())
}

const INDEXED_BY_DRAW: &str =
    "its shader asks for gl_DrawID, so that its draws cannot be told apart";
const SEVERAL: &str = "it is a multi-draw of several instances, the order of which drivers choose";
const COUNTED: &str = "the number of its draws lies in a buffer, so that they cannot be told apart";

pub(crate) unsafe extern "system" fn draw(
    buffer: vk::CommandBuffer,
    vertices: u32,
    instances: u32,
    first: u32,
    first_instance: u32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    before(&d, buffer, Command { name: "vkCmdDraw", vertices, instances, refused: "" });
    next!(d.table.draw, buffer, vertices, instances, first, first_instance)
}

pub(crate) unsafe extern "system" fn draw_indexed(
    buffer: vk::CommandBuffer,
    vertices: u32,
    instances: u32,
    first: u32,
    offset: i32,
    first_instance: u32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    before(&d, buffer, Command { name: "vkCmdDrawIndexed", vertices, instances, refused: "" });
    next!(d.table.draw_indexed, buffer, vertices, instances, first, offset, first_instance)
}

/// Hooks of draws whose numbers lie in a buffer, `stride` bytes apart.
macro_rules! indirect {
    ($($hook:ident: $next:ident, $name:literal;)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(
            buffer: vk::CommandBuffer,
            from: vk::Buffer,
            offset: vk::DeviceSize,
            n: u32,
            stride: u32,
        ) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            let command = Command { name: $name, ..Command::default() };
            if n > 1 && apart(&d, buffer) {
                for at in 0..u64::from(n) {
                    before(&d, buffer, command);
                    let offset = offset + at * u64::from(stride);
                    let () = next!(d.table.$next, buffer, from, offset, 1, stride);
                }
                return;
            }
            let refused = if n > 1 { INDEXED_BY_DRAW } else { "" };
            before(&d, buffer, Command { refused, ..command });
            next!(d.table.$next, buffer, from, offset, n, stride)
        }
    )*};
}

indirect! {
    draw_indirect: draw_indirect, "vkCmdDrawIndirect";
    draw_indexed_indirect: draw_indexed_indirect, "vkCmdDrawIndexedIndirect";
}

/// Hooks of draws whose number lies in a buffer, too: where it can be 1 at most, it is one draw.
macro_rules! indirect_count {
    ($($hook:ident: $next:ident, $name:literal;)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(
            buffer: vk::CommandBuffer,
            from: vk::Buffer,
            offset: vk::DeviceSize,
            count: vk::Buffer,
            count_offset: vk::DeviceSize,
            most: u32,
            stride: u32,
        ) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            let refused = if most > 1 { COUNTED } else { "" };
            before(&d, buffer, Command { name: $name, refused, ..Command::default() });
            next!(d.table.$next, buffer, from, offset, count, count_offset, most, stride)
        }
    )*};
}

indirect_count! {
    draw_indirect_count: draw_indirect_count, "vkCmdDrawIndirectCount";
    draw_indexed_indirect_count: draw_indexed_indirect_count, "vkCmdDrawIndexedIndirectCount";
}

pub(crate) unsafe extern "system" fn draw_byte_count(
    buffer: vk::CommandBuffer,
    instances: u32,
    first_instance: u32,
    counter: vk::Buffer,
    counter_offset: vk::DeviceSize,
    offset: u32,
    stride: u32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let name = "vkCmdDrawIndirectByteCountEXT";
    before(&d, buffer, Command { name, instances, ..Command::default() });
    let next = d.table.draw_byte_count;
    next!(next, buffer, instances, first_instance, counter, counter_offset, offset, stride)
}

/// Why the parts of a multi-draw have to be drawn at once. Of several instances a driver may draw all
/// parts of one after the other (Mesa's lavapipe 22.3 does), in which the picture would change.
fn together(d: &Device, buffer: vk::CommandBuffer, n: u32, instances: u32) -> Option<&'static str> {
    match () {
        () if n <= 1 => None,
        () if !apart(d, buffer) => Some(INDEXED_BY_DRAW),
        () if instances > 1 => Some(SEVERAL),
        () => None,
    }
}

/// The `at`th of values that lie `stride` bytes apart.
unsafe fn at<T: Copy>(first: *const T, at: u32, stride: u32) -> *const T {
    unsafe { first.byte_add(at as usize * stride as usize) }
}

pub(crate) unsafe extern "system" fn draw_multi(
    buffer: vk::CommandBuffer,
    n: u32,
    draws: *const vk::MultiDrawInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let name = "vkCmdDrawMultiEXT";
    let next = d.table.draw_multi;
    if let Some(refused) = together(&d, buffer, n, instances) {
        before(&d, buffer, Command { name, instances, refused, vertices: 0 });
        return next!(next, buffer, n, draws, instances, first_instance, stride);
    }
    for part in 0..n {
        let one = unsafe { at(draws, part, stride) };
        let vertices = unsafe { (*one).vertex_count };
        before(&d, buffer, Command { name, vertices, instances, refused: "" });
        let () = next!(next, buffer, 1, one, instances, first_instance, stride);
    }
}

pub(crate) unsafe extern "system" fn draw_multi_indexed(
    buffer: vk::CommandBuffer,
    n: u32,
    draws: *const vk::MultiDrawIndexedInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
    offset: *const i32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let name = "vkCmdDrawMultiIndexedEXT";
    let next = d.table.draw_multi_indexed;
    if let Some(refused) = together(&d, buffer, n, instances) {
        before(&d, buffer, Command { name, instances, refused, vertices: 0 });
        return next!(next, buffer, n, draws, instances, first_instance, stride, offset);
    }
    for part in 0..n {
        let one = unsafe { at(draws, part, stride) };
        let vertices = unsafe { (*one).index_count };
        before(&d, buffer, Command { name, vertices, instances, refused: "" });
        let () = next!(next, buffer, 1, one, instances, first_instance, stride, offset);
    }
}
