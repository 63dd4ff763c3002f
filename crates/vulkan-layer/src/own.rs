//! What we submit ourselves: fences, and commands that copy or make visible.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use ash::vk::{self, Handle};

use crate::device::Device;
use crate::queues::{PATIENCE, Queue};
use crate::table::next;

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
