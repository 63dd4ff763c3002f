//! Draws: each gets a number, which its fragments carry.

use ash::vk::{self, Handle};

use crate::commands::{CONDITIONAL, with_objects};
use crate::device::{Device, device};
use crate::guard;
use crate::objects::OVERFLOW;
use crate::steps::{Drawn, Step};
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
    if d.idle() {
        return;
    }
    let mut full = false;
    with_objects(d, |objects| {
        let commands = objects.commands.entry(buffer.as_raw()).or_default();
        let Some(pipeline) = commands.pipeline.clone() else { return };
        if commands.plain || pipeline.discards {
            return;
        }
        let layout = objects.layouts.pipeline(pipeline.layout);
        let recorded = pipeline.refused.is_empty();
        let lost = recorded && layout.is_some_and(|layout| commands.sets.would_lose(layout));
        let slot = if recorded && !lost { objects.slots.take() } else { None };
        full = recorded && !lost && slot.is_none();
        let refused = match () {
            () if !recorded => "",
            () if lost => PUSHED,
            () if full => FULL,
            () if !command.refused.is_empty() => command.refused,
            () if commands.conditional => CONDITIONAL,
            () if pipeline.fixed.alpha_to_one(&commands.dynamic) => ALPHA_TO_ONE,
            () => commands.refused,
        };
        commands.slots.extend(slot);
        commands.steps.push(Step::Draw(Drawn {
            slot: slot.unwrap_or(u32::MAX),
            pipeline: pipeline.clone(),
            command: command.name,
            vertices: command.vertices,
            instances: command.instances,
            state: pipeline.fixed.with(&commands.dynamic),
            refused,
            label: commands.label.clone(),
        }));
        // Ours cannot do without our set.
        if lost != commands.own && !pipeline.ours.is_null() {
            let bound = if lost { pipeline.theirs } else { pipeline.ours };
            let () = next!(d.table.bind_pipeline, buffer, GRAPHICS, bound);
            commands.own = lost;
        }
        let Some(layout) = layout else { return };
        let bind = |at: u32, set: vk::DescriptorSet, offsets: &[u32]| {
            let n = offsets.len() as u32;
            let (layout, offsets) = (pipeline.layout, offsets.as_ptr());
            let () = next!(d.table.bind_sets, buffer, GRAPHICS, layout, at, 1, &set, n, offsets);
        };
        for (at, set, offsets) in commands.sets.again(layout) {
            bind(at, set, &offsets);
        }
        let number = slot.or(full.then_some(OVERFLOW));
        if let Some((set, offset)) = number.and_then(|slot| d.resources.bind(slot)) {
            bind(d.set_index, set, &[offset]);
            commands.sets.disturb(layout);
        }
    });
    if full {
        guard(|| d.recorder().note(&format!("some draws are not captured: {FULL}")));
    }
}

const GRAPHICS: vk::PipelineBindPoint = vk::PipelineBindPoint::GRAPHICS;

const FULL: &str = "more draws are recorded at a time than can be told apart";
const ALPHA_TO_ONE: &str = "its alpha is replaced by 1 (alpha to one)";
const PUSHED: &str = "it leaves pushed descriptors alone, which our set would disturb";

/// Whether the parts of a multi-draw of `n` can be drawn one by one: not where a shader asks which of
/// them it is in.
fn apart(d: &Device, buffer: vk::CommandBuffer, n: u32) -> Apart {
    let all = || {
        let mut objects = d.objects();
        let left = objects.slots.left();
        let commands = objects.recording(buffer);
        let pipeline = commands.pipeline.as_ref().filter(|p| p.refused.is_empty());
        match pipeline {
            Some(_) if n <= 1 || commands.plain => Apart::AtOnce,
            Some(p) if p.draw_index => Apart::Refused(INDEXED_BY_DRAW),
            Some(_) if n > left => Apart::Refused(FULL),
            Some(_) => Apart::Each,
            None => Apart::AtOnce,
        }
    };
    if d.idle() { Apart::AtOnce } else { guard(all).unwrap_or(Apart::AtOnce) }
}

/// How a multi-draw is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Apart {
    /// As the program has it: one draw to us.
    AtOnce,
    Refused(&'static str),
    Each,
}

impl Apart {
    fn why(self) -> &'static str {
        match self {
            Self::Refused(why) => why,
            Self::AtOnce | Self::Each => "",
        }
    }
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
            let apart = apart(&d, buffer, n);
            if apart == Apart::Each {
                for at in 0..u64::from(n) {
                    before(&d, buffer, command);
                    let offset = offset + at * u64::from(stride);
                    let () = next!(d.table.$next, buffer, from, offset, 1, stride);
                }
                return;
            }
            before(&d, buffer, Command { refused: apart.why(), ..command });
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

/// How one of several instances is drawn. Of such a driver may draw all parts of one instance after
/// the other (Mesa's lavapipe 22.3 does), in which the picture would change.
fn instanced(d: &Device, buffer: vk::CommandBuffer, n: u32, instances: u32) -> Apart {
    match apart(d, buffer, n) {
        Apart::Each if instances > 1 => Apart::Refused(SEVERAL),
        apart => apart,
    }
}

/// The `at`th of values that lie `stride` bytes apart.
unsafe fn at<T: Copy>(first: *const T, at: u32, stride: u32) -> *const T {
    unsafe { first.byte_add(at as usize * stride as usize) }
}

/// Hooks of draws that are given several at once, `stride` bytes apart. What they end with differs.
macro_rules! multi {
    ($($hook:ident: $next:ident, $name:literal, $info:ty, $count:ident, ($($last:ident: $lt:ty),*);)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(
            buffer: vk::CommandBuffer,
            n: u32,
            draws: *const $info,
            instances: u32,
            first_instance: u32,
            stride: u32,
            $($last: $lt),*
        ) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            let name = $name;
            let next = d.table.$next;
            let apart = instanced(&d, buffer, n, instances);
            if apart != Apart::Each {
                let vertices = if n == 1 { unsafe { (*draws).$count } } else { 0 };
                before(&d, buffer, Command { name, instances, refused: apart.why(), vertices });
                return next!(next, buffer, n, draws, instances, first_instance, stride $(, $last)*);
            }
            for part in 0..n {
                let one = unsafe { at(draws, part, stride) };
                let vertices = unsafe { (*one).$count };
                before(&d, buffer, Command { name, vertices, instances, refused: "" });
                let () = next!(next, buffer, 1, one, instances, first_instance, stride $(, $last)*);
            }
        }
    )*};
}

multi! {
    draw_multi: draw_multi, "vkCmdDrawMultiEXT", vk::MultiDrawInfoEXT, vertex_count, ();
    draw_multi_indexed: draw_multi_indexed, "vkCmdDrawMultiIndexedEXT",
        vk::MultiDrawIndexedInfoEXT, index_count, (offset: *const i32);
}
