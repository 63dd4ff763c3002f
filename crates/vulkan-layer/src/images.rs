//! Images, views and swapchains.

use ash::vk::{self, Handle};

use crate::abi::slice;
use crate::device::{Device, device};
use crate::guard;
use crate::objects::{Image, Swapchain, View};
use crate::table::next;

/// Usage of images that can be drawn into, and be read when they are.
fn readable(usage: vk::ImageUsageFlags) -> bool {
    use vk::ImageUsageFlags as U;
    usage.contains(U::COLOR_ATTACHMENT) && !usage.contains(U::TRANSIENT_ATTACHMENT)
}

pub(crate) unsafe extern "system" fn create_image(
    handle: vk::Device,
    info: *const vk::ImageCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Image,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let theirs = unsafe { &*info };
    let mut ours = *theirs;
    let mut read = readable(theirs.usage);
    if read {
        ours.usage |= vk::ImageUsageFlags::TRANSFER_SRC;
    }
    let mut result: vk::Result = next!(d.table.create_image, handle, &ours, allocator, out);
    if result != vk::Result::SUCCESS && ours.usage != theirs.usage {
        read = false;
        result = next!(d.table.create_image, handle, info, allocator, out);
    }
    let attachment = vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
        | vk::ImageUsageFlags::INPUT_ATTACHMENT;
    if result == vk::Result::SUCCESS && theirs.usage.intersects(attachment) {
        let image = Image {
            number: 0,
            handle: unsafe { *out },
            name: String::new(),
            format: theirs.format,
            extent: theirs.extent,
            samples: theirs.samples.as_raw(),
            swapchain: false,
            readable: read,
            layout: theirs.initial_layout,
        };
        guard(|| enter(&d, image));
    }
    result
}

fn enter(d: &Device, image: Image) -> u64 {
    let mut objects = d.objects();
    let number = objects.number();
    objects.image_numbers.insert(image.handle.as_raw(), number);
    objects.images.insert(number, Image { number, ..image });
    number
}

pub(crate) unsafe extern "system" fn destroy_image(
    handle: vk::Device,
    image: vk::Image,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| {
        let mut objects = d.objects();
        if let Some(number) = objects.image_numbers.remove(&image.as_raw()) {
            objects.images.remove(&number);
        }
    });
    next!(d.table.destroy_image, handle, image, allocator)
}

pub(crate) unsafe extern "system" fn create_image_view(
    handle: vk::Device,
    info: *const vk::ImageViewCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::ImageView,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_image_view, handle, info, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            let info = &*info;
            let mut objects = d.objects();
            if let Some(&image) = objects.image_numbers.get(&info.image.as_raw()) {
                let range = info.subresource_range;
                let (layer, level) = (range.base_array_layer, range.base_mip_level);
                let view = View { image, format: info.format, layer, level };
                objects.views.insert((*out).as_raw(), view);
            }
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_image_view(
    handle: vk::Device,
    view: vk::ImageView,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().views.remove(&view.as_raw()));
    next!(d.table.destroy_image_view, handle, view, allocator)
}

pub(crate) unsafe extern "system" fn create_swapchain(
    handle: vk::Device,
    info: *const vk::SwapchainCreateInfoKHR<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::SwapchainKHR,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let theirs = unsafe { &*info };
    let mut ours = *theirs;
    ours.image_usage |= vk::ImageUsageFlags::TRANSFER_SRC;
    let mut readable = true;
    let mut result: vk::Result = next!(d.table.create_swapchain, handle, &ours, allocator, out);
    if result != vk::Result::SUCCESS && ours.image_usage != theirs.image_usage {
        readable = false;
        result = next!(d.table.create_swapchain, handle, info, allocator, out);
    }
    if result == vk::Result::SUCCESS {
        guard(|| {
            let (format, extent) = (theirs.image_format, theirs.image_extent);
            let swapchain = Swapchain { format, extent, readable, images: Vec::new() };
            d.objects().swapchains.insert(unsafe { (*out).as_raw() }, swapchain);
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
    if out.is_null() {
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
