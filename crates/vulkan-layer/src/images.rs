//! Images and views.

use ash::vk::{self, Handle};

use crate::abi::chain;
use crate::device::{Device, device};
use crate::guard;
use crate::objects::{Image, View};
use crate::table::next;

/// Usage with which an image can be copied from.
pub(crate) const READ: vk::ImageUsageFlags = vk::ImageUsageFlags::TRANSFER_SRC;

/// Whether the pixels of an image can be copied where the driver lets it: it is drawn into, and its
/// memory and layout are its own.
fn wanted(info: &vk::ImageCreateInfo<'_>) -> bool {
    use vk::{ImageCreateFlags as F, ImageUsageFlags as U, StructureType as S};
    let shared = F::ALIAS | F::PROTECTED | F::SPARSE_BINDING | F::SPARSE_RESIDENCY;
    let elsewhere = [
        S::EXTERNAL_MEMORY_IMAGE_CREATE_INFO,
        S::EXTERNAL_MEMORY_IMAGE_CREATE_INFO_NV,
        S::IMAGE_SWAPCHAIN_CREATE_INFO_KHR,
    ];
    let own = unsafe { chain(info.p_next).all(|s| !elsewhere.contains(&(*s).s_type)) };
    info.usage.contains(U::COLOR_ATTACHMENT)
        && !info.usage.contains(U::TRANSIENT_ATTACHMENT)
        && !info.flags.intersects(shared)
        && info.tiling != vk::ImageTiling::DRM_FORMAT_MODIFIER_EXT
        && own
}

/// An image's create info with our usage added, where that can be done.
fn readable<'a>(d: &Device, info: &vk::ImageCreateInfo<'a>) -> Option<vk::ImageCreateInfo<'a>> {
    let ours = vk::ImageCreateInfo { usage: info.usage | READ, ..*info };
    if !wanted(info) || ours.usage == info.usage {
        return wanted(info).then_some(ours);
    }
    let mut most = vk::ImageFormatProperties::default();
    let result: vk::Result = next!(
        d.instance.table.image_format,
        d.physical,
        ours.format,
        ours.image_type,
        ours.tiling,
        ours.usage,
        ours.flags,
        &mut most
    );
    let (size, limit) = (ours.extent, most.max_extent);
    let fits = size.width <= limit.width
        && size.height <= limit.height
        && size.depth <= limit.depth
        && ours.mip_levels <= most.max_mip_levels
        && ours.array_layers <= most.max_array_layers
        && most.sample_counts.contains(ours.samples);
    (result == vk::Result::SUCCESS && fits).then_some(ours)
}

pub(crate) unsafe extern "system" fn create_image(
    handle: vk::Device,
    info: *const vk::ImageCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Image,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let theirs = unsafe { &*info };
    let ours = guard(|| readable(&d, theirs)).flatten();
    let made = ours.as_ref().map_or(info, std::ptr::from_ref);
    let result: vk::Result = next!(d.table.create_image, handle, made, allocator, out);
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
            acquired: false,
            readable: ours.is_some(),
            layout: vk::ImageLayout::UNDEFINED,
        };
        guard(|| enter(&d, image));
    }
    result
}

/// What an image would need has to be what it does need.
pub(crate) unsafe extern "system" fn requirements(
    handle: vk::Device,
    info: *const vk::DeviceImageMemoryRequirements<'_>,
    out: *mut vk::MemoryRequirements2<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    let mut info = unsafe { *info };
    let ours = guard(|| readable(&d, unsafe { &*info.p_create_info })).flatten();
    if let Some(ours) = &ours {
        info.p_create_info = ours;
    }
    next!(d.table.image_requirements, handle, &info, out)
}

pub(crate) fn enter(d: &Device, image: Image) -> u64 {
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
        // It may be being copied.
        let _held = d.recorder();
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
