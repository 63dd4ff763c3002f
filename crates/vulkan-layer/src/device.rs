//! Devices: what this layer asks of them besides what the program does, and all that belongs to one.

use std::ffi::{c_char, c_void};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk;

use crate::abi::{DeviceLink, LINK, LOADER_DATA, SetLoaderData, find, layer_info};
use crate::instance::{ADDRESS, Instance, Physical, Registry, as_next, instance, listed};
use crate::instance::{enter, leave, of};
use crate::memory::writable;
use crate::objects::Objects;
use crate::recorder::{Recorder, Resources};
use crate::settings::Settings;
use crate::submit;
use crate::table::{DeviceTable, next};

static DEVICES: Registry<Device> = LazyLock::new(Default::default);

/// The way down of every device, captured or not.
struct Next {
    get: vk::PFN_vkGetDeviceProcAddr,
    destroy: Option<vk::PFN_vkDestroyDevice>,
}

static NEXT: Registry<Next> = LazyLock::new(Default::default);

/// The next layer's function of a name.
///
/// # Safety
/// `handle` is one that the loader made, `name` a text.
pub(crate) unsafe fn next(handle: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    unsafe { (of(&NEXT, handle)?.get)(handle, name) }
}

pub(crate) static SETTINGS: LazyLock<Settings> =
    LazyLock::new(|| Settings::read(|name| std::env::var_os(name)));

pub(crate) struct Device {
    pub handle: vk::Device,
    pub table: DeviceTable,
    pub memory: vk::PhysicalDeviceMemoryProperties,
    pub set_loader_data: Option<SetLoaderData>,
    /// Where our descriptor set stands: the last place there is.
    pub set_index: u32,
    /// Locations between vertex and fragment shaders.
    pub locations: u32,
    /// Whether fragment shaders can ask for the primitive.
    pub primitive_id: bool,
    /// The memory for records, and the set through which shaders reach it.
    pub resources: Resources,
    /// What there is of the program's objects.
    pub objects: Mutex<Objects>,
    pub recorder: Mutex<Recorder>,
    /// Whether there are submissions that have not been waited for.
    pub pending: AtomicBool,
    /// Whether something is captured now or in the next frames.
    pub soon: AtomicBool,
}

impl Device {
    pub(crate) fn objects(&self) -> MutexGuard<'_, Objects> {
        self.objects.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn recorder(&self) -> MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The device of a handle, a queue or a command buffer.
///
/// # Safety
/// `handle` is one that the loader made.
pub(crate) unsafe fn device(handle: impl vk::Handle) -> Option<Arc<Device>> {
    unsafe { of(&DEVICES, handle) }
}

pub(crate) unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Device,
) -> vk::Result {
    unsafe {
        let failed = vk::Result::ERROR_INITIALIZATION_FAILED;
        let Some(instance) = instance(physical) else { return failed };
        let s_type = vk::StructureType::LOADER_DEVICE_CREATE_INFO;
        let Some(link) = layer_info((*info).p_next, s_type, LINK) else { return failed };
        let this = (*link).value.cast::<DeviceLink>();
        let (get_instance, get) = ((*this).get_instance, (*this).get_device);
        (*link).value = (*this).next.cast();
        let Some(create) = get_instance(instance.handle, c"vkCreateDevice".as_ptr()) else {
            return failed;
        };
        let create =
            std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateDevice>(create);
        let set_loader_data = layer_info((*info).p_next, s_type, LOADER_DATA)
            .filter(|info| !(**info).value.is_null())
            .map(|info| std::mem::transmute::<*mut c_void, SetLoaderData>((*info).value));

        let register = |handle: vk::Device| {
            let destroy = get(handle, c"vkDestroyDevice".as_ptr());
            let destroy = std::mem::transmute::<
                vk::PFN_vkVoidFunction,
                Option<vk::PFN_vkDestroyDevice>,
            >(destroy);
            enter(&NEXT, handle, Next { get, destroy });
        };
        if SETTINGS.folder.is_none() {
            let result = create(physical, info, allocator, out);
            if result == vk::Result::SUCCESS {
                register(*out);
            }
            return result;
        }
        let facts = Physical::of(&instance, physical);
        // The link has moved on, so that a second try begins where the first did.
        let after = (*link).value;
        let asked = Asked::of(&instance, &facts, info);
        let mut result = asked.create(create, physical, info, allocator, out);
        let mut enabled = asked.enabled;
        if result != vk::Result::SUCCESS {
            (*link).value = after;
            enabled = Enabled::default();
            result = create(physical, info, allocator, out);
        }
        if result != vk::Result::SUCCESS {
            return result;
        }
        let handle = *out;
        register(handle);
        let table = DeviceTable::load(|name| get(handle, name));
        let device = Device::new(handle, table, &facts, enabled, set_loader_data);
        enter(&DEVICES, handle, device);
        result
    }
}

pub(crate) unsafe extern "system" fn destroy_device(
    handle: vk::Device,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    if handle == vk::Device::null() {
        return;
    }
    if let Some(device) = unsafe { leave(&DEVICES, handle) } {
        crate::guard(|| {
            submit::settle(&device);
            device.recorder().destroy(&device);
            device.objects().destroy(&device);
            device.resources.destroy(&device);
        });
    }
    if let Some(next) = unsafe { leave(&NEXT, handle) } {
        next!(next.destroy, handle, allocator)
    }
}

/// What was got of what recording needs.
#[derive(Clone, Copy, Default)]
struct Enabled {
    /// Fragment shaders can write and count.
    atomics: bool,
    geometry: bool,
    address: bool,
}

/// A device's create info with what recording needs besides.
struct Asked {
    /// Where the program's own features lie, and what they are with ours.
    features: Option<(*mut vk::PhysicalDeviceFeatures, vk::PhysicalDeviceFeatures)>,
    /// The same, where they are no part of the chain.
    own: vk::PhysicalDeviceFeatures,
    /// The program's own flag of buffers' addresses.
    flag: Option<*mut vk::Bool32>,
    /// Whether our own structure for it is put before the chain.
    structure: bool,
    extensions: Vec<*const c_char>,
    enabled: Enabled,
}

impl Asked {
    /// # Safety
    /// `info` is as the program gave it.
    unsafe fn of(
        instance: &Instance,
        facts: &Physical,
        info: *const vk::DeviceCreateInfo<'_>,
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
            crate::abi::slice(info.pp_enabled_extension_names, info.enabled_extension_count)
                .to_vec()
        };
        let (mut flag, mut structure) = (None, false);
        let possible = SETTINGS.address
            && facts.address
            && facts.has(ADDRESS)
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
            let names =
                unsafe { listed(info.pp_enabled_extension_names, info.enabled_extension_count) };
            if enabled.address && !names.iter().any(|name| name.to_bytes() == ADDRESS.as_bytes()) {
                extensions.push(c"VK_KHR_buffer_device_address".as_ptr());
            }
        }
        Self { features, own, flag, structure, extensions, enabled }
    }

    /// # Safety
    /// As the program's own call.
    unsafe fn create(
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
                ours.p_next = as_next(&structure);
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

impl Device {
    fn new(
        handle: vk::Device,
        table: DeviceTable,
        facts: &Physical,
        enabled: Enabled,
        set_loader_data: Option<SetLoaderData>,
    ) -> Self {
        let limits = &facts.properties.limits;
        let mut recorder = Recorder::open(&SETTINGS, &facts.properties);
        let made = if enabled.atomics {
            Resources::new(handle, &table, facts, enabled.address, &SETTINGS)
        } else {
            Err("its fragment shaders cannot write memory".into())
        };
        let resources = made.unwrap_or_else(|why| {
            recorder.note(&format!("nothing of this device is captured: {why}"));
            Resources::none()
        });
        recorder.begin(resources.capacity());
        let soon = recorder.soon();
        Self {
            handle,
            table,
            memory: facts.memory,
            set_loader_data,
            set_index: limits.max_bound_descriptor_sets - 1,
            locations: limits
                .max_vertex_output_components
                .min(limits.max_fragment_input_components)
                / 4,
            primitive_id: enabled.geometry,
            resources,
            objects: Mutex::new(Objects::default()),
            recorder: Mutex::new(recorder),
            pending: AtomicBool::new(false),
            soon: AtomicBool::new(soon),
        }
    }
}
