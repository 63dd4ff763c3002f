//! Swapchains and their images.

use ash::vk::{self, Handle};

use crate::abi::slice;
use crate::device::{Device, device};
use crate::guard;
use crate::images::{READ, enter};
use crate::objects::{Image, Swapchain};
use crate::table::next;

/// Whether a swapchain's images can be copied from: asked beforehand, since a swapchain that cannot
/// be made takes the one before it along.
fn shown_readable(d: &Device, info: &vk::SwapchainCreateInfoKHR<'_>) -> bool {
    let shared =
        [vk::PresentModeKHR::SHARED_DEMAND_REFRESH, vk::PresentModeKHR::SHARED_CONTINUOUS_REFRESH];
    let mut can = vk::SurfaceCapabilitiesKHR::default();
    let result: vk::Result = next!(d.instance.table.surface, d.physical, info.surface, &mut can);
    result == vk::Result::SUCCESS
        && can.supported_usage_flags.contains(READ)
        && !info.flags.contains(vk::SwapchainCreateFlagsKHR::PROTECTED)
        && !shared.contains(&info.present_mode)
}

fn made_swapchain(
    d: &Device,
    info: &vk::SwapchainCreateInfoKHR<'_>,
    handle: vk::SwapchainKHR,
    readable: bool,
) {
    let (format, extent) = (info.image_format, info.image_extent);
    let swapchain = Swapchain { format, extent, readable, images: Vec::new() };
    d.objects().swapchains.insert(handle.as_raw(), swapchain);
}

pub(crate) unsafe extern "system" fn create_swapchain(
    handle: vk::Device,
    info: *const vk::SwapchainCreateInfoKHR<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::SwapchainKHR,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let mut ours = unsafe { *info };
    let readable = guard(|| shown_readable(&d, &ours)).unwrap_or(false);
    if readable {
        ours.image_usage |= READ;
    }
    let result: vk::Result = next!(d.table.create_swapchain, handle, &ours, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| made_swapchain(&d, &ours, unsafe { *out }, readable));
    }
    result
}

/// Swapchains of displays, which are made together: as they are asked for.
pub(crate) unsafe extern "system" fn create_swapchains(
    handle: vk::Device,
    n: u32,
    infos: *const vk::SwapchainCreateInfoKHR<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::SwapchainKHR,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_swapchains, handle, n, infos, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| {
            let (infos, made) = unsafe { (slice(infos, n), slice(out, n)) };
            for (info, made) in infos.iter().zip(made) {
                made_swapchain(&d, info, *made, info.image_usage.contains(READ));
            }
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_swapchain(
    handle: vk::Device,
    swapchain: vk::SwapchainKHR,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| {
        let _held = d.recorder();
        let mut objects = d.objects();
        for number in objects.swapchains.remove(&swapchain.as_raw()).iter().flat_map(|s| &s.images)
        {
            if let Some(image) = objects.images.remove(number) {
                objects.image_numbers.remove(&image.handle.as_raw());
            }
        }
    });
    next!(d.table.destroy_swapchain, handle, swapchain, allocator)
}

pub(crate) unsafe extern "system" fn swapchain_images(
    handle: vk::Device,
    swapchain: vk::SwapchainKHR,
    count: *mut u32,
    out: *mut vk::Image,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.swapchain_images, handle, swapchain, count, out);
    let some = result == vk::Result::SUCCESS || result == vk::Result::INCOMPLETE;
    if out.is_null() || !some {
        return result;
    }
    guard(|| {
        let handles = unsafe { slice(out, *count) };
        let Some(made) = d.objects().swapchains.get(&swapchain.as_raw()).cloned() else { return };
        // A program may ask again: they keep their numbers.
        for &handle in handles.iter().skip(made.images.len()) {
            let image = Image {
                number: 0,
                handle,
                name: String::new(),
                format: made.format,
                extent: vk::Extent3D::from(made.extent),
                samples: 1,
                swapchain: true,
                acquired: false,
                readable: made.readable,
                layout: vk::ImageLayout::UNDEFINED,
            };
            let number = enter(&d, image);
            if let Some(made) = d.objects().swapchains.get_mut(&swapchain.as_raw()) {
                made.images.push(number);
            }
        }
    });
    result
}

/// A swapchain's image is the program's from here on.
fn acquired(d: &Device, swapchain: vk::SwapchainKHR, semaphore: vk::Semaphore, index: u32) {
    if d.over() {
        return;
    }
    guard(|| {
        let mut objects = d.objects();
        // No queue signals it.
        objects.semaphores.entry(semaphore.as_raw()).or_default().signalled = false;
        let swapchain = objects.swapchains.get(&swapchain.as_raw());
        let number = swapchain.and_then(|s| s.images.get(index as usize)).copied();
        if let Some(image) = number.and_then(|n| objects.images.get_mut(&n)) {
            image.acquired = true;
        }
    });
}

/// Whether an image was acquired.
fn got(result: vk::Result) -> bool {
    result == vk::Result::SUCCESS || result == vk::Result::SUBOPTIMAL_KHR
}

pub(crate) unsafe extern "system" fn acquire(
    handle: vk::Device,
    swapchain: vk::SwapchainKHR,
    timeout: u64,
    semaphore: vk::Semaphore,
    fence: vk::Fence,
    out: *mut u32,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.acquire, handle, swapchain, timeout, semaphore, fence, out);
    if got(result) {
        acquired(&d, swapchain, semaphore, unsafe { *out });
    }
    result
}

pub(crate) unsafe extern "system" fn acquire2(
    handle: vk::Device,
    info: *const vk::AcquireNextImageInfoKHR<'_>,
    out: *mut u32,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.acquire2, handle, info, out);
    if got(result) {
        let info = unsafe { &*info };
        acquired(&d, info.swapchain, info.semaphore, unsafe { *out });
    }
    result
}
