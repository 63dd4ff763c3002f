//! Queues: each is used by one call at a time, ours among the program's; and what we submit.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ash::vk::{self, Handle};

use crate::device::{Device, device};
use crate::guard;
use crate::table::next;

/// How long what is not known to wait for anything is waited for. Whatever takes longer is asked for
/// again later.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);
/// How long what may wait for something that the program does later.
pub(crate) const SHORT: Duration = Duration::from_millis(50);
/// How long for another thread to let a queue go.
const BRIEF: Duration = Duration::from_millis(20);

pub(crate) struct Queue {
    pub handle: vk::Queue,
    family: u32,
    lock: Mutex<()>,
    /// Submissions by the program, and how many of them are known to have been run.
    given: AtomicU64,
    done: AtomicU64,
    /// The last of them that may wait for what the program does later.
    late: AtomicU64,
    /// It was waited for in vain.
    stuck: AtomicBool,
}

impl Queue {
    fn new(handle: vk::Queue, family: u32) -> Self {
        let (given, done, late) = Default::default();
        Self { handle, family, lock: Mutex::new(()), given, done, late, stuck: false.into() }
    }

    /// One that was got in no way that is known: nothing is submitted to it but by the program.
    pub(crate) fn unknown(handle: vk::Queue) -> Self {
        Self::new(handle, vk::QUEUE_FAMILY_IGNORED)
    }

    /// The queue for one call of the program.
    pub(crate) fn hold(&self) -> MutexGuard<'_, ()> {
        self.lock.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The queue for a call of ours. The program may be waiting in a call of its own for what we
    /// keep it from: then we do without.
    fn try_hold(&self) -> Option<MutexGuard<'_, ()>> {
        let until = Instant::now() + BRIEF;
        loop {
            match self.lock.try_lock() {
                Ok(held) => return Some(held),
                Err(std::sync::TryLockError::Poisoned(held)) => return Some(held.into_inner()),
                Err(_) if Instant::now() > until => return None,
                Err(_) => std::thread::yield_now(),
            }
        }
    }

    /// The program submits something.
    pub(crate) fn give(&self, late: bool) -> u64 {
        let n = self.given.fetch_add(1, Ordering::AcqRel) + 1;
        if late {
            self.late.fetch_max(n, Ordering::AcqRel);
        }
        n
    }

    pub(crate) fn given(&self) -> u64 {
        self.given.load(Ordering::Acquire)
    }

    /// What was given up to `n` has been run.
    pub(crate) fn pass(&self, n: u64) {
        self.done.fetch_max(n, Ordering::AcqRel);
        self.stuck.store(false, Ordering::Release);
    }

    /// Whether what it was given may wait for what comes later.
    pub(crate) fn late(&self) -> bool {
        self.late.load(Ordering::Acquire) > self.done.load(Ordering::Acquire)
    }

    /// How long to wait for it.
    pub(crate) fn patience(&self) -> Duration {
        match () {
            () if self.stuck.load(Ordering::Acquire) => Duration::ZERO,
            () if self.late() => SHORT,
            () => PATIENCE,
        }
    }

    pub(crate) fn stick(&self) {
        self.stuck.store(true, Ordering::Release);
    }

    /// Waits for all that it was given; says whether it is done.
    pub(crate) fn drain(&self, d: &Device) -> bool {
        let n = self.given();
        if self.done.load(Ordering::Acquire) == n {
            return true;
        }
        let Some(fence) = fence(d, self, &[]) else { return false };
        match wait(d, &fence, self.patience()) {
            Waited::Done => self.pass(n),
            Waited::NotYet => self.stick(),
            Waited::Failed => {}
        }
        self.done.load(Ordering::Acquire) >= n
    }
}

/// What became of a wait.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Waited {
    Done,
    NotYet,
    Failed,
}

/// Fences and command pools of our own.
#[derive(Default)]
pub(crate) struct Own {
    /// All there are until the device goes; one that nobody else holds is used again.
    fences: Vec<Arc<vk::Fence>>,
    pools: BTreeMap<u32, Pool>,
}

#[derive(Clone, Copy)]
struct Pool {
    pool: vk::CommandPool,
    /// Makes what was written visible to the host.
    visible: vk::CommandBuffer,
}

impl Own {
    fn fence(&mut self, d: &Device) -> Option<Arc<vk::Fence>> {
        let free = self.fences.iter().find(|fence| {
            Arc::strong_count(fence) == 1 && {
                let status: vk::Result = next!(d.table.fence_status, d.handle, ***fence);
                status == vk::Result::SUCCESS
            }
        });
        if let Some(fence) = free {
            let result: vk::Result = next!(d.table.reset_fences, d.handle, 1, &**fence);
            return (result == vk::Result::SUCCESS).then(|| fence.clone());
        }
        let mut fence = vk::Fence::null();
        let info = vk::FenceCreateInfo::default();
        let null = std::ptr::null();
        let result: vk::Result = next!(d.table.create_fence, d.handle, &info, null, &mut fence);
        result.result().ok()?;
        self.fences.push(Arc::new(fence));
        self.fences.last().cloned()
    }

    fn pool(&mut self, d: &Device, family: u32) -> Option<Pool> {
        if family == vk::QUEUE_FAMILY_IGNORED {
            return None;
        }
        if let Some(pool) = self.pools.get(&family) {
            return Some(*pool);
        }
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
        let (mut pool, null) = (vk::CommandPool::null(), std::ptr::null());
        let result: vk::Result =
            next!(d.table.create_command_pool, d.handle, &info, null, &mut pool);
        result.result().ok()?;
        let made = buffer(d, pool).and_then(|visible| {
            let usage = vk::CommandBufferUsageFlags::SIMULTANEOUS_USE;
            record(d, visible, usage, || to_host(d, visible)).map(|()| visible)
        });
        match made {
            Ok(visible) => {
                let made = Pool { pool, visible };
                self.pools.insert(family, made);
                Some(made)
            }
            Err(_) => {
                let () = next!(d.table.destroy_command_pool, d.handle, pool, null);
                None
            }
        }
    }

    pub(crate) fn destroy(&mut self, d: &Device) {
        let null = std::ptr::null();
        for fence in self.fences.drain(..) {
            let () = next!(d.table.destroy_fence, d.handle, *fence, null);
        }
        for pool in std::mem::take(&mut self.pools).into_values() {
            let () = next!(d.table.destroy_command_pool, d.handle, pool.pool, null);
        }
    }
}

/// A command buffer of our own.
fn buffer(d: &Device, pool: vk::CommandPool) -> Result<vk::CommandBuffer, vk::Result> {
    let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    let mut buffer = vk::CommandBuffer::null();
    let result: vk::Result = next!(d.table.allocate_command_buffers, d.handle, &info, &mut buffer);
    result.result()?;
    if let Some(set) = d.set_loader_data {
        let result = unsafe { set(d.handle, buffer.as_raw() as *mut _) };
        result.result()?;
    }
    Ok(buffer)
}

fn record(
    d: &Device,
    buffer: vk::CommandBuffer,
    usage: vk::CommandBufferUsageFlags,
    what: impl FnOnce(),
) -> Result<(), vk::Result> {
    let info = vk::CommandBufferBeginInfo::default().flags(usage);
    let result: vk::Result = next!(d.table.begin, buffer, &info);
    result.result()?;
    what();
    let result: vk::Result = next!(d.table.end, buffer);
    result.result()
}

fn to_host(d: &Device, buffer: vk::CommandBuffer) {
    use vk::PipelineStageFlags as Stage;
    let memory = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ);
    let (none, null, images) = (vk::DependencyFlags::empty(), std::ptr::null(), std::ptr::null());
    let (from, to) = (Stage::ALL_COMMANDS, Stage::HOST);
    next!(d.table.barrier, buffer, from, to, none, 1, &memory, 0, null, 0, images)
}

/// A fence that follows all that a queue has been given, and `buffers`; what they wrote is visible
/// to the host by then.
pub(crate) fn fence(
    d: &Device,
    queue: &Queue,
    buffers: &[vk::CommandBuffer],
) -> Option<Arc<vk::Fence>> {
    let (fence, visible) = {
        let mut own = d.own();
        (own.fence(d)?, own.pool(d, queue.family))
    };
    let mut buffers = buffers.to_vec();
    buffers.extend(visible.map(|pool| pool.visible));
    let info = vk::SubmitInfo::default().command_buffers(&buffers);
    let n = u32::from(!buffers.is_empty());
    let _held = queue.try_hold()?;
    let result: vk::Result = next!(d.table.submit, queue.handle, n, &info, *fence);
    (result == vk::Result::SUCCESS).then_some(fence)
}

pub(crate) fn wait(d: &Device, fence: &vk::Fence, patience: Duration) -> Waited {
    let nanoseconds = patience.as_nanos() as u64;
    let result: vk::Result = next!(d.table.wait_fences, d.handle, 1, fence, vk::TRUE, nanoseconds);
    match result {
        vk::Result::SUCCESS => Waited::Done,
        vk::Result::TIMEOUT => Waited::NotYet,
        _ => Waited::Failed,
    }
}

/// Runs commands of our own on a queue and waits for them. Where they take too long, the command
/// buffer stays until the device goes, and `Waited::NotYet` says so.
pub(crate) fn run(
    d: &Device,
    queue: &Queue,
    commands: impl FnOnce(vk::CommandBuffer),
) -> Result<Waited, vk::Result> {
    let pool = d.own().pool(d, queue.family).ok_or(vk::Result::ERROR_INITIALIZATION_FAILED)?.pool;
    let buffer = buffer(d, pool)?;
    let usage = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
    let waited = record(d, buffer, usage, || commands(buffer)).map(|()| {
        fence(d, queue, &[buffer]).map_or(Waited::Failed, |fence| wait(d, &fence, PATIENCE))
    });
    if waited != Ok(Waited::NotYet) {
        let () = next!(d.table.free_command_buffers, d.handle, pool, 1, &buffer);
    }
    waited
}

/// Waits for all queues; says whether all are done.
pub(crate) fn drain_all(d: &Device) -> bool {
    let open = d.all_queues().iter().filter(|queue| !queue.drain(d)).count();
    open == 0
}

fn enter(d: &Device, handle: vk::Queue, family: u32) {
    guard(|| {
        let mut queues = d.queues.write().unwrap_or_else(PoisonError::into_inner);
        let made = || Arc::new(Queue::new(handle, family));
        queues.entry(handle.as_raw()).or_insert_with(made);
    });
}

pub(crate) unsafe extern "system" fn get_queue(
    handle: vk::Device,
    family: u32,
    n: u32,
    out: *mut vk::Queue,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    let () = next!(d.table.get_queue, handle, family, n, out);
    enter(&d, unsafe { *out }, family);
}

pub(crate) unsafe extern "system" fn get_queue2(
    handle: vk::Device,
    info: *const vk::DeviceQueueInfo2<'_>,
    out: *mut vk::Queue,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    let () = next!(d.table.get_queue2, handle, info, out);
    enter(&d, unsafe { *out }, unsafe { (*info).queue_family_index });
}

/// Hooks of debug labels on queues, which are uses of them.
macro_rules! labels {
    ($($hook:ident: $next:ident, ($($argument:ident: $t:ty),*);)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(queue: vk::Queue, $($argument: $t),*) {
            let Some(d) = (unsafe { device(queue) }) else { return };
            let known = d.queue(queue);
            let _held = known.hold();
            next!(d.table.$next, queue, $($argument),*)
        }
    )*};
}

labels! {
    begin_label: queue_begin_label, (label: *const vk::DebugUtilsLabelEXT<'_>);
    end_label: queue_end_label, ();
    insert_label: queue_insert_label, (label: *const vk::DebugUtilsLabelEXT<'_>);
}
