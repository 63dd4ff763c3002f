//! Layouts of descriptor sets and of pipelines. Pipeline layouts get our set at their end.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::device::{Device, device};
use crate::guard;
use crate::table::next;

/// A set layout: what it says, as a number, so that two that say the same are known to.
#[derive(Clone, Copy, Default)]
pub(crate) struct SetLayout {
    pub identity: u64,
    /// Descriptors with a dynamic offset.
    pub dynamic: u32,
}

#[derive(Clone, Default)]
pub(crate) struct PipelineLayout {
    /// The program's set layouts.
    pub sets: Vec<SetLayout>,
    /// Push constants, as a number.
    pub push: u64,
    /// Whether our set stands at its end.
    pub ours: bool,
    /// Pipelines that are made with it.
    users: u32,
    /// The program has let it go.
    gone: bool,
}

impl PipelineLayout {
    /// Whether binding with `other` leaves what was bound with this at `set` as it is: Vulkan's
    /// 'compatible for set'.
    pub(crate) fn compatible(&self, other: &Self, set: usize) -> bool {
        let identity = |layout: &Self, n: usize| layout.sets.get(n).map(|s| s.identity);
        self.push == other.push && (0..=set).all(|n| identity(self, n) == identity(other, n))
    }
}

#[derive(Default)]
pub(crate) struct Layouts {
    sets: HashMap<u64, SetLayout>,
    pipelines: HashMap<u64, PipelineLayout>,
}

impl Layouts {
    pub(crate) fn pipeline(&self, layout: vk::PipelineLayout) -> Option<&PipelineLayout> {
        self.pipelines.get(&layout.as_raw())
    }

    /// A pipeline is made with a layout.
    pub(crate) fn retain(&mut self, layout: vk::PipelineLayout) {
        if let Some(info) = self.pipelines.get_mut(&layout.as_raw()) {
            info.users += 1;
        }
    }

    /// A pipeline that was is destroyed. Says whether the layout can go.
    pub(crate) fn release(&mut self, layout: vk::PipelineLayout) -> bool {
        let Some(info) = self.pipelines.get_mut(&layout.as_raw()) else { return false };
        info.users = info.users.saturating_sub(1);
        let last = info.users == 0 && info.gone;
        if last {
            self.pipelines.remove(&layout.as_raw());
        }
        last
    }

    /// The program lets a layout go. Says whether it can: draws bind our set with it later.
    fn let_go(&mut self, layout: vk::PipelineLayout) -> bool {
        let Some(info) = self.pipelines.get_mut(&layout.as_raw()) else { return true };
        info.gone = true;
        let last = info.users == 0;
        if last {
            self.pipelines.remove(&layout.as_raw());
        }
        last
    }

    pub(crate) fn destroy(&mut self, device: &Device) {
        for (layout, info) in self.pipelines.drain() {
            if info.gone {
                let layout = vk::PipelineLayout::from_raw(layout);
                let null = std::ptr::null();
                let () = next!(device.table.destroy_pipeline_layout, device.handle, layout, null);
            }
        }
    }
}

/// What a set layout says.
unsafe fn read(info: &vk::DescriptorSetLayoutCreateInfo<'_>) -> SetLayout {
    let mut hash = DefaultHasher::new();
    let mut dynamic = 0;
    let bindings = unsafe { slice(info.p_bindings, info.binding_count) };
    info.flags.as_raw().hash(&mut hash);
    let flags = unsafe {
        find::<vk::DescriptorSetLayoutBindingFlagsCreateInfo<'_>>(
            info.p_next,
            vk::StructureType::DESCRIPTOR_SET_LAYOUT_BINDING_FLAGS_CREATE_INFO,
        )
    };
    if let Some(flags) = flags {
        let flags = unsafe { slice((*flags).p_binding_flags, (*flags).binding_count) };
        flags.iter().for_each(|f| f.as_raw().hash(&mut hash));
    }
    let mut order: Vec<_> = bindings.iter().collect();
    order.sort_by_key(|b| b.binding);
    for b in order {
        let what = [b.binding, b.descriptor_type.as_raw() as u32, b.descriptor_count];
        what.hash(&mut hash);
        b.stage_flags.as_raw().hash(&mut hash);
        let samplers = unsafe { slice(b.p_immutable_samplers, b.descriptor_count) };
        samplers.iter().for_each(|s| s.as_raw().hash(&mut hash));
        let kinds = [
            vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
            vk::DescriptorType::STORAGE_BUFFER_DYNAMIC,
        ];
        if kinds.contains(&b.descriptor_type) {
            dynamic += b.descriptor_count;
        }
    }
    SetLayout { identity: hash.finish(), dynamic }
}

pub(crate) unsafe extern "system" fn create_set_layout(
    handle: vk::Device,
    info: *const vk::DescriptorSetLayoutCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::DescriptorSetLayout,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_set_layout, handle, info, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            d.objects().layouts.sets.insert((*out).as_raw(), read(&*info));
        });
    }
    result
}

pub(crate) unsafe extern "system" fn create_pipeline_layout(
    handle: vk::Device,
    info: *const vk::PipelineLayoutCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::PipelineLayout,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let theirs = unsafe { &*info };
    let mut sets = unsafe { slice(theirs.p_set_layouts, theirs.set_layout_count).to_vec() };
    let mut read = PipelineLayout::default();
    let mut ours = *theirs;
    guard(|| {
        let known = |s: &vk::DescriptorSetLayout| {
            d.objects().layouts.sets.get(&s.as_raw()).copied().unwrap_or_default()
        };
        read.sets = sets.iter().map(known).collect();
        let mut hash = DefaultHasher::new();
        let ranges =
            unsafe { slice(theirs.p_push_constant_ranges, theirs.push_constant_range_count) };
        for r in ranges {
            (r.stage_flags.as_raw(), r.offset, r.size).hash(&mut hash);
        }
        read.push = hash.finish();
        let at = d.set_index as usize;
        if let Some([layout, empty]) = d.resources.layouts()
            && sets.len() <= at
        {
            sets.resize(at, empty);
            sets.push(layout);
            read.ours = true;
        }
    });
    if read.ours {
        ours.set_layout_count = sets.len() as u32;
        ours.p_set_layouts = sets.as_ptr();
    }
    let mut result: vk::Result =
        next!(d.table.create_pipeline_layout, handle, &ours, allocator, out);
    if result != vk::Result::SUCCESS && read.ours {
        read.ours = false;
        result = next!(d.table.create_pipeline_layout, handle, info, allocator, out);
    }
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            d.objects().layouts.pipelines.insert((*out).as_raw(), read);
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_pipeline_layout(
    handle: vk::Device,
    layout: vk::PipelineLayout,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    if guard(|| d.objects().layouts.let_go(layout)).unwrap_or(false) {
        next!(d.table.destroy_pipeline_layout, handle, layout, allocator);
    }
}
