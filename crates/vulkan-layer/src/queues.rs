//! Queues: each is used by one call at a time, ours among the program's.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ash::vk::{self, Handle};

use crate::device::{Device, device};
use crate::guard;
use crate::own::{Waited, fence, wait};
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
    pub family: u32,
    lock: Mutex<()>,
    /// Submissions by the program, and how many of them are known to have been run.
    given: AtomicU64,
    done: AtomicU64,
    /// The last of them that may wait for what the program does later.
    late: AtomicU64,
    /// It was waited for in vain.
    stuck: AtomicBool,
    /// A fence that was, and what it follows.
    open: Mutex<Option<(Arc<vk::Fence>, u64)>>,
}

impl Queue {
    fn new(handle: vk::Queue, family: u32) -> Self {
        let (lock, given, done, late, stuck, open) = Default::default();
        Self { handle, family, lock, given, done, late, stuck, open }
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
    pub(crate) fn try_hold(&self) -> Option<MutexGuard<'_, ()>> {
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
        // One wait in vain at a time: else fences would pile up.
        let open = self.open().take();
        if let Some((fence, n)) = open
            && !self.drained(d, fence, n)
        {
            return false;
        }
        let n = self.given();
        if self.done.load(Ordering::Acquire) == n {
            return true;
        }
        fence(d, self, &[]).is_some_and(|fence| self.drained(d, fence, n))
    }

    /// Whether a fence says that what was given up to `n` is done.
    fn drained(&self, d: &Device, fence: Arc<vk::Fence>, n: u64) -> bool {
        let waited = wait(d, &fence, self.patience());
        match waited {
            Waited::Done => self.pass(n),
            Waited::NotYet => {
                self.stick();
                *self.open() = Some((fence, n));
            }
            Waited::Failed => {}
        }
        waited == Waited::Done
    }

    fn open(&self) -> MutexGuard<'_, Option<(Arc<vk::Fence>, u64)>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
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
