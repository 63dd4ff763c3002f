//! Submissions that are asked for: made ready, waited for, written when they have been run.
//!
//! What waits for something that the program does only later cannot be waited for here. So nobody
//! waits long where that may be, and never with a lock held: such a submission stays pending, and is
//! looked at again whenever the program has waited for something.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use ash::vk::{self, Handle};

use crate::batches::Batch;
use crate::device::{Device, SETTINGS};
use crate::log::Event;
use crate::objects::Image;
use crate::own::{Waited, fence, wait};
use crate::pictures::picture;
use crate::queues::{Queue, drain_all};
use crate::recorder::{Pending, Recorder};
use crate::steps::{Run, follow, loaded, targets};
use crate::table::next;

/// A submission that is being made.
pub(crate) struct Plan {
    number: u64,
    run: Run,
}

/// What is known of the waits of a submission.
#[derive(Clone, Copy)]
struct Waits {
    /// It may wait for what the program does later.
    late: bool,
    /// It waits for nothing that is not done when all queues are.
    sure: bool,
}

/// Notes what batches that are not recorded wait for, and what waits for them. Says whether it may
/// come only later.
pub(crate) fn pass_by<B: Batch>(d: &Device, queue: &Queue, batches: &[B]) -> bool {
    account(d, queue, batches).late
}

fn account<B: Batch>(d: &Device, queue: &Queue, batches: &[B]) -> Waits {
    let mut objects = d.objects();
    let mut all = batches.iter().flat_map(Batch::command_buffers);
    let waits = all.any(|b| objects.commands.get(&b.as_raw()).is_some_and(|c| c.waits));
    let mut waits = Waits { late: queue.late() || waits, sure: true };
    let mut counters = Vec::new();
    for (handle, value) in batches.iter().flat_map(Batch::waits) {
        let semaphore = objects.semaphores.entry(handle.as_raw()).or_default();
        if semaphore.timeline {
            counters.push((handle, value));
        } else {
            waits.late |= semaphore.late || semaphore.foreign;
            waits.sure &= semaphore.signalled && !semaphore.foreign;
            (semaphore.signalled, semaphore.late) = (false, false);
        }
    }
    drop(objects);
    for (semaphore, wanted) in counters {
        let mut value = 0;
        let result: vk::Result = next!(d.table.counter, d.handle, semaphore, &mut value);
        let reached = result == vk::Result::SUCCESS && value >= wanted;
        waits.late |= !reached;
        waits.sure &= reached;
    }
    let mut objects = d.objects();
    for handle in batches.iter().flat_map(Batch::signals) {
        let semaphore = objects.semaphores.entry(handle.as_raw()).or_default();
        (semaphore.signalled, semaphore.late) = (true, waits.late);
    }
    waits
}

/// Gets ready for a submission: says whether it may wait for what comes later, and gives a plan where
/// it is asked for.
pub(crate) fn prepare<B: Batch>(d: &Device, queue: &Queue, batches: &[B]) -> (bool, Option<Plan>) {
    let buffers: Vec<_> = batches.iter().flat_map(Batch::command_buffers).collect();
    let (number, wanted) = {
        let mut recorder = d.recorder();
        let number = recorder.submission;
        recorder.submission += 1;
        (number, recorder.wants(number))
    };
    if !wanted {
        let mut objects = d.objects();
        buffers.iter().for_each(|b| follow(&mut objects, b.as_raw()));
        drop(objects);
        return (pass_by(d, queue, batches), None);
    }
    settle(d, None);
    // What still runs would be recorded, too.
    let quiet = drain_all(d);
    let waits = account(d, queue, batches);
    let mut recorder = d.recorder();
    let mut objects = d.objects();
    let mut run = Run::default();
    buffers.iter().for_each(|b| run.add(&objects, b.as_raw()));
    let before = loaded(&run.events).into_iter().filter(|n| !recorder.known.contains(n));
    let before: Vec<Image> = before.filter_map(|n| objects.images.get(&n).cloned()).collect();
    buffers.iter().for_each(|b| follow(&mut objects, b.as_raw()));
    drop(objects);
    if quiet && waits.sure && recorder.pending.is_empty() && recorder.in_flight == 0 {
        before.iter().for_each(|image| picture(d, &mut recorder, queue, image, number, false));
    }
    recorder.known.extend(targets(&run.events));
    if run.plain {
        recorder.note("some command buffers were recorded before the capture was to begin");
    }
    recorder.start(d, quiet);
    (waits.late, Some(Plan { number, run }))
}

/// Writes what a submission left, once it has been run.
pub(crate) fn finish(d: &Device, queue: &Arc<Queue>, plan: Plan, result: vk::Result) {
    let mut recorder = d.recorder();
    recorder.in_flight -= 1;
    let alone = recorder.pending.is_empty() && recorder.in_flight == 0;
    if result != vk::Result::SUCCESS {
        if alone {
            d.resources.stop();
        }
        return;
    }
    tell(d, &mut recorder, &plan.run);
    let given = queue.given();
    let Some(fence) = fence(d, queue, &[]) else {
        recorder.note("a submission cannot be waited for, and is not captured");
        if alone {
            d.resources.stop();
        }
        return;
    };
    let frame = recorder.frame;
    recorder.pending.push(Pending {
        number: plan.number,
        frame,
        events: plan.run.events,
        fence: Some(fence),
        queue: queue.clone(),
        given,
    });
    d.pending.store(true, Ordering::Release);
    drop(recorder);
    settle(d, None);
}

/// Tells the log of what events name.
fn tell(d: &Device, recorder: &mut Recorder, run: &Run) {
    for pipeline in run.pipelines.values().filter(|p| !p.refused.is_empty()) {
        pipeline.warn(recorder);
    }
    run.pipelines.values().for_each(|pipeline| recorder.pipeline(pipeline.log()));
    let objects = d.objects();
    let mut image = |number: u64| {
        if let Some(image) = objects.images.get(&number) {
            recorder.image(image.log());
        }
    };
    for event in &run.events {
        match event {
            Event::Pass(pass) => {
                let all = [&pass.colour, &pass.resolve, &pass.depth].into_iter().flatten();
                all.for_each(|a| image(a.image));
            }
            Event::Write(write) => image(write.image),
            Event::Draw(_) | Event::Clear(_) => {}
        }
    }
}

/// Writes what is pending where all of it is done. Waits for each as long as `most` says, or where it
/// says nothing, as long as is good for its queue.
pub(crate) fn settle(d: &Device, most: Option<Duration>) {
    if !d.pending.load(Ordering::Acquire) || !d.at_home() {
        return;
    }
    loop {
        let open =
            d.recorder().pending.iter().find_map(|p| {
                p.fence.clone().map(|fence| (p.number, p.given, fence, p.queue.clone()))
            });
        let Some((number, given, fence, queue)) = open else { break };
        match wait(d, &fence, most.unwrap_or_else(|| queue.patience())) {
            Waited::Done => {
                queue.pass(given);
                let mut recorder = d.recorder();
                let done = recorder.pending.iter_mut().find(|p| p.number == number);
                if let Some(done) = done {
                    done.fence = None;
                }
            }
            Waited::NotYet => {
                if most.is_none() {
                    queue.stick();
                }
                return;
            }
            Waited::Failed => {
                let mut recorder = d.recorder();
                recorder.give_up("the device was lost; nothing more of it is captured");
                d.pending.store(false, Ordering::Release);
                return d.look(&recorder);
            }
        }
    }
    read_out(d, &mut d.recorder());
}

/// Writes what is pending if nothing of it is still running.
fn read_out(d: &Device, recorder: &mut Recorder) {
    let open = recorder.pending.iter().any(|p| p.fence.is_some());
    if open || recorder.in_flight > 0 || recorder.pending.is_empty() {
        return;
    }
    d.pending.store(false, Ordering::Release);
    let last = recorder.pending.iter().map(|p| p.number).max().unwrap_or_default();
    let mut drawn = BTreeMap::new();
    for pending in &recorder.pending {
        drawn.extend(targets(&pending.events).map(|image| (image, pending.queue.clone())));
    }
    let over = recorder.over();
    recorder.read_out(d);
    d.objects().slots.release();
    if SETTINGS.pictures && !over {
        for (image, queue) in drawn {
            let image = d.objects().images.get(&image).cloned();
            if let Some(image) = image {
                picture(d, recorder, &queue, &image, last, true);
            }
        }
    }
    d.look(recorder);
}
