//! What the loader and a layer say to each other (`vulkan/vk_layer.h`), which no crate declares.

use std::ffi::{c_char, c_void};

use ash::vk;

/// An instance's next layer.
#[repr(C)]
pub(crate) struct InstanceLink {
    pub next: *mut InstanceLink,
    pub get_instance: vk::PFN_vkGetInstanceProcAddr,
    get_physical: *const c_void,
}

/// A device's next layer.
#[repr(C)]
pub(crate) struct DeviceLink {
    pub next: *mut DeviceLink,
    pub get_instance: vk::PFN_vkGetInstanceProcAddr,
    pub get_device: vk::PFN_vkGetDeviceProcAddr,
}

/// Gives an object that a layer makes for itself the loader's table.
pub(crate) type SetLoaderData =
    unsafe extern "system" fn(device: vk::Device, object: *mut c_void) -> vk::Result;

/// What the loader puts into the chain of a create info: one of several things, by `function`.
#[repr(C)]
pub(crate) struct LayerInfo {
    s_type: vk::StructureType,
    next: *const c_void,
    function: u32,
    /// A link (function 0), or a [`SetLoaderData`] (function 1).
    pub value: *mut c_void,
}

pub(crate) const LINK: u32 = 0;
pub(crate) const LOADER_DATA: u32 = 1;

/// `VkNegotiateLayerInterface`.
#[repr(C)]
pub struct Negotiate {
    s_type: u32,
    next: *const c_void,
    pub(crate) version: u32,
    pub(crate) get_instance: Option<GetInstance>,
    pub(crate) get_device: Option<GetDevice>,
    pub(crate) get_physical: *const c_void,
}

type GetInstance = unsafe extern "system" fn(vk::Instance, *const c_char) -> vk::PFN_vkVoidFunction;
type GetDevice = unsafe extern "system" fn(vk::Device, *const c_char) -> vk::PFN_vkVoidFunction;

/// The structures of a chain, from `first` on.
///
/// # Safety
/// `first` is null or begins a chain of Vulkan structures that live as long as it is walked.
pub(crate) unsafe fn chain(
    first: *const c_void,
) -> impl Iterator<Item = *mut vk::BaseOutStructure<'static>> {
    let mut at = first.cast_mut().cast::<vk::BaseOutStructure<'static>>();
    std::iter::from_fn(move || {
        let this = (!at.is_null()).then_some(at)?;
        at = unsafe { (*this).p_next };
        Some(this)
    })
}

/// The structure of a type in a chain.
///
/// # Safety
/// As [`chain`]; `T` is the structure of that type.
pub(crate) unsafe fn find<T>(first: *const c_void, s_type: vk::StructureType) -> Option<*mut T> {
    unsafe { chain(first).find(|s| (**s).s_type == s_type).map(|s| s.cast()) }
}

/// What the loader says under `function`.
///
/// # Safety
/// As [`chain`].
pub(crate) unsafe fn layer_info(
    first: *const c_void,
    s_type: vk::StructureType,
    function: u32,
) -> Option<*mut LayerInfo> {
    unsafe {
        chain(first)
            .filter(|s| (**s).s_type == s_type)
            .map(|s| s.cast::<LayerInfo>())
            .find(|info| (**info).function == function)
    }
}

/// `n` values from `first`; none where that is null. Of none it may point anywhere.
///
/// # Safety
/// Where `first` is not null, there are `n`, for as long as `'a` lasts.
pub(crate) unsafe fn slice<'a, T>(first: *const T, n: u32) -> &'a [T] {
    if n == 0 || first.is_null() {
        &[]
    } else {
        unsafe { std::slice::from_raw_parts(first, n as usize) }
    }
}
