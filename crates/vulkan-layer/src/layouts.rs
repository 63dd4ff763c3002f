//! Layouts of descriptor sets and of pipelines. Pipeline layouts get our set at their end.

use std::hash::{DefaultHasher, Hash, Hasher};

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::counts::Counts;
use crate::device::{Device, device};
use crate::guard;
use crate::instance::Map;
use crate::table::next;

/// A set layout: what it says, as a number, so that two that say the same are known to.
#[derive(Clone, Copy, Default)]
pub(crate) struct SetLayout {
    pub identity: u64,
    /// Descriptors with a dynamic offset.
    pub dynamic: u32,
    counts: Counts,
    /// A driver may give the same handle more than once.
    created: u32,
}

#[derive(Clone, Default)]
pub(crate) struct PipelineLayout {
    /// The program's set layouts.
    pub sets: Vec<SetLayout>,
    /// Push constants and flags, as a number.
    pub push: u64,
    /// Why our set does not stand at its end; empty where it does.
    pub refused: &'static str,
    /// Pipelines that are made with it.
    users: u32,
    /// How often the program has it, and how often it has let it go without our doing so.
    created: u32,
    owed: u32,
}

impl PipelineLayout {
    /// Whether binding with `other` leaves what was bound with this at `set` as it is: Vulkan's
    /// 'compatible for set'.
    pub(crate) fn compatible(&self, other: &Self, set: usize) -> bool {
        let identity = |layout: &Self, n: usize| layout.sets.get(n).map(|s| s.identity);
        self.push == other.push && (0..=set).all(|n| identity(self, n) == identity(other, n))
    }
}

#[cfg(test)]
impl PipelineLayout {
    /// Of sets with one dynamic offset each.
    pub(crate) fn of(sets: &[u64], push: u64) -> Self {
        let set = |&identity: &u64| SetLayout { identity, dynamic: 1, ..SetLayout::default() };
        Self { sets: sets.iter().map(set).collect(), push, ..Self::default() }
    }
}

#[derive(Default)]
pub(crate) struct Layouts {
    sets: Map<u64, SetLayout>,
    pipelines: Map<u64, PipelineLayout>,
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

    /// A pipeline that was is destroyed. Says how often the layout is to be let go now.
    pub(crate) fn release(&mut self, layout: vk::PipelineLayout) -> u32 {
        let Some(info) = self.pipelines.get_mut(&layout.as_raw()) else { return 0 };
        info.users = info.users.saturating_sub(1);
        if info.users > 0 {
            return 0;
        }
        let owed = std::mem::take(&mut info.owed);
        if info.created == 0 {
            self.pipelines.remove(&layout.as_raw());
        }
        owed
    }

    /// The program makes a layout.
    fn enter(&mut self, handle: vk::PipelineLayout, layout: PipelineLayout) {
        let known = self.pipelines.entry(handle.as_raw()).or_insert(layout);
        known.created += 1;
    }

    /// The program lets a layout go. Says whether it can: draws bind our set with it later.
    fn let_go(&mut self, layout: vk::PipelineLayout) -> bool {
        let Some(info) = self.pipelines.get_mut(&layout.as_raw()) else { return true };
        info.created = info.created.saturating_sub(1);
        if info.created > 0 {
            return true;
        }
        if info.users > 0 {
            info.owed += 1;
            return false;
        }
        self.pipelines.remove(&layout.as_raw());
        true
    }

    pub(crate) fn destroy(&mut self, device: &Device) {
        for (layout, info) in self.pipelines.drain() {
            let layout = vk::PipelineLayout::from_raw(layout);
            (0..info.owed).for_each(|_| destroy(device, layout));
        }
    }
}

/// Lets a pipeline layout go, as all are made: without the program's allocator, which may be gone
/// by then.
pub(crate) fn destroy(d: &Device, layout: vk::PipelineLayout) {
    next!(d.table.destroy_pipeline_layout, d.handle, layout, std::ptr::null())
}

/// What a set layout says.
unsafe fn read(info: &vk::DescriptorSetLayoutCreateInfo<'_>) -> SetLayout {
    use vk::{DescriptorType as D, StructureType as S};
    let mut hash = DefaultHasher::new();
    let (mut dynamic, mut counts) = (0, Counts::default());
    let bindings = unsafe { slice(info.p_bindings, info.binding_count) };
    info.flags.as_raw().hash(&mut hash);
    let flags = unsafe {
        let s_type = S::DESCRIPTOR_SET_LAYOUT_BINDING_FLAGS_CREATE_INFO;
        find::<vk::DescriptorSetLayoutBindingFlagsCreateInfo<'_>>(info.p_next, s_type)
            .map_or(&[][..], |f| slice((*f).p_binding_flags, (*f).binding_count))
    };
    let mutable = unsafe {
        let s_type = S::MUTABLE_DESCRIPTOR_TYPE_CREATE_INFO_EXT;
        find::<vk::MutableDescriptorTypeCreateInfoEXT<'_>>(info.p_next, s_type).map_or(
            &[][..],
            |m| {
                slice((*m).p_mutable_descriptor_type_lists, (*m).mutable_descriptor_type_list_count)
            },
        )
    };
    let mut order: Vec<_> = bindings.iter().enumerate().collect();
    order.sort_by_key(|(_, b)| b.binding);
    // Those that can be written while they are bound have limits of their own, far away.
    let counted = !info.flags.contains(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL);
    for (n, b) in order {
        let what = [b.binding, b.descriptor_type.as_raw() as u32, b.descriptor_count];
        what.hash(&mut hash);
        b.stage_flags.as_raw().hash(&mut hash);
        flags.get(n).map_or(0, |f| f.as_raw()).hash(&mut hash);
        if b.descriptor_type == D::MUTABLE_EXT
            && let Some(list) = mutable.get(n)
        {
            let kinds = unsafe { slice(list.p_descriptor_types, list.descriptor_type_count) };
            let mut kinds: Vec<i32> = kinds.iter().map(|k| k.as_raw()).collect();
            kinds.sort_unstable();
            kinds.hash(&mut hash);
        }
        // Of other types the pointer may point anywhere.
        if [D::SAMPLER, D::COMBINED_IMAGE_SAMPLER].contains(&b.descriptor_type) {
            let samplers = unsafe { slice(b.p_immutable_samplers, b.descriptor_count) };
            samplers.iter().for_each(|s| s.as_raw().hash(&mut hash));
        }
        if [D::UNIFORM_BUFFER_DYNAMIC, D::STORAGE_BUFFER_DYNAMIC].contains(&b.descriptor_type) {
            dynamic += b.descriptor_count;
        }
        if counted {
            let fragment = b.stage_flags.contains(vk::ShaderStageFlags::FRAGMENT);
            counts.add(b.descriptor_type, b.descriptor_count, fragment);
        }
    }
    SetLayout { identity: hash.finish(), dynamic, counts, created: 0 }
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
            let made = read(&*info);
            d.objects().layouts.sets.entry((*out).as_raw()).or_insert(made).created += 1;
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_set_layout(
    handle: vk::Device,
    layout: vk::DescriptorSetLayout,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| {
        let sets = &mut d.objects().layouts.sets;
        if let Some(known) = sets.get_mut(&layout.as_raw()) {
            known.created -= 1;
            if known.created == 0 {
                sets.remove(&layout.as_raw());
            }
        }
    });
    next!(d.table.destroy_set_layout, handle, layout, allocator)
}

/// What a pipeline layout says, and its set layouts with ours at their end where there is room.
fn extended(
    d: &Device,
    info: &vk::PipelineLayoutCreateInfo<'_>,
) -> (PipelineLayout, Vec<vk::DescriptorSetLayout>) {
    let mut sets = unsafe { slice(info.p_set_layouts, info.set_layout_count).to_vec() };
    let mut read = PipelineLayout::default();
    let objects = d.objects();
    let known = |s: &vk::DescriptorSetLayout| objects.layouts.sets.get(&s.as_raw()).copied();
    read.sets = sets.iter().map(|s| known(s).unwrap_or_default()).collect();
    let mut hash = DefaultHasher::new();
    info.flags.as_raw().hash(&mut hash);
    for r in unsafe { slice(info.p_push_constant_ranges, info.push_constant_range_count) } {
        (r.stage_flags.as_raw(), r.offset, r.size).hash(&mut hash);
    }
    read.push = hash.finish();
    let all =
        read.sets.iter().fold(Counts::ours(), |all, s| s.counts.with(all, u32::saturating_add));
    let at = d.set_index as usize;
    match d.resources.layouts() {
        None => read.refused = "nothing of its device is captured",
        Some(_) if sets.len() > at => read.refused = "its layout uses all descriptor sets",
        Some(_) if !all.fit(d.most) => read.refused = "its layout leaves no descriptors",
        Some([layout, empty]) => {
            // Sets of parts that do not know each other may only be padded with none at all.
            let apart = vk::PipelineLayoutCreateFlags::INDEPENDENT_SETS_EXT;
            let none = info.flags.contains(apart) && d.null_sets;
            sets.resize(at, if none { vk::DescriptorSetLayout::null() } else { empty });
            sets.push(layout);
        }
    }
    (read, sets)
}

pub(crate) unsafe extern "system" fn create_pipeline_layout(
    handle: vk::Device,
    info: *const vk::PipelineLayoutCreateInfo<'_>,
    _: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::PipelineLayout,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let mut ours = unsafe { *info };
    let extended = guard(|| extended(&d, &ours));
    let (mut read, sets) = extended.unwrap_or_default();
    let null = std::ptr::null();
    let mut result = vk::Result::ERROR_UNKNOWN;
    if read.refused.is_empty() && !sets.is_empty() {
        ours.set_layout_count = sets.len() as u32;
        ours.p_set_layouts = sets.as_ptr();
        result = next!(d.table.create_pipeline_layout, handle, &ours, null, out);
    }
    if result != vk::Result::SUCCESS {
        if read.refused.is_empty() {
            read.refused = "its layout cannot have another descriptor set";
        }
        result = next!(d.table.create_pipeline_layout, handle, info, null, out);
    }
    if result == vk::Result::SUCCESS {
        guard(|| d.objects().layouts.enter(unsafe { *out }, read));
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_pipeline_layout(
    handle: vk::Device,
    layout: vk::PipelineLayout,
    _: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    if guard(|| d.objects().layouts.let_go(layout)).unwrap_or(false) {
        destroy(&d, layout);
    }
}

pub(crate) unsafe extern "system" fn create_template(
    handle: vk::Device,
    info: *const vk::DescriptorUpdateTemplateCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::DescriptorUpdateTemplate,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_template, handle, info, allocator, out);
    let info = unsafe { &*info };
    let pushes = info.template_type == vk::DescriptorUpdateTemplateType::PUSH_DESCRIPTORS_KHR;
    if result == vk::Result::SUCCESS
        && pushes
        && info.pipeline_bind_point == vk::PipelineBindPoint::GRAPHICS
    {
        guard(|| d.objects().templates.insert(unsafe { *out }.as_raw()));
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_template(
    handle: vk::Device,
    template: vk::DescriptorUpdateTemplate,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().templates.remove(&template.as_raw()));
    next!(d.table.destroy_template, handle, template, allocator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_of_one_handle_twice_is_let_go_twice() {
        let handle = vk::PipelineLayout::from_raw(7);
        let mut all = Layouts::default();
        all.enter(handle, PipelineLayout::default());
        all.enter(handle, PipelineLayout::default());
        all.retain(handle);
        assert!(all.let_go(handle));
        assert!(!all.let_go(handle));
        // Made anew while a pipeline still has it.
        all.enter(handle, PipelineLayout::default());
        assert_eq!(all.release(handle), 1);
        assert!(all.pipeline(handle).is_some());
        assert!(all.let_go(handle));
        assert!(all.pipeline(handle).is_none());
    }
}
