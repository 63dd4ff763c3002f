//! What is appended for a fragment, and where: the layer's buffers as a shader sees them.

use super::HEADER_WORDS;
use super::editor::Editor;
use super::spec::{capability, class, decoration, memory, op, version};
use crate::log::RECORD_BYTES;

/// Words of the header, as [`HEADER_WORDS`] says.
mod word {
    pub(super) const COUNT: u32 = 0;
    pub(super) const CAPACITY: u32 = 1;
    pub(super) const ENABLED: u32 = 2;
    pub(super) const ADDRESS: u32 = 4;
}

/// A record as it lies in memory: three times four words, so that a store is one of 16 bytes.
pub(super) struct Record {
    /// Place, slot, primitive, instance.
    pub(super) whose: [u32; 4],
    /// Coverage, depth and its slopes, all as bits.
    pub(super) depth: [u32; 4],
    /// Floats.
    pub(super) colour: [u32; 4],
}

/// The layer's two buffers.
pub(super) struct Buffers {
    /// Where the header lies, and the records where they follow it.
    storage: u32,
    storage_class: u32,
    /// What an address points to, where records lie behind one.
    behind: Option<u32>,
    slot: u32,
    /// Types of a record's parts.
    uints: u32,
    floats: u32,
}

impl Buffers {
    pub(super) fn declare(e: &mut Editor, set: u32, address: bool) -> Self {
        let (uint, float) = (e.uint(), e.float());
        let (uints, floats) = (e.vector(uint, 4), e.vector(float, 4));
        let record = e.structure(&[(uints, 0), (uints, 16), (floats, 32)]);
        let records = e.endless(record, RECORD_BYTES as u32);
        let header = e.array(uint, HEADER_WORDS);
        e.decorate(header, &[decoration::ARRAY_STRIDE, 4]);

        // Before 1.3 a storage buffer is a uniform one with another decoration; addresses, though,
        // come with the storage class of later versions.
        let old = e.module.version() < version::V1_3 && !address;
        let storage_class = if old { class::UNIFORM } else { class::STORAGE_BUFFER };
        let members = [(header, 0), (records, 4 * HEADER_WORDS)];
        let storage = e.structure(if address { &members[..1] } else { &members });
        let block = if old { decoration::BUFFER_BLOCK } else { decoration::BLOCK };
        e.decorate(storage, &[block]);
        let behind = address.then(|| {
            let behind = e.structure(&[(records, 0)]);
            e.decorate(behind, &[decoration::BLOCK]);
            e.use_addresses();
            e.capability(capability::PHYSICAL_STORAGE_BUFFER_ADDRESSES);
            if e.module.version() < version::V1_5 {
                e.extension("SPV_KHR_physical_storage_buffer");
            }
            if e.module.version() < version::V1_3 {
                e.extension("SPV_KHR_storage_buffer_storage_class");
            }
            e.pointer(class::PHYSICAL_STORAGE_BUFFER, behind)
        });
        let slot = e.structure(&[(uint, 0)]);
        e.decorate(slot, &[decoration::BLOCK]);

        let mut bound = |class, ty, binding| {
            let variable = e.variable(class, ty);
            e.decorate(variable, &[decoration::DESCRIPTOR_SET, set]);
            e.decorate(variable, &[decoration::BINDING, binding]);
            variable
        };
        let slot = bound(class::UNIFORM, slot, 0);
        let storage = bound(storage_class, storage, 1);
        Self { storage, storage_class, behind, slot, uints, floats }
    }

    fn header(&self, e: &mut Editor, word: u32) -> u32 {
        let uint = e.uint();
        e.load(self.storage_class, self.storage, &[0, word], uint)
    }

    /// Whether records are asked for: a boolean.
    pub(super) fn enabled(&self, e: &mut Editor) -> u32 {
        let (bool, zero) = (e.bool(), e.constant(0));
        let enabled = self.header(e, word::ENABLED);
        e.value(op::I_NOT_EQUAL, bool, &[enabled, zero])
    }

    /// Which draw this is.
    pub(super) fn slot(&self, e: &mut Editor) -> u32 {
        let uint = e.uint();
        e.load(class::UNIFORM, self.slot, &[0], uint)
    }

    /// Counts the record, and stores it where there is room.
    pub(super) fn append(&self, e: &mut Editor, record: &Record) {
        let (uint, bool) = (e.uint(), e.bool());
        let (zero, one) = (e.constant(0), e.constant(1));
        // In Vulkan's memory model the scope of a whole device has to be asked for. What is
        // submitted to other queues at the same time is the layer's matter in either model.
        let scope = match e.module.memory_model() {
            Some(memory::VULKAN) => memory::SCOPE_QUEUE_FAMILY,
            _ => memory::SCOPE_DEVICE,
        };
        let scope = e.constant(scope);
        let count = e.element(self.storage_class, self.storage, &[0, word::COUNT], uint);
        // Relaxed: nobody reads what another invocation stored.
        let index = e.value(op::ATOMIC_I_ADD, uint, &[count, scope, zero, one]);
        let capacity = self.header(e, word::CAPACITY);
        let fits = e.value(op::U_LESS_THAN, bool, &[index, capacity]);
        let after = e.begin_if(fits);
        let parts =
            [(self.uints, record.whose), (self.uints, record.depth), (self.floats, record.colour)];
        let (class, base) = match self.behind {
            Some(pointer) => {
                let halves = [word::ADDRESS, word::ADDRESS + 1].map(|w| self.header(e, w));
                let pair = e.vector(uint, 2);
                let address = e.value(op::COMPOSITE_CONSTRUCT, pair, &halves);
                let base = e.value(op::BITCAST, pointer, &[address]);
                (class::PHYSICAL_STORAGE_BUFFER, base)
            }
            None => (self.storage_class, self.storage),
        };
        let records = e.constant(u32::from(self.behind.is_none()));
        for (n, (ty, words)) in parts.into_iter().enumerate() {
            let value = e.value(op::COMPOSITE_CONSTRUCT, ty, &words);
            let pointer = e.pointer(class, ty);
            let member = e.constant(n as u32);
            let to = e.value(op::ACCESS_CHAIN, pointer, &[base, records, index, member]);
            if self.behind.is_some() {
                e.put(op::STORE, &[to, value, memory::ALIGNED, 16]);
            } else {
                e.put(op::STORE, &[to, value]);
            }
        }
        e.end_if(after);
    }
}
