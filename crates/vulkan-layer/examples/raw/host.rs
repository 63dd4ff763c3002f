//! An instance and its first device, and what has to be asked before that device is opened.

use std::ffi::{CStr, c_char};
use std::rc::Rc;

use ash::vk;

use crate::failure::{Failure, Result};
use crate::gpu::Gpu;

pub(crate) struct Host {
    pub(crate) entry: ash::Entry,
    pub(crate) instance: ash::Instance,
    pub(crate) physical: vk::PhysicalDevice,
    /// Features of Vulkan 1.0 that the device has.
    pub(crate) features: vk::PhysicalDeviceFeatures,
    pub(crate) limits: vk::PhysicalDeviceLimits,
}

impl Host {
    /// Vulkan 1.1, as most programs ask for.
    pub(crate) fn new() -> Result<Rc<Self>> {
        Self::with(vk::API_VERSION_1_1, &[])
    }

    pub(crate) fn with(version: u32, extensions: &[&CStr]) -> Result<Rc<Self>> {
        // SAFETY: the loader is a system library; what is made of it lives as long as `entry`.
        unsafe {
            let entry = ash::Entry::load().map_err(Failure::unsupported)?;
            let there = entry.enumerate_instance_extension_properties(None)?;
            for &name in extensions {
                needs(has(&there, name), name)?;
            }
            let application =
                vk::ApplicationInfo::default().application_name(c"raw").api_version(version);
            let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
            let info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_extension_names(&names);
            let instance = entry.create_instance(&info, None)?;
            let physical = instance.enumerate_physical_devices()?.first().copied();
            let Some(physical) = physical else {
                instance.destroy_instance(None);
                return Err(Failure::unsupported("no device"));
            };
            let features = instance.get_physical_device_features(physical);
            let properties = instance.get_physical_device_properties(physical);
            let host = Self { entry, instance, physical, features, limits: properties.limits };
            if properties.api_version < version {
                return Err(Failure::unsupported("the device's version of Vulkan"));
            }
            Ok(Rc::new(host))
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: each device holds its host, so none is left.
        unsafe { self.instance.destroy_instance(None) }
    }
}

fn has(there: &[vk::ExtensionProperties], name: &CStr) -> bool {
    there.iter().any(|e| e.extension_name_as_c_str() == Ok(name))
}

fn needs(there: bool, name: &CStr) -> Result<()> {
    if there { Ok(()) } else { Err(Failure::unsupported(name.to_string_lossy())) }
}

/// One feature of the structure `T`: where its switch is, and its name.
pub(crate) type Feature<T> = (fn(&mut T) -> &mut vk::Bool32, &'static str);

/// What a device is to be opened with. Each request fails where the device cannot grant it.
pub(crate) struct Opening {
    host: Rc<Host>,
    extensions: Vec<*const c_char>,
    core: vk::PhysicalDeviceFeatures,
    features: Vec<Box<dyn vk::ExtendsDeviceCreateInfo>>,
    pub(crate) queues: u32,
}

impl Opening {
    pub(crate) fn new(host: &Rc<Host>) -> Self {
        Self {
            host: host.clone(),
            extensions: Vec::new(),
            core: vk::PhysicalDeviceFeatures::default(),
            features: Vec::new(),
            queues: 1,
        }
    }

    pub(crate) fn extension(&mut self, name: &'static CStr) -> Result<()> {
        let host = &self.host;
        // SAFETY: the device is the instance's.
        let there = unsafe { host.instance.enumerate_device_extension_properties(host.physical) }?;
        needs(has(&there, name), name)?;
        self.extensions.push(name.as_ptr());
        Ok(())
    }

    /// Of Vulkan 1.0.
    pub(crate) fn core(
        &mut self,
        (switch, name): Feature<vk::PhysicalDeviceFeatures>,
    ) -> Result<()> {
        let mut there = self.host.features;
        if *switch(&mut there) == vk::FALSE {
            return Err(Failure::unsupported(name));
        }
        *switch(&mut self.core) = vk::TRUE;
        Ok(())
    }

    /// Of the structure `T` of a later version or an extension.
    pub(crate) fn features<T>(&mut self, wanted: &[Feature<T>]) -> Result<()>
    where
        T: vk::ExtendsPhysicalDeviceFeatures2 + vk::ExtendsDeviceCreateInfo + Default + 'static,
    {
        let mut there = T::default();
        let mut query = vk::PhysicalDeviceFeatures2::default().push_next(&mut there);
        // SAFETY: the device is the instance's, and `there` outlives the call.
        unsafe {
            self.host.instance.get_physical_device_features2(self.host.physical, &mut query);
        }
        let mut asked = T::default();
        for (switch, name) in wanted {
            if *switch(&mut there) == vk::FALSE {
                return Err(Failure::unsupported(name));
            }
            *switch(&mut asked) = vk::TRUE;
        }
        self.features.push(Box::new(asked));
        Ok(())
    }

    pub(crate) fn open(mut self) -> Result<Gpu> {
        let host = self.host;
        // SAFETY: what the structures point at lives until the end of the block.
        unsafe {
            let families = host.instance.get_physical_device_queue_family_properties(host.physical);
            let family = families
                .iter()
                .position(|f| f.queue_flags.contains(vk::QueueFlags::GRAPHICS))
                .ok_or_else(|| Failure::unsupported("no queue that draws"))?;
            if families[family].queue_count < self.queues {
                return Err(Failure::unsupported("the family has too few queues"));
            }
            let family = u32::try_from(family).unwrap_or_default();
            let priorities = vec![1.0; self.queues as usize];
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(family)
                .queue_priorities(&priorities)];
            let mut info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&self.extensions)
                .enabled_features(&self.core);
            for next in &mut self.features {
                info = info.push_next(next.as_mut());
            }
            let device = host.instance.create_device(host.physical, &info, None)?;
            Gpu::new(host.clone(), device, family)
        }
    }
}
