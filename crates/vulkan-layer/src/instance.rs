//! Instances: the way down to the driver, and what programs are told of devices.

use std::collections::{BTreeSet, HashMap};
use std::ffi::{CStr, CString, c_char};
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use ash::vk::{self, Handle};

use crate::abi::{InstanceLink, LINK, layer_info};
use crate::counts::Counts;
use crate::table::{InstanceTable, next};

pub(crate) struct Instance {
    pub handle: vk::Instance,
    pub get: vk::PFN_vkGetInstanceProcAddr,
    pub table: InstanceTable,
    /// Of Vulkan, as the program asked for it.
    pub version: u32,
}

/// Pointers are spread well enough as they are.
#[derive(Default)]
pub(crate) struct Keys(u64);

impl Hasher for Keys {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u64(u64::from(*byte)));
    }

    fn write_u64(&mut self, n: u64) {
        // The map looks at the upper bits, too.
        self.0 = (self.0 ^ n).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(32);
    }

    fn write_usize(&mut self, n: usize) {
        self.write_u64(n as u64);
    }
}

/// By handles and pointers.
pub(crate) type Map<K, T> = HashMap<K, T, BuildHasherDefault<Keys>>;

/// By what a dispatchable handle points at: the loader's table, which is one for an instance and its
/// physical devices, and one for a device, its queues and command buffers.
pub(crate) type Registry<T> = LazyLock<RwLock<Map<usize, Arc<T>>>>;

static INSTANCES: Registry<Instance> = LazyLock::new(Default::default);

/// # Safety
/// `handle` is a dispatchable handle that the loader made.
unsafe fn key(handle: impl Handle) -> usize {
    unsafe { *(handle.as_raw() as *const usize) }
}

/// What belongs to a handle.
///
/// # Safety
/// `handle` is a dispatchable handle that the loader made.
pub(crate) unsafe fn of<T>(all: &Registry<T>, handle: impl Handle) -> Option<Arc<T>> {
    all.read().unwrap_or_else(PoisonError::into_inner).get(&unsafe { key(handle) }).cloned()
}

/// # Safety
/// As [`of`].
pub(crate) unsafe fn enter<T>(all: &Registry<T>, handle: impl Handle, what: T) {
    let key = unsafe { key(handle) };
    all.write().unwrap_or_else(PoisonError::into_inner).insert(key, Arc::new(what));
}

/// # Safety
/// As [`of`].
pub(crate) unsafe fn leave<T>(all: &Registry<T>, handle: impl Handle) -> Option<Arc<T>> {
    all.write().unwrap_or_else(PoisonError::into_inner).remove(&unsafe { key(handle) })
}

/// # Safety
/// As [`of`].
pub(crate) unsafe fn instance(handle: impl Handle) -> Option<Arc<Instance>> {
    unsafe { of(&INSTANCES, handle) }
}

pub(crate) unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Instance,
) -> vk::Result {
    unsafe {
        let link = layer_info((*info).p_next, vk::StructureType::LOADER_INSTANCE_CREATE_INFO, LINK);
        let Some(link) = link else { return vk::Result::ERROR_INITIALIZATION_FAILED };
        let this = (*link).value.cast::<InstanceLink>();
        let get = (*this).get_instance;
        (*link).value = (*this).next.cast();
        let Some(create) = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create =
            std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateInstance>(create);
        let result = create(info, allocator, out);
        if result == vk::Result::SUCCESS {
            let handle = *out;
            let table = InstanceTable::load(|name| get(handle, name));
            let application = (*info).p_application_info;
            let version = if application.is_null() { 0 } else { (*application).api_version };
            let version = version.max(vk::API_VERSION_1_0);
            enter(&INSTANCES, handle, Instance { handle, get, table, version });
        }
        result
    }
}

pub(crate) unsafe extern "system" fn destroy_instance(
    handle: vk::Instance,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    if handle.is_null() {
        return;
    }
    if let Some(instance) = unsafe { leave(&INSTANCES, handle) } {
        next!(instance.table.destroy_instance, handle, allocator);
    }
}

/// Extensions with which a program draws past what this layer rewrites: shaders that are no part of
/// a pipeline or no text, descriptors that are no sets, commands that a GPU makes, mesh shaders, sets
/// that are bound by other commands.
pub(crate) const HIDDEN: [&CStr; 9] = [
    c"VK_EXT_shader_object",
    c"VK_EXT_descriptor_buffer",
    c"VK_EXT_shader_module_identifier",
    c"VK_NV_device_generated_commands",
    c"VK_EXT_device_generated_commands",
    c"VK_EXT_mesh_shader",
    c"VK_NV_mesh_shader",
    c"VK_KHR_pipeline_binary",
    c"VK_KHR_maintenance6",
];

pub(crate) unsafe extern "system" fn enumerate_extensions(
    physical: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    out: *mut vk::ExtensionProperties,
) -> vk::Result {
    let Some(instance) = (unsafe { instance(physical) }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    let enumerate = instance.table.enumerate_extensions;
    if !layer.is_null() {
        return next!(enumerate, physical, layer, count, out);
    }
    let all = match extensions(&instance, physical) {
        Ok(all) => all,
        Err(result) => return result,
    };
    let shown =
        |e: &&vk::ExtensionProperties| !HIDDEN.iter().any(|h| name(&e.extension_name) == *h);
    let all: Vec<_> = all.iter().filter(shown).copied().collect();
    unsafe { give(&all, count, out) }
}

/// All extensions of a device.
pub(crate) fn extensions(
    instance: &Instance,
    physical: vk::PhysicalDevice,
) -> Result<Vec<vk::ExtensionProperties>, vk::Result> {
    let enumerate = instance.table.enumerate_extensions;
    let null = std::ptr::null();
    loop {
        let mut n = 0;
        let result: vk::Result = next!(enumerate, physical, null, &mut n, std::ptr::null_mut());
        result.result()?;
        let mut all = vec![vk::ExtensionProperties::default(); n as usize];
        let result: vk::Result = next!(enumerate, physical, null, &mut n, all.as_mut_ptr());
        if result == vk::Result::INCOMPLETE {
            continue;
        }
        result.result()?;
        all.truncate(n as usize);
        return Ok(all);
    }
}

/// As Vulkan gives lists: their length where `out` is null, else as many as there is space for.
///
/// # Safety
/// `count` can be written; where `out` is not null, there is space for `*count` behind it.
unsafe fn give<T: Copy>(all: &[T], count: *mut u32, out: *mut T) -> vk::Result {
    unsafe {
        if out.is_null() {
            *count = all.len() as u32;
            return vk::Result::SUCCESS;
        }
        let n = all.len().min(*count as usize);
        std::ptr::copy_nonoverlapping(all.as_ptr(), out, n);
        *count = n as u32;
        if n < all.len() { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
    }
}

/// A name of fixed length.
pub(crate) fn name(chars: &[c_char]) -> &CStr {
    let bytes = unsafe { std::slice::from_raw_parts(chars.as_ptr().cast::<u8>(), chars.len()) };
    CStr::from_bytes_until_nul(bytes).unwrap_or_default()
}

/// Lowers a limit by what is ours, where programs do not count on it: not below what every device
/// has.
fn withhold(limit: &mut u32, ours: u32, least: u32) {
    *limit = limit.saturating_sub(ours).max(least.min(*limit));
}

/// Of Vulkan, the last version of which all commands are known here.
const NEWEST: u32 = vk::make_api_version(0, 1, 4, 0);

/// A device without what is this layer's: the last descriptor set, and what is in it.
fn withhold_all(properties: &mut vk::PhysicalDeviceProperties) {
    if properties.api_version >= NEWEST {
        properties.api_version =
            vk::make_api_version(0, 1, 3, vk::api_version_patch(properties.api_version));
    }
    let (limits, ours) = (&mut properties.limits, Counts::ours());
    withhold(&mut limits.max_bound_descriptor_sets, 1, 4);
    let dynamic = &mut limits.max_descriptor_set_uniform_buffers_dynamic;
    withhold(dynamic, ours.dynamic_uniforms, 8);
    withhold(&mut limits.max_descriptor_set_uniform_buffers, ours.uniforms, 72);
    withhold(&mut limits.max_descriptor_set_storage_buffers, ours.storages, 24);
    withhold(&mut limits.max_per_stage_descriptor_uniform_buffers, ours.stage_uniforms, 12);
    withhold(&mut limits.max_per_stage_descriptor_storage_buffers, ours.stage_storages, 4);
    withhold(&mut limits.max_per_stage_resources, ours.stage_all, 128);
    withhold(&mut limits.max_fragment_combined_output_resources, ours.outputs, 4);
}

/// What there really is of what our set takes.
pub(crate) fn most(limits: &vk::PhysicalDeviceLimits) -> Counts {
    Counts {
        dynamic_uniforms: limits.max_descriptor_set_uniform_buffers_dynamic,
        uniforms: limits.max_descriptor_set_uniform_buffers,
        storages: limits.max_descriptor_set_storage_buffers,
        stage_uniforms: limits.max_per_stage_descriptor_uniform_buffers,
        stage_storages: limits.max_per_stage_descriptor_storage_buffers,
        stage_all: limits.max_per_stage_resources,
        outputs: limits.max_fragment_combined_output_resources,
    }
}

pub(crate) unsafe extern "system" fn properties(
    physical: vk::PhysicalDevice,
    out: *mut vk::PhysicalDeviceProperties,
) {
    let Some(instance) = (unsafe { instance(physical) }) else { return };
    let () = next!(instance.table.properties, physical, out);
    withhold_all(unsafe { &mut *out });
}

pub(crate) unsafe extern "system" fn properties2(
    physical: vk::PhysicalDevice,
    out: *mut vk::PhysicalDeviceProperties2<'_>,
) {
    let Some(instance) = (unsafe { instance(physical) }) else { return };
    let () = next!(instance.table.properties2, physical, out);
    withhold_all(unsafe { &mut (*out).properties });
}

/// What of a device decides how it can be recorded.
pub(crate) struct Physical {
    pub properties: vk::PhysicalDeviceProperties,
    pub memory: vk::PhysicalDeviceMemoryProperties,
    pub features: vk::PhysicalDeviceFeatures,
    /// Whether buffers can have addresses, by the features that it names.
    pub address: bool,
    extensions: BTreeSet<CString>,
}

impl Physical {
    pub(crate) fn of(instance: &Instance, handle: vk::PhysicalDevice) -> Self {
        let table = &instance.table;
        let mut properties = vk::PhysicalDeviceProperties::default();
        let () = next!(table.properties, handle, &mut properties);
        let mut memory = vk::PhysicalDeviceMemoryProperties::default();
        let () = next!(table.memory, handle, &mut memory);
        let mut features = vk::PhysicalDeviceFeatures::default();
        let () = next!(table.features, handle, &mut features);
        let extensions = extensions(instance, handle).unwrap_or_default();
        let extensions: BTreeSet<CString> =
            extensions.iter().map(|e| name(&e.extension_name).to_owned()).collect();
        let mut address = false;
        if table.features2.is_some() && extensions.contains(ADDRESS) {
            let mut asked = vk::PhysicalDeviceBufferDeviceAddressFeatures::default();
            let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut asked);
            let () = next!(table.features2, handle, &mut all);
            address = asked.buffer_device_address == vk::TRUE;
        }
        Self { properties, memory, features, address, extensions }
    }

    pub(crate) fn has(&self, extension: &CStr) -> bool {
        self.extensions.contains(extension)
    }
}

/// The extension of buffers' addresses.
pub(crate) const ADDRESS: &CStr = c"VK_KHR_buffer_device_address";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_lowered_but_not_below_what_programs_count_on() {
        for (limit, shown) in [(4, 4), (5, 4), (32, 31), (3, 3)] {
            let mut left = limit;
            withhold(&mut left, 1, 4);
            assert_eq!(left, shown);
        }
        let mut properties = vk::PhysicalDeviceProperties {
            api_version: vk::make_api_version(0, 1, 4, 7),
            limits: vk::PhysicalDeviceLimits {
                max_per_stage_resources: 1000,
                ..Default::default()
            },
            ..Default::default()
        };
        withhold_all(&mut properties);
        assert!(properties.api_version < NEWEST);
        assert_eq!(properties.limits.max_per_stage_resources, 998);
    }
}
