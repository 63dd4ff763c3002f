//! Buffers of our own that the host sees, and whether memory of the program's can be written.

use std::fs;

use ash::vk;

use crate::table::{DeviceTable, next};

/// A buffer that is mapped for as long as it lives. Null until it is made.
pub(crate) struct Buffer {
    pub handle: vk::Buffer,
    memory: vk::DeviceMemory,
    /// Its first byte.
    pub bytes: *mut u8,
    pub size: u64,
    /// Where shaders find it, where it was made to have an address.
    pub address: u64,
}

// What is behind the pointer is reached under the recorder's lock alone.
unsafe impl Send for Buffer {}
unsafe impl Sync for Buffer {}

impl Default for Buffer {
    fn default() -> Self {
        Self {
            handle: vk::Buffer::null(),
            memory: vk::DeviceMemory::null(),
            bytes: std::ptr::null_mut(),
            size: 0,
            address: 0,
        }
    }
}

impl Buffer {
    pub(crate) fn new(
        device: vk::Device,
        table: &DeviceTable,
        types: &vk::PhysicalDeviceMemoryProperties,
        size: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, vk::Result> {
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let mut handle = vk::Buffer::null();
        let result: vk::Result =
            next!(table.create_buffer, device, &info, std::ptr::null(), &mut handle);
        result.result()?;
        let mut this = Self { handle, size, ..Self::default() };
        match this.back(device, table, types, usage) {
            Ok(()) => Ok(this),
            Err(result) => {
                this.destroy(device, table);
                Err(result)
            }
        }
    }

    /// Puts memory behind it.
    fn back(
        &mut self,
        device: vk::Device,
        table: &DeviceTable,
        types: &vk::PhysicalDeviceMemoryProperties,
        usage: vk::BufferUsageFlags,
    ) -> Result<(), vk::Result> {
        use vk::MemoryPropertyFlags as Flags;
        let mut needs = vk::MemoryRequirements::default();
        let () = next!(table.buffer_requirements, device, self.handle, &mut needs);
        let seen = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        // What is cached is read a hundred times as fast.
        let kind = [seen | Flags::HOST_CACHED, seen].into_iter().find_map(|want| {
            (0..types.memory_type_count).find(|&i| {
                needs.memory_type_bits >> i & 1 == 1
                    && types.memory_types[i as usize].property_flags.contains(want)
            })
        });
        let kind = kind.ok_or(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)?;
        let addressed = usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);
        let mut flags = vk::MemoryAllocateFlagsInfo::default();
        let mut info =
            vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind);
        if addressed {
            flags.flags = vk::MemoryAllocateFlags::DEVICE_ADDRESS;
            info = info.push_next(&mut flags);
        }
        let null = std::ptr::null();
        let result: vk::Result = next!(table.allocate, device, &info, null, &mut self.memory);
        result.result()?;
        let result: vk::Result = next!(table.bind_buffer, device, self.handle, self.memory, 0);
        result.result()?;
        let mut at = std::ptr::null_mut();
        let none = vk::MemoryMapFlags::empty();
        let result: vk::Result =
            next!(table.map, device, self.memory, 0, vk::WHOLE_SIZE, none, &mut at);
        result.result()?;
        self.bytes = at.cast();
        if addressed {
            let info = vk::BufferDeviceAddressInfo::default().buffer(self.handle);
            self.address = next!(table.address, device, &info);
        }
        Ok(())
    }

    /// Its `n`th word.
    pub(crate) fn word(&self, n: usize) -> *mut u32 {
        debug_assert!((n as u64 + 1) * 4 <= self.size);
        unsafe { self.bytes.cast::<u32>().add(n) }
    }

    pub(crate) fn read(&self, n: usize) -> u32 {
        unsafe { self.word(n).read_volatile() }
    }

    pub(crate) fn write(&self, n: usize, value: u32) {
        unsafe { self.word(n).write_volatile(value) }
    }

    pub(crate) fn destroy(&self, device: vk::Device, table: &DeviceTable) {
        let null = std::ptr::null();
        let () = next!(table.destroy_buffer, device, self.handle, null);
        let () = next!(table.free_memory, device, self.memory, null);
    }
}

/// Whether `bytes` from `start` can be written, by the process's own map of its memory. Where there
/// is no such map, it is taken to be so: what is handed to Vulkan mostly lies on a stack.
pub(crate) fn writable(start: *const u8, bytes: usize) -> bool {
    let Ok(map) = fs::read_to_string("/proc/self/maps") else { return true };
    let (start, end) = (start as usize, start as usize + bytes);
    map.lines().any(|line| {
        let mut words = line.split(' ');
        let range = words.next().and_then(|r| r.split_once('-'));
        let Some((from, to)) = range else { return false };
        let number = |text| usize::from_str_radix(text, 16);
        let inside = number(from).is_ok_and(|f| f <= start) && number(to).is_ok_and(|t| end <= t);
        inside && words.next().is_some_and(|flags| flags.contains('w'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_cannot_be_written() {
        static CONSTANT: [u64; 4] = [1, 2, 3, 4];
        let mut variable = [0_u64; 4];
        variable[0] = CONSTANT[1];
        assert!(!writable(CONSTANT.as_ptr().cast(), 32));
        assert!(writable(variable.as_ptr().cast(), 32));
    }
}
