//! What this layer asks of a device besides what the program does.

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

use crate::abi::{find, slice};
use crate::device::SETTINGS;
use crate::instance::{ADDRESS, Instance, Physical};
use crate::memory::writable;

/// What was got of what recording needs.
#[derive(Clone, Copy, Default)]
pub(crate) struct Enabled {
    /// Fragment shaders can write and count.
    pub atomics: bool,
    pub geometry: bool,
    pub address: bool,
}

/// A device's create info with what recording needs besides.
pub(crate) struct Asked {
    /// Where the program's own features lie, and what they are with ours.
    features: Option<(*mut vk::PhysicalDeviceFeatures, vk::PhysicalDeviceFeatures)>,
    /// The same, where they are no part of the chain.
    own: vk::PhysicalDeviceFeatures,
    /// The program's own flag of buffers' addresses.
    flag: Option<*mut vk::Bool32>,
    /// Whether our own structure for it is put before the chain.
    structure: bool,
    extensions: Vec<*const c_char>,
    pub enabled: Enabled,
}

impl Asked {
    /// # Safety
    /// `info` is as the program gave it.
    pub(crate) unsafe fn of(
        instance: &Instance,
        facts: &Physical,
        info: *const vk::DeviceCreateInfo<'_>,
        address: bool,
    ) -> Self {
        let info = unsafe { &*info };
        let wanted = |mut f: vk::PhysicalDeviceFeatures| {
            f.fragment_stores_and_atomics = facts.features.fragment_stores_and_atomics;
            f.geometry_shader = facts.features.geometry_shader;
            f
        };
        let has = |f: &vk::PhysicalDeviceFeatures| Enabled {
            atomics: f.fragment_stores_and_atomics == vk::TRUE,
            geometry: f.geometry_shader == vk::TRUE,
            address: false,
        };
        let s_type = vk::StructureType::PHYSICAL_DEVICE_FEATURES_2;
        let chained = unsafe { find::<vk::PhysicalDeviceFeatures2<'_>>(info.p_next, s_type) };
        let mut own = vk::PhysicalDeviceFeatures::default();
        let mut features = None;
        let mut enabled = match chained {
            Some(chained) => {
                let at = unsafe { &raw mut (*chained).features };
                let theirs = unsafe { *at };
                let ours = wanted(theirs);
                // A program may keep its features where nothing can be written.
                if writable(at.cast(), size_of_val(&ours)) {
                    features = Some((at, ours));
                    has(&ours)
                } else {
                    has(&theirs)
                }
            }
            None => {
                if !info.p_enabled_features.is_null() {
                    own = unsafe { *info.p_enabled_features };
                }
                own = wanted(own);
                has(&own)
            }
        };

        let mut extensions: Vec<*const c_char> = unsafe {
            slice(info.pp_enabled_extension_names, info.enabled_extension_count).to_vec()
        };
        let (mut flag, mut structure) = (None, false);
        let names: Vec<&CStr> =
            extensions.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect();
        let possible = address
            && SETTINGS.address
            && facts.address
            && facts.has(ADDRESS)
            // Its older form cannot be enabled beside it.
            && !names.contains(&c"VK_EXT_buffer_device_address")
            && instance.version >= vk::API_VERSION_1_1;
        if possible {
            flag = unsafe { address_flag(info.p_next) };
            match flag {
                Some(at) if unsafe { *at } == vk::TRUE => flag = None,
                Some(at) if !writable(at.cast(), 4) => flag = None,
                Some(_) => {}
                None => structure = true,
            }
            enabled.address = flag.is_some()
                || structure
                || unsafe { address_flag(info.p_next).is_some_and(|at| *at == vk::TRUE) };
            if enabled.address && !names.contains(&ADDRESS) {
                extensions.push(ADDRESS.as_ptr());
            }
        }
        Self { features, own, flag, structure, extensions, enabled }
    }

    /// # Safety
    /// As the program's own call.
    pub(crate) unsafe fn create(
        &self,
        create: vk::PFN_vkCreateDevice,
        physical: vk::PhysicalDevice,
        info: *const vk::DeviceCreateInfo<'_>,
        allocator: *const vk::AllocationCallbacks<'_>,
        out: *mut vk::Device,
    ) -> vk::Result {
        unsafe {
            let mut ours = *info;
            ours.enabled_extension_count = self.extensions.len() as u32;
            ours.pp_enabled_extension_names = self.extensions.as_ptr();
            let mut structure = vk::PhysicalDeviceBufferDeviceAddressFeatures::default()
                .buffer_device_address(true);
            if self.structure {
                structure.p_next = ours.p_next.cast_mut();
                ours.p_next = (&raw const structure).cast();
            }
            let theirs = self.features.map(|(at, ours)| (at, at.replace(ours)));
            if find::<c_void>((*info).p_next, vk::StructureType::PHYSICAL_DEVICE_FEATURES_2)
                .is_none()
            {
                ours.p_enabled_features = &self.own;
            }
            let flag = self.flag.map(|at| (at, at.replace(vk::TRUE)));
            let result = create(physical, &ours, allocator, out);
            // The program finds its structures as they were.
            if let Some((at, value)) = theirs {
                *at = value;
            }
            if let Some((at, value)) = flag {
                *at = value;
            }
            result
        }
    }
}

/// Where a chain says whether buffers have addresses.
///
/// # Safety
/// As [`find`].
unsafe fn address_flag(chain: *const c_void) -> Option<*mut vk::Bool32> {
    use vk::StructureType as S;
    unsafe {
        let all = find::<vk::PhysicalDeviceVulkan12Features<'_>>(
            chain,
            S::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
        );
        let alone = find::<vk::PhysicalDeviceBufferDeviceAddressFeatures<'_>>(
            chain,
            S::PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES,
        );
        all.map(|f| &raw mut (*f).buffer_device_address)
            .or(alone.map(|f| &raw mut (*f).buffer_device_address))
    }
}
