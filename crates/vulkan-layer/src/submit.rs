//! Submissions: each that is asked for is waited for, and what it left is written.

use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::time::Duration;

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::commands::{Move, Step};
use crate::device::{Device, SETTINGS, device};
use crate::guard;
use crate::log::Event;
use crate::objects::{Image, Objects};
use crate::pictures;
use crate::recorder::{Pending, Recorder};
use crate::table::next;

/// How long a submission is waited for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// How long one that may wait for what the program does after it.
const SHORT: Duration = Duration::from_millis(50);

/// A fence that follows all that a queue has been given.
fn fence(d: &Device, queue: vk::Queue) -> Option<vk::Fence> {
    let mut fence = vk::Fence::null();
    let info = vk::FenceCreateInfo::default();
    let null = std::ptr::null();
    let result: vk::Result = next!(d.table.create_fence, d.handle, &info, null, &mut fence);
    result.result().ok()?;
    let result: vk::Result = next!(d.table.submit, queue, 0, std::ptr::null(), fence);
    if result != vk::Result::SUCCESS {
        let () = next!(d.table.destroy_fence, d.handle, fence, null);
        return None;
    }
    Some(fence)
}

/// Whether a fence is signalled within a time; then it is gone.
fn wait(d: &Device, fence: vk::Fence, patience: Duration) -> bool {
    let nanoseconds = patience.as_nanos() as u64;
    let result: vk::Result = next!(d.table.wait_fences, d.handle, 1, &fence, vk::TRUE, nanoseconds);
    let over = result != vk::Result::TIMEOUT;
    if over {
        let () = next!(d.table.destroy_fence, d.handle, fence, std::ptr::null());
    }
    over
}

/// Waits for all that a queue has been given; says whether it is done.
pub(crate) fn drain(d: &Device, queue: vk::Queue, patience: Duration) -> bool {
    // A fence that is not signalled stays with the driver: it cannot be destroyed yet.
    fence(d, queue).is_some_and(|fence| wait(d, fence, patience))
}

/// What one of the program's batches of command buffers is.
trait Batch: Copy {
    fn command_buffers(&self) -> Vec<vk::CommandBuffer>;
    /// Semaphores that it waits for, with the value where they hold a counter.
    fn waits(&self) -> Vec<(vk::Semaphore, u64)>;
    /// The batch with its `n`th command buffer alone; what it waits for goes with the first, what it
    /// signals with the last.
    fn alone(&self, n: u32) -> Self;
}

impl Batch for vk::SubmitInfo<'_> {
    fn command_buffers(&self) -> Vec<vk::CommandBuffer> {
        unsafe { slice(self.p_command_buffers, self.command_buffer_count).to_vec() }
    }

    fn waits(&self) -> Vec<(vk::Semaphore, u64)> {
        let all = unsafe { slice(self.p_wait_semaphores, self.wait_semaphore_count) };
        let s_type = vk::StructureType::TIMELINE_SEMAPHORE_SUBMIT_INFO;
        let values = unsafe {
            find::<vk::TimelineSemaphoreSubmitInfo<'_>>(self.p_next, s_type).map_or(&[][..], |t| {
                slice((*t).p_wait_semaphore_values, (*t).wait_semaphore_value_count)
            })
        };
        let values = values.iter().copied().chain(std::iter::repeat(0));
        all.iter().copied().zip(values).collect()
    }

    fn alone(&self, n: u32) -> Self {
        let mut one = *self;
        one.p_command_buffers = self.p_command_buffers.wrapping_add(n as usize);
        one.command_buffer_count = 1;
        if n > 0 {
            one.wait_semaphore_count = 0;
        }
        if n + 1 < self.command_buffer_count {
            one.signal_semaphore_count = 0;
        }
        one
    }
}

impl Batch for vk::SubmitInfo2<'_> {
    fn command_buffers(&self) -> Vec<vk::CommandBuffer> {
        let all = unsafe { slice(self.p_command_buffer_infos, self.command_buffer_info_count) };
        all.iter().map(|info| info.command_buffer).collect()
    }

    fn waits(&self) -> Vec<(vk::Semaphore, u64)> {
        let count = self.wait_semaphore_info_count;
        let all = unsafe { slice(self.p_wait_semaphore_infos, count) };
        all.iter().map(|info| (info.semaphore, info.value)).collect()
    }

    fn alone(&self, n: u32) -> Self {
        let mut one = *self;
        one.p_command_buffer_infos = self.p_command_buffer_infos.wrapping_add(n as usize);
        one.command_buffer_info_count = 1;
        if n > 0 {
            one.wait_semaphore_info_count = 0;
        }
        if n + 1 < self.command_buffer_info_count {
            one.signal_semaphore_info_count = 0;
        }
        one
    }
}

/// Whether a batch waits for a counter that nothing has moved that far yet.
fn waits_for_later(d: &Device, waits: &[(vk::Semaphore, u64)]) -> bool {
    let objects = d.objects();
    let counters: Vec<_> =
        waits.iter().filter(|(s, _)| objects.timelines.contains(&s.as_raw())).copied().collect();
    drop(objects);
    counters.into_iter().any(|(semaphore, wanted)| {
        let mut value = 0;
        let result: vk::Result = next!(d.table.counter, d.handle, semaphore, &mut value);
        result == vk::Result::SUCCESS && value < wanted
    })
}

/// A submission that is being made.
struct Plan {
    number: u64,
    events: Vec<Event>,
    short: bool,
}

/// Follows the layouts of images through a command buffer.
fn follow(objects: &mut Objects, buffer: u64) {
    let Some(commands) = objects.commands.get_mut(&buffer) else { return };
    let moves = std::mem::take(&mut commands.moves);
    for step in &moves {
        match step {
            Move::Layout(image, layout) => {
                if let Some(image) = objects.images.get_mut(image) {
                    image.layout = *layout;
                }
            }
            Move::Execute(all) => all.iter().for_each(|buffer| follow(objects, *buffer)),
        }
    }
    // It may be submitted again.
    if let Some(commands) = objects.commands.get_mut(&buffer) {
        commands.moves = moves;
    }
}

/// What command buffers do, secondaries in their places, and whether they wait for the host.
fn flatten(objects: &Objects, buffer: u64, steps: &mut Vec<Step>) {
    let own = objects.commands.get(&buffer).map(|c| c.steps.clone()).unwrap_or_default();
    for step in own {
        match step {
            Step::Execute(all) => all.iter().for_each(|b| flatten(objects, *b, steps)),
            step => steps.push(step),
        }
    }
}

const TWICE: &str = "its command buffer is run twice in one submission";

/// Draws that have the same number cannot be told apart: neither is used.
fn refuse_twins(events: &mut [Event]) {
    let (mut seen, mut twins) = (BTreeSet::new(), BTreeSet::new());
    for event in &*events {
        if let Event::Draw(draw) = event
            && draw.slot != u32::MAX
            && !seen.insert(draw.slot)
        {
            twins.insert(draw.slot);
        }
    }
    for event in events {
        if let Event::Draw(draw) = event
            && twins.contains(&draw.slot)
        {
            draw.refused = TWICE.into();
        }
    }
}

/// Gets ready to record a submission; `None` where it is not asked for.
fn prepare(
    d: &Device,
    recorder: &mut Recorder,
    queue: vk::Queue,
    buffers: &[vk::CommandBuffer],
    waits: &[(vk::Semaphore, u64)],
) -> Option<Plan> {
    let number = recorder.submission;
    recorder.submission += 1;
    let mut objects = d.objects();
    if !recorder.wants(number) || !d.resources.usable() {
        buffers.iter().for_each(|b| follow(&mut objects, b.as_raw()));
        return None;
    }
    drop(objects);
    settle_within(d, recorder);
    let mut steps = Vec::new();
    objects = d.objects();
    buffers.iter().for_each(|b| flatten(&objects, b.as_raw(), &mut steps));
    let mut short = false;
    let mut events = Vec::new();
    let (mut drawn, mut loaded) = (BTreeSet::new(), Vec::new());
    for step in steps {
        match step {
            Step::Event(event) => {
                if let Event::Pass(pass) = &event
                    && let Some(colour) = &pass.colour
                {
                    let load = colour.load == vk::AttachmentLoadOp::LOAD.as_raw();
                    if load && !recorder.known.contains(&colour.image) && drawn.insert(colour.image)
                    {
                        loaded.push(colour.image);
                    }
                    drawn.insert(colour.image);
                    // A resolve writes all of it.
                    drawn.extend(pass.resolve.as_ref().map(|r| r.image));
                }
                events.push(event);
            }
            Step::Waits => short = true,
            Step::Execute(_) => {}
        }
    }
    let images: Vec<Image> = loaded.iter().filter_map(|n| objects.images.get(n).cloned()).collect();
    buffers.iter().for_each(|b| follow(&mut objects, b.as_raw()));
    drop(objects);
    refuse_twins(&mut events);
    short |= waits_for_later(d, waits);
    if recorder.pending.is_empty() && recorder.in_flight == 0 {
        // What still runs would be recorded, too.
        let ready = drain(d, queue, if short { SHORT } else { PATIENCE });
        if ready {
            for image in &images {
                pictures::picture(d, recorder, queue, image, number, false);
            }
        }
    }
    recorder.known.extend(drawn);
    recorder.start(d);
    Some(Plan { number, events, short })
}

/// Writes what a submission left, once it has been run.
fn finish(d: &Device, recorder: &mut Recorder, queue: vk::Queue, plan: Plan, result: vk::Result) {
    recorder.in_flight -= 1;
    if result != vk::Result::SUCCESS {
        if recorder.pending.is_empty() && recorder.in_flight == 0 {
            d.resources.stop();
        }
        return;
    }
    tell(d, recorder, &plan.events);
    let Some(fence) = fence(d, queue) else {
        recorder.note("a submission cannot be waited for, and is not captured");
        return;
    };
    let Plan { number, events, short } = plan;
    recorder.pending.push(Pending { number, events, fence, short, queue });
    d.pending.store(true, Ordering::Release);
    settle_within(d, recorder);
}

/// Tells the log of what events name.
fn tell(d: &Device, recorder: &mut Recorder, events: &[Event]) {
    let objects = d.objects();
    for event in events {
        match event {
            Event::Pass(pass) => {
                for a in [&pass.colour, &pass.resolve, &pass.depth].into_iter().flatten() {
                    if let Some(image) = objects.images.get(&a.image) {
                        recorder.image(image.log());
                    }
                }
            }
            Event::Draw(draw) if !recorder.told(draw.pipeline) => {
                let mut all = objects.pipelines.values();
                if let Some(pipeline) = all.find(|p| p.number == draw.pipeline) {
                    recorder.pipeline(pipeline.log());
                }
            }
            Event::Write(write) => {
                if let Some(image) = objects.images.get(&write.image) {
                    recorder.image(image.log());
                }
            }
            Event::Draw(_) | Event::Clear(_) => {}
        }
    }
}

/// Waits for what is pending, and writes it where all of it is done.
fn settle_within(d: &Device, recorder: &mut Recorder) {
    let mut open = std::mem::take(&mut recorder.pending);
    let mut done = true;
    for pending in &mut open {
        if pending.fence.is_null() {
            continue;
        }
        if done && wait(d, pending.fence, if pending.short { SHORT } else { PATIENCE }) {
            pending.fence = vk::Fence::null();
        } else {
            done = false;
        }
    }
    recorder.pending = open;
    if !done || recorder.in_flight > 0 {
        return;
    }
    d.pending.store(false, Ordering::Release);
    let last = recorder.pending.last().map(|p| (p.number, p.queue));
    let drawn: BTreeSet<u64> = recorder.pending.iter().flat_map(|p| targets(&p.events)).collect();
    recorder.read_out(d);
    if let Some((number, queue)) = last
        && SETTINGS.pictures
    {
        for image in drawn {
            let image = d.objects().images.get(&image).cloned();
            if let Some(image) = image {
                pictures::picture(d, recorder, queue, &image, number, true);
            }
        }
    }
}

/// The images that events draw colours to.
fn targets(events: &[Event]) -> Vec<u64> {
    let passes = events.iter().filter_map(|event| match event {
        Event::Pass(pass) => Some(pass),
        _ => None,
    });
    passes.flat_map(|p| p.colour.iter().chain(&p.resolve).map(|a| a.image)).collect()
}

/// Writes what is pending where it is done, after the program has waited for something.
pub(crate) fn settle(d: &Device) {
    if d.pending.load(Ordering::Acquire) {
        settle_within(d, &mut d.recorder());
    }
}

/// Submits batches, recorded where they are asked for.
fn submit<B: Batch>(
    d: &Device,
    queue: vk::Queue,
    batches: &[B],
    fence: vk::Fence,
    next: impl Fn(&[B], vk::Fence) -> vk::Result,
) -> vk::Result {
    let record = |batches: &[B], fence: vk::Fence| {
        let plan = guard(|| {
            let buffers: Vec<_> = batches.iter().flat_map(Batch::command_buffers).collect();
            let waits: Vec<_> = batches.iter().flat_map(Batch::waits).collect();
            prepare(d, &mut d.recorder(), queue, &buffers, &waits)
        });
        let result = next(batches, fence);
        if let Some(plan) = plan.flatten() {
            guard(|| finish(d, &mut d.recorder(), queue, plan, result));
        }
        result
    };
    // A command buffer that comes twice would give its draws' numbers to two of each.
    let mut seen = BTreeSet::new();
    let mut all = batches.iter().flat_map(Batch::command_buffers);
    let once = all.all(|buffer| seen.insert(buffer.as_raw()));
    let wanted = guard(|| {
        let recorder = d.recorder();
        recorder.wants(recorder.submission)
    });
    if once || wanted != Some(true) {
        return record(batches, fence);
    }
    for (at, batch) in batches.iter().enumerate() {
        let n = batch.command_buffers().len() as u32;
        let parts: Vec<B> =
            if n < 2 { vec![*batch] } else { (0..n).map(|n| batch.alone(n)).collect() };
        for (part, one) in parts.iter().enumerate() {
            let last = at + 1 == batches.len() && part + 1 == parts.len();
            let result = record(&[*one], if last { fence } else { vk::Fence::null() });
            if result != vk::Result::SUCCESS {
                return result;
            }
        }
    }
    vk::Result::SUCCESS
}

pub(crate) unsafe extern "system" fn queue_submit(
    queue: vk::Queue,
    n: u32,
    batches: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let Some(d) = (unsafe { device(queue) }) else { return vk::Result::ERROR_DEVICE_LOST };
    submit(&d, queue, unsafe { slice(batches, n) }, fence, |batches, fence| {
        next!(d.table.submit, queue, batches.len() as u32, batches.as_ptr(), fence)
    })
}

pub(crate) unsafe extern "system" fn queue_submit2(
    queue: vk::Queue,
    n: u32,
    batches: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let Some(d) = (unsafe { device(queue) }) else { return vk::Result::ERROR_DEVICE_LOST };
    submit(&d, queue, unsafe { slice(batches, n) }, fence, |batches, fence| {
        next!(d.table.submit2, queue, batches.len() as u32, batches.as_ptr(), fence)
    })
}

pub(crate) unsafe extern "system" fn present(
    queue: vk::Queue,
    info: *const vk::PresentInfoKHR<'_>,
) -> vk::Result {
    let Some(d) = (unsafe { device(queue) }) else { return vk::Result::ERROR_DEVICE_LOST };
    guard(|| {
        let info = unsafe { &*info };
        let (swapchains, indices) = unsafe {
            let n = info.swapchain_count;
            (slice(info.p_swapchains, n), slice(info.p_image_indices, n))
        };
        let mut recorder = d.recorder();
        settle_within(&d, &mut recorder);
        let objects = d.objects();
        let image = |(swapchain, index): (&vk::SwapchainKHR, &u32)| {
            objects.swapchains.get(&swapchain.as_raw())?.images.get(*index as usize).copied()
        };
        let images = swapchains.iter().zip(indices).filter_map(image).collect();
        drop(objects);
        recorder.present(images);
        d.soon.store(recorder.soon(), Ordering::Release);
    });
    next!(d.table.present, queue, info)
}

/// Hooks of waits, after which what was pending may be done.
macro_rules! waits {
    ($($hook:ident: $next:ident, $handle:ident: $ht:ty, ($($argument:ident: $t:ty),*);)*) => {$(
        pub(crate) unsafe extern "system" fn $hook($handle: $ht, $($argument: $t),*) -> vk::Result {
            let Some(d) = (unsafe { device($handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
            let result = next!(d.table.$next, $handle, $($argument),*);
            guard(|| settle(&d));
            result
        }
    )*};
}

waits! {
    queue_wait_idle: queue_wait_idle, queue: vk::Queue, ();
    device_wait_idle: device_wait_idle, handle: vk::Device, ();
    wait_fences: wait_fences, handle: vk::Device,
        (n: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64);
    wait_semaphores: wait_semaphores, handle: vk::Device,
        (info: *const vk::SemaphoreWaitInfo<'_>, timeout: u64);
}

pub(crate) unsafe extern "system" fn create_semaphore(
    handle: vk::Device,
    info: *const vk::SemaphoreCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Semaphore,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_semaphore, handle, info, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            let s_type = vk::StructureType::SEMAPHORE_TYPE_CREATE_INFO;
            let kind = find::<vk::SemaphoreTypeCreateInfo<'_>>((*info).p_next, s_type);
            if kind.is_some_and(|kind| (*kind).semaphore_type == vk::SemaphoreType::TIMELINE) {
                d.objects().timelines.insert((*out).as_raw());
            }
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_semaphore(
    handle: vk::Device,
    semaphore: vk::Semaphore,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().timelines.remove(&semaphore.as_raw()));
    next!(d.table.destroy_semaphore, handle, semaphore, allocator)
}

pub(crate) unsafe extern "system" fn get_queue(
    handle: vk::Device,
    family: u32,
    n: u32,
    out: *mut vk::Queue,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    let () = next!(d.table.get_queue, handle, family, n, out);
    guard(|| d.objects().queues.insert(unsafe { (*out).as_raw() }, family));
}

pub(crate) unsafe extern "system" fn get_queue2(
    handle: vk::Device,
    info: *const vk::DeviceQueueInfo2<'_>,
    out: *mut vk::Queue,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    let () = next!(d.table.get_queue2, handle, info, out);
    let family = unsafe { (*info).queue_family_index };
    guard(|| d.objects().queues.insert(unsafe { (*out).as_raw() }, family));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Draw;

    #[test]
    fn draws_of_one_number_are_refused() {
        let draw = |slot| Event::Draw(Draw { slot, ..Draw::default() });
        let mut events = vec![draw(1), draw(2), draw(1), draw(u32::MAX), draw(u32::MAX)];
        refuse_twins(&mut events);
        let refused = events.iter().map(|e| matches!(e, Event::Draw(d) if d.refused == TWICE));
        assert_eq!(refused.collect::<Vec<_>>(), [true, false, true, false, false]);
    }
}
