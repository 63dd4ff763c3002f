//! The memory that shaders write records to, and the descriptor set through which they reach it.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

use crate::device::Device;
use crate::instance::Physical;
use crate::log::RECORD_BYTES;
use crate::memory::Buffer;
use crate::settings::Settings;
use crate::spirv::HEADER_WORDS;
use crate::table::{DeviceTable, next};

/// Draws that can be told apart at a time: those of all command buffers that hold any, and one
/// number for all that are too many.
pub(crate) const SLOTS: u32 = 1 << 17;

/// Words of the header (`spirv`).
const COUNT: usize = 0;
const CAPACITY: usize = 1;
const ENABLED: usize = 2;
const ADDRESS: usize = 4;

const HEADER_BYTES: u64 = HEADER_WORDS as u64 * 4;

/// Words of a record, and which of them is the slot.
const WORDS: usize = RECORD_BYTES / 4;
const SLOT: usize = 1;

/// Records that there is room for before any are asked for.
const FEW: u64 = 64;

/// What is bound for each draw.
pub(crate) struct Resources {
    made: Option<Made>,
}

/// All that there is, null where it could not be made.
#[derive(Default)]
struct Made {
    /// The header; the records behind it where they have no address.
    header: Buffer,
    /// The records, where they have an address: the last of these. Command buffers that run may
    /// still have that of one before, so that none goes before the device.
    data: Option<Mutex<Vec<Buffer>>>,
    /// Records asked for.
    wanted: u64,
    slots: Buffer,
    stride: u32,
    layout: vk::DescriptorSetLayout,
    /// Of a set that holds nothing, for the places between the program's and ours.
    empty: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
}

/// What of a device's limits our set takes.
pub(crate) const KINDS: [vk::DescriptorType; 2] =
    [vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC, vk::DescriptorType::STORAGE_BUFFER];

impl Resources {
    /// Where nothing can be recorded.
    pub(crate) fn none() -> Self {
        Self { made: None }
    }

    pub(crate) fn new(
        device: vk::Device,
        table: &DeviceTable,
        facts: &Physical,
        address: bool,
        settings: &Settings,
    ) -> Result<Self, String> {
        let mut made = Made { wanted: settings.capacity.max(1), ..Made::default() };
        match made.fill(device, table, facts, address) {
            Ok(()) => Ok(Self { made: Some(made) }),
            Err((what, result)) => {
                made.destroy(device, table);
                Err(format!("{what}: {result}"))
            }
        }
    }

    /// Whether draws can be recorded.
    pub(crate) fn usable(&self) -> bool {
        self.made.is_some()
    }

    /// Whether records lie where an address says.
    pub(crate) fn address(&self) -> bool {
        self.made.as_ref().is_some_and(|made| made.data.is_some())
    }

    /// The layouts of our set and of an empty one.
    pub(crate) fn layouts(&self) -> Option<[vk::DescriptorSetLayout; 2]> {
        self.made.as_ref().map(|made| [made.layout, made.empty])
    }

    /// Our set, and the offset at which it says the number of a draw.
    pub(crate) fn bind(&self, slot: u32) -> Option<(vk::DescriptorSet, u32)> {
        let made = self.made.as_ref()?;
        let offset = slot * made.stride;
        made.slots.write(offset as usize / 4, slot);
        Some((made.set, offset))
    }

    /// Records that there will be room for.
    pub(crate) fn capacity(&self) -> u64 {
        self.made.as_ref().map_or(0, |made| match made.data {
            Some(_) => made.wanted,
            None => made.capacity(),
        })
    }

    /// Has shaders record from now on. Where no command is running, the memory asked for is got
    /// first.
    pub(crate) fn start(&self, device: &Device, quiet: bool) {
        let Some(made) = &self.made else { return };
        if quiet && made.data.is_some() && made.capacity() < made.wanted {
            made.resize(device, made.wanted);
        }
        made.header.write(COUNT, 0);
        made.header.write(ENABLED, 1);
    }

    pub(crate) fn stop(&self) {
        if let Some(made) = &self.made {
            made.header.write(ENABLED, 0);
        }
    }

    /// Records that there would be with memory enough, and those that there are.
    pub(crate) fn counted(&self) -> (u64, u64) {
        self.made.as_ref().map_or((0, 0), |made| {
            let needed = u64::from(made.header.read(COUNT));
            (needed, needed.min(made.capacity()))
        })
    }

    /// Writes those of the first `n` records that belong to `slots`, and says how many do not: a
    /// submission that nobody asked for may have run meanwhile.
    pub(crate) fn write_to(
        &self,
        file: &mut File,
        n: u64,
        slots: &BTreeSet<u32>,
    ) -> std::io::Result<u64> {
        let Some(made) = &self.made else { return Ok(0) };
        let mut known = vec![false; SLOTS as usize];
        slots.iter().filter(|s| **s < SLOTS).for_each(|s| known[*s as usize] = true);
        let mut write = |buffer: &Buffer, from: u64| {
            // SAFETY: there are as many records, and no shader writes to them any more.
            let rows: &[[u32; WORDS]] = unsafe {
                std::slice::from_raw_parts(buffer.bytes.add(from as usize).cast(), n as usize)
            };
            let (mut start, mut dropped) = (0, 0);
            for (at, row) in rows.iter().enumerate() {
                if known.get(row[SLOT] as usize) != Some(&true) {
                    file.write_all(bytes(&rows[start..at]))?;
                    (start, dropped) = (at + 1, dropped + 1);
                }
            }
            file.write_all(bytes(&rows[start..]))?;
            Ok(dropped)
        };
        match made.lock() {
            Some(data) => data.last().map_or(Ok(0), |data| write(data, 0)),
            None => write(&made.header, HEADER_BYTES),
        }
    }

    /// Makes room for `needed` records and some more, where that can be done while command buffers
    /// hold the set: where records have an address. No command may be running that records.
    pub(crate) fn grow(&self, device: &Device, needed: u64) -> bool {
        let more = needed.saturating_add(needed / 4);
        self.made.as_ref().is_some_and(|made| made.resize(device, more))
    }

    pub(crate) fn destroy(&self, device: &Device) {
        if let Some(made) = &self.made {
            made.destroy(device.handle, &device.table);
        }
    }
}

/// Bytes as they lie in memory.
fn bytes(rows: &[[u32; WORDS]]) -> &[u8] {
    // SAFETY: any bytes will do.
    unsafe { std::slice::from_raw_parts(rows.as_ptr().cast(), size_of_val(rows)) }
}

impl Made {
    fn fill(
        &mut self,
        device: vk::Device,
        table: &DeviceTable,
        facts: &Physical,
        address: bool,
    ) -> Result<(), (&'static str, vk::Result)> {
        use vk::BufferUsageFlags as Usage;
        let limits = &facts.properties.limits;
        let buffer = |size, usage, what| {
            Buffer::new(device, table, &facts.memory, size, usage).map_err(|e| (what, e))
        };
        let records = "no memory for records";
        let behind = if address {
            let few = buffer(FEW * RECORD_BYTES as u64, RECORDS, records)?;
            self.data = Some(Mutex::new(vec![few]));
            0
        } else {
            // A shader sees no more of a buffer than this.
            let most = u64::from(limits.max_storage_buffer_range) - HEADER_BYTES;
            self.wanted.saturating_mul(RECORD_BYTES as u64).min(most)
        };
        self.header = buffer(HEADER_BYTES + behind, Usage::STORAGE_BUFFER, records)?;
        self.stride = (limits.min_uniform_buffer_offset_alignment as u32).max(16);
        let size = u64::from(SLOTS) * u64::from(self.stride);
        self.slots = buffer(size, Usage::UNIFORM_BUFFER, "no memory for draws' numbers")?;
        for word in 0..HEADER_WORDS as usize {
            self.header.write(word, 0);
        }

        let binding = |n, kind| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(n)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        };
        let bindings = [binding(0, KINDS[0]), binding(1, KINDS[1])];
        let null = std::ptr::null();
        let said = |what: &'static str| move |e| (what, e);
        for (bindings, layout) in [(&bindings[..], &mut self.layout), (&[], &mut self.empty)] {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
            let result: vk::Result = next!(table.create_set_layout, device, &info, null, layout);
            result.result().map_err(said("no layout of a descriptor set"))?;
        }
        let sizes =
            KINDS.map(|kind| vk::DescriptorPoolSize::default().ty(kind).descriptor_count(1));
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        let result: vk::Result = next!(table.create_pool, device, &info, null, &mut self.pool);
        result.result().map_err(said("no descriptor pool"))?;
        let layouts = [self.layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        let result: vk::Result = next!(table.allocate_sets, device, &info, &mut self.set);
        result.result().map_err(said("no descriptor set"))?;
        let at = |buffer: &Buffer, range| {
            [vk::DescriptorBufferInfo::default().buffer(buffer.handle).range(range)]
        };
        let (slot, records) = (at(&self.slots, 16), at(&self.header, vk::WHOLE_SIZE));
        let write = |n, buffer| {
            vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(n)
                .descriptor_type(KINDS[n as usize])
                .buffer_info(buffer)
        };
        let writes = [write(0, &slot), write(1, &records)];
        let () = next!(table.update_sets, device, 2, writes.as_ptr(), 0, std::ptr::null());
        self.point();
        Ok(())
    }

    fn lock(&self) -> Option<MutexGuard<'_, Vec<Buffer>>> {
        self.data.as_ref().map(|data| data.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn capacity(&self) -> u64 {
        let bytes = match self.lock() {
            Some(data) => data.last().map_or(0, |data| data.size),
            None => self.header.size - HEADER_BYTES,
        };
        // Indices are words of 32 bits.
        (bytes / RECORD_BYTES as u64).min(u64::from(u32::MAX) / 12)
    }

    /// Has records go to a new buffer of another size.
    fn resize(&self, device: &Device, records: u64) -> bool {
        let Some(mut data) = self.lock() else { return false };
        let bytes = records.saturating_mul(RECORD_BYTES as u64);
        let made = Buffer::new(device.handle, &device.table, &device.memory, bytes, RECORDS);
        let Ok(made) = made else { return false };
        data.push(made);
        drop(data);
        self.point();
        true
    }

    /// Tells shaders where the records are, and how many there can be.
    fn point(&self) {
        self.header.write(CAPACITY, self.capacity() as u32);
        if let Some(data) = self.lock() {
            let address = data.last().map_or(0, |data| data.address);
            self.header.write(ADDRESS, address as u32);
            self.header.write(ADDRESS + 1, (address >> 32) as u32);
        }
    }

    fn destroy(&self, device: vk::Device, table: &DeviceTable) {
        let null = std::ptr::null();
        let () = next!(table.destroy_pool, device, self.pool, null);
        for layout in [self.layout, self.empty] {
            let () = next!(table.destroy_set_layout, device, layout, null);
        }
        self.header.destroy(device, table);
        self.slots.destroy(device, table);
        if let Some(data) = self.lock() {
            data.iter().for_each(|data| data.destroy(device, table));
        }
    }
}

/// Usage of a buffer of records that has an address.
const RECORDS: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS.as_raw(),
);
