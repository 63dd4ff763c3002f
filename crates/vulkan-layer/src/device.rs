//! Devices, and all that belongs to one.

use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, RwLock};

use ash::vk::{self, Handle};

use crate::abi::{DeviceLink, LINK, LOADER_DATA, SetLoaderData, layer_info, slice};
use crate::counts::Counts;
use crate::creation::{Asked, Enabled};
use crate::instance::{HIDDEN, Instance, Physical, Registry, enter, instance, leave, most, of};
use crate::memory::Buffer;
use crate::objects::Objects;
use crate::own::Own;
use crate::pending::settle;
use crate::queues::Queue;
use crate::recorder::Recorder;
use crate::resources::Resources;
use crate::settings::Settings;
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
    pub physical: vk::PhysicalDevice,
    pub instance: Arc<Instance>,
    pub table: DeviceTable,
    pub memory: vk::PhysicalDeviceMemoryProperties,
    pub set_loader_data: Option<SetLoaderData>,
    /// Where our descriptor set stands: the last place there is.
    pub set_index: u32,
    /// Descriptors that a pipeline layout can hold.
    pub most: Counts,
    /// Pipeline layouts can have sets of no layout. Mesa's lavapipe (its vendor's number is Mesa's
    /// own) does not stand it that one is bound behind such (22.3), and is content with empty ones.
    pub null_sets: bool,
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
    /// Whether nothing will be captured any more.
    over: AtomicBool,
    /// Command buffers that are being recorded and are not plain.
    pub busy: AtomicUsize,
    pub queues: RwLock<HashMap<u64, Arc<Queue>>>,
    own: Mutex<Own>,
    /// Buffers that a queue may still write to.
    parked: Mutex<Vec<Buffer>>,
    /// Nothing of it can be captured: nothing is in the program's way.
    pub passive: bool,
    /// The process that made it: a copy of that has its memory, and is not captured.
    process: u32,
}

impl Device {
    pub(crate) fn objects(&self) -> MutexGuard<'_, Objects> {
        self.objects.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn recorder(&self) -> MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn own(&self) -> MutexGuard<'_, Own> {
        self.own.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn park(&self, buffer: Buffer) {
        self.parked.lock().unwrap_or_else(PoisonError::into_inner).push(buffer);
    }

    pub(crate) fn queue(&self, handle: vk::Queue) -> Arc<Queue> {
        let known = self.queues.read().unwrap_or_else(PoisonError::into_inner);
        known.get(&handle.as_raw()).cloned().unwrap_or_else(|| Arc::new(Queue::unknown(handle)))
    }

    /// All queues, in the same order each time: they can be held together.
    pub(crate) fn all_queues(&self) -> Vec<Arc<Queue>> {
        let known = self.queues.read().unwrap_or_else(PoisonError::into_inner);
        let mut all: Vec<_> = known.values().cloned().collect();
        all.sort_by_key(|queue| queue.handle);
        all
    }

    /// Whether nothing that is recorded now is asked for, so that nothing has to be noted of it.
    pub(crate) fn idle(&self) -> bool {
        self.busy.load(Ordering::Acquire) == 0
    }

    pub(crate) fn over(&self) -> bool {
        self.over.load(Ordering::Acquire)
    }

    pub(crate) fn at_home(&self) -> bool {
        self.process == std::process::id()
    }

    /// A command buffer is not recorded any more; whether it was, and was not plain.
    pub(crate) fn recorded(&self, recording: bool) {
        self.busy.fetch_sub(recording.into(), Ordering::AcqRel);
    }

    /// Looks at what is asked for from now on.
    pub(crate) fn look(&self, recorder: &Recorder) {
        self.soon.store(recorder.soon(), Ordering::Release);
        self.over.store(self.passive || recorder.over(), Ordering::Release);
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
        let names = slice((*info).pp_enabled_extension_names, (*info).enabled_extension_count);
        let past = names.iter().map(|n| CStr::from_ptr(*n)).find(|name| HIDDEN.contains(name));
        // The link has moved on, so that another try begins where the first did.
        let after = (*link).value;
        let (mut result, mut enabled) = (vk::Result::ERROR_UNKNOWN, Enabled::default());
        for address in [true, false] {
            if past.is_none() && result != vk::Result::SUCCESS {
                (*link).value = after;
                let asked = Asked::of(&instance, &facts, info, address);
                result = asked.create(create, physical, info, allocator, out);
                enabled = asked.enabled;
            }
        }
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
        let made = crate::guard(|| {
            let table = DeviceTable::load(|name| get(handle, name));
            let past = past.map(|name| name.to_string_lossy());
            let able = match past {
                Some(past) => Err(format!("it draws by {past}")),
                None if !enabled.atomics => Err("its fragment shaders cannot write memory".into()),
                None => Ok(enabled),
            };
            Device::new(handle, physical, instance, table, &facts, able, set_loader_data)
        });
        if let Some(device) = made {
            enter(&DEVICES, handle, device);
        }
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
            settle(&device, None);
            device.objects().destroy(&device);
            device.own().destroy(&device);
            let parked = device.parked.lock().unwrap_or_else(PoisonError::into_inner);
            parked.iter().for_each(|buffer| buffer.destroy(device.handle, &device.table));
            device.resources.destroy(&device);
        });
    }
    if let Some(next) = unsafe { leave(&NEXT, handle) } {
        next!(next.destroy, handle, allocator)
    }
}

impl Device {
    /// Where nothing can be captured, the log says so if it can be written.
    fn new(
        handle: vk::Device,
        physical: vk::PhysicalDevice,
        instance: Arc<Instance>,
        table: DeviceTable,
        facts: &Physical,
        able: Result<Enabled, String>,
        set_loader_data: Option<SetLoaderData>,
    ) -> Self {
        let limits = &facts.properties.limits;
        let mut recorder = Recorder::open(&SETTINGS, &facts.properties);
        let made = able.and_then(|enabled| {
            Resources::new(handle, &table, facts, enabled.address, &SETTINGS)
                .map(|resources| (enabled, resources))
        });
        let (enabled, resources) = made.unwrap_or_else(|why| {
            recorder.note(&format!("nothing of this device is captured: {why}"));
            (Enabled::default(), Resources::none())
        });
        recorder.begin(resources.capacity());
        let passive = recorder.over() || !resources.usable();
        let soon = recorder.soon();
        Self {
            handle,
            physical,
            instance,
            table,
            memory: facts.memory,
            set_loader_data,
            set_index: limits.max_bound_descriptor_sets - 1,
            most: most(limits),
            null_sets: facts.properties.vendor_id != vk::VendorId::MESA.as_raw() as u32,
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
            over: AtomicBool::new(passive),
            passive,
            busy: AtomicUsize::new(0),
            queues: RwLock::default(),
            own: Mutex::default(),
            parked: Mutex::default(),
            process: std::process::id(),
        }
    }
}
