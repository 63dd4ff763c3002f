//! What programs submit, in both versions of its structure.

use ash::vk;

use crate::abi::{find, slice};

/// One of the program's batches of command buffers.
pub(crate) trait Batch: Copy {
    fn command_buffers(&self) -> Vec<vk::CommandBuffer>;
    /// Semaphores that it waits for, with the value where they hold a counter.
    fn waits(&self) -> Vec<(vk::Semaphore, u64)>;
    fn signals(&self) -> Vec<vk::Semaphore>;
    /// Whether its command buffers can be submitted one by one.
    fn divisible(&self) -> bool;
    /// The batch with its `n`th command buffer alone; what it waits for goes with the first, what it
    /// signals with the last.
    fn alone(&self, n: u32) -> Self;
}

/// `Batch::alone` by the names of what a structure has of command buffers, waits and signals.
macro_rules! alone {
    ($buffers:ident, $n:ident, $waits:ident, $signals:ident) => {
        fn alone(&self, n: u32) -> Self {
            let mut one = *self;
            one.$buffers = self.$buffers.wrapping_add(n as usize);
            one.$n = 1;
            if n > 0 {
                one.$waits = 0;
            }
            if n + 1 < self.$n {
                one.$signals = 0;
            }
            one
        }
    };
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

    fn signals(&self) -> Vec<vk::Semaphore> {
        unsafe { slice(self.p_signal_semaphores, self.signal_semaphore_count).to_vec() }
    }

    fn divisible(&self) -> bool {
        // It names devices for each command buffer.
        let group = vk::StructureType::DEVICE_GROUP_SUBMIT_INFO;
        unsafe { find::<vk::DeviceGroupSubmitInfo<'_>>(self.p_next, group) }.is_none()
    }

    alone!(p_command_buffers, command_buffer_count, wait_semaphore_count, signal_semaphore_count);
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

    fn signals(&self) -> Vec<vk::Semaphore> {
        let count = self.signal_semaphore_info_count;
        let all = unsafe { slice(self.p_signal_semaphore_infos, count) };
        all.iter().map(|info| info.semaphore).collect()
    }

    fn divisible(&self) -> bool {
        true
    }

    alone!(
        p_command_buffer_infos,
        command_buffer_info_count,
        wait_semaphore_info_count,
        signal_semaphore_info_count
    );
}

impl Batch for vk::BindSparseInfo<'_> {
    fn command_buffers(&self) -> Vec<vk::CommandBuffer> {
        Vec::new()
    }

    fn waits(&self) -> Vec<(vk::Semaphore, u64)> {
        let all = unsafe { slice(self.p_wait_semaphores, self.wait_semaphore_count) };
        // Of a counter: it may be any.
        all.iter().map(|semaphore| (*semaphore, u64::MAX)).collect()
    }

    fn signals(&self) -> Vec<vk::Semaphore> {
        unsafe { slice(self.p_signal_semaphores, self.signal_semaphore_count).to_vec() }
    }

    fn divisible(&self) -> bool {
        false
    }

    fn alone(&self, _: u32) -> Self {
        *self
    }
}
