//! Submissions, presentations, and what programs wait for.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::batches::Batch;
use crate::device::{Device, device};
use crate::guard;
use crate::pending::{finish, pass_by, prepare, settle};
use crate::queues::Queue;
use crate::table::next;

/// How long our own fence may come after the program's.
const MOMENT: Duration = Duration::from_millis(1);

/// Submits batches, recorded where they are asked for.
fn submit<B: Batch>(
    d: &Device,
    queue: vk::Queue,
    batches: &[B],
    fence: vk::Fence,
    next: impl Fn(&[B], vk::Fence) -> vk::Result,
) -> vk::Result {
    let queue = d.queue(queue);
    let next = |batches: &[B], fence| {
        let _held = queue.hold();
        next(batches, fence)
    };
    if d.over() || !d.at_home() {
        return next(batches, fence);
    }
    let record = |batches: &[B], fence: vk::Fence| {
        let (late, plan) = guard(|| prepare(d, &queue, batches)).unwrap_or_default();
        let result = next(batches, fence);
        queue.give(late);
        if let Some(plan) = plan {
            guard(|| finish(d, &queue, plan, result));
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
    if once || wanted != Some(true) || !batches.iter().all(Batch::divisible) {
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

pub(crate) unsafe extern "system" fn bind_sparse(
    queue: vk::Queue,
    n: u32,
    batches: *const vk::BindSparseInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let Some(d) = (unsafe { device(queue) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let known = d.queue(queue);
    let late = guard(|| !d.over() && pass_by(&d, &known, unsafe { slice(batches, n) }));
    let _held = known.hold();
    let result = next!(d.table.bind_sparse, queue, n, batches, fence);
    known.give(late == Some(true));
    result
}

pub(crate) unsafe extern "system" fn present(
    queue: vk::Queue,
    info: *const vk::PresentInfoKHR<'_>,
) -> vk::Result {
    let Some(d) = (unsafe { device(queue) }) else { return vk::Result::ERROR_DEVICE_LOST };
    if !d.over() {
        guard(|| frame_ends(&d, unsafe { &*info }));
    }
    let known = d.queue(queue);
    let _held = known.hold();
    next!(d.table.present, queue, info)
}

fn frame_ends(d: &Device, info: &vk::PresentInfoKHR<'_>) {
    let (swapchains, indices) = unsafe {
        let n = info.swapchain_count;
        (slice(info.p_swapchains, n), slice(info.p_image_indices, n))
    };
    settle(d, None);
    let mut recorder = d.recorder();
    let mut objects = d.objects();
    let image = |(swapchain, index): (&vk::SwapchainKHR, &u32)| {
        objects.swapchains.get(&swapchain.as_raw())?.images.get(*index as usize).copied()
    };
    let images: Vec<u64> = swapchains.iter().zip(indices).filter_map(image).collect();
    for number in &images {
        if let Some(image) = objects.images.get_mut(number) {
            image.acquired = false;
        }
    }
    drop(objects);
    recorder.present(images);
    d.look(&recorder);
}

/// Hooks of waits, after which what was pending may be done.
macro_rules! waits {
    ($($hook:ident: $next:ident, |$d:ident| $held:expr, $handle:ident: $ht:ty,
       ($($argument:ident: $t:ty),*);)*) => {$(
        pub(crate) unsafe extern "system" fn $hook($handle: $ht, $($argument: $t),*) -> vk::Result {
            let Some($d) = (unsafe { device($handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
            let result = {
                let known: Vec<Arc<Queue>> = $held;
                let _held: Vec<_> = known.iter().map(|queue| queue.hold()).collect();
                next!($d.table.$next, $handle, $($argument),*)
            };
            let done = result == vk::Result::SUCCESS;
            guard(|| settle(&$d, Some(if done { MOMENT } else { Duration::ZERO })));
            result
        }
    )*};
}

waits! {
    queue_wait_idle: queue_wait_idle, |d| vec![d.queue(queue)], queue: vk::Queue, ();
    device_wait_idle: device_wait_idle, |d| d.all_queues(), handle: vk::Device, ();
    wait_fences: wait_fences, |d| Vec::new(), handle: vk::Device,
        (n: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64);
    fence_status: fence_status, |d| Vec::new(), handle: vk::Device, (fence: vk::Fence);
    wait_semaphores: wait_semaphores, |d| Vec::new(), handle: vk::Device,
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
            use vk::StructureType as S;
            let next = (*info).p_next;
            let kind = find::<vk::SemaphoreTypeCreateInfo<'_>>(next, S::SEMAPHORE_TYPE_CREATE_INFO);
            let timeline = kind.is_some_and(|k| (*k).semaphore_type == vk::SemaphoreType::TIMELINE);
            let foreign =
                find::<vk::ExportSemaphoreCreateInfo<'_>>(next, S::EXPORT_SEMAPHORE_CREATE_INFO)
                    .is_some();
            let mut objects = d.objects();
            let semaphore = objects.semaphores.entry((*out).as_raw()).or_default();
            (semaphore.timeline, semaphore.foreign) = (timeline, foreign);
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
    guard(|| d.objects().semaphores.remove(&semaphore.as_raw()));
    next!(d.table.destroy_semaphore, handle, semaphore, allocator)
}

/// What another process signals may come at any time.
pub(crate) unsafe extern "system" fn import_semaphore(
    handle: vk::Device,
    info: *const vk::ImportSemaphoreFdInfoKHR<'_>,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    guard(|| {
        let semaphore = unsafe { (*info).semaphore }.as_raw();
        d.objects().semaphores.entry(semaphore).or_default().foreign = true;
    });
    next!(d.table.import_semaphore, handle, info)
}
