//! Images and buffers.

use ash::vk;

use crate::failure::{Failure, Result};
use crate::gpu::Gpu;

pub(crate) struct Image {
    pub(crate) handle: vk::Image,
    /// None where it is only copied.
    pub(crate) view: vk::ImageView,
    pub(crate) format: vk::Format,
    pub(crate) extent: vk::Extent2D,
    pub(crate) layers: u32,
}

/// What an image is to be.
#[derive(Clone, Copy)]
pub(crate) struct ImagePlan {
    pub(crate) format: vk::Format,
    pub(crate) extent: vk::Extent2D,
    pub(crate) layers: u32,
    pub(crate) samples: vk::SampleCountFlags,
    pub(crate) usage: vk::ImageUsageFlags,
}

impl Image {
    pub(crate) fn new(gpu: &Gpu, plan: ImagePlan) -> Result<Self> {
        let vk::Extent2D { width, height } = plan.extent;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(plan.format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(plan.layers)
            .samples(plan.samples)
            .usage(plan.usage);
        // SAFETY: the image is bound to memory of its own, and destroyed with the device.
        unsafe {
            let usable = gpu.host.instance.get_physical_device_image_format_properties(
                gpu.host.physical,
                info.format,
                info.image_type,
                info.tiling,
                info.usage,
                info.flags,
            );
            if !usable.is_ok_and(|u| u.sample_counts.contains(plan.samples)) {
                return Err(Failure::unsupported("the target's format or number of samples"));
            }
            let handle = gpu.device.create_image(&info, None)?;
            gpu.at_end(move |d| d.destroy_image(handle, None));
            let requirements = gpu.device.get_image_memory_requirements(handle);
            let memory = gpu.memory(requirements, vk::MemoryPropertyFlags::empty())?;
            gpu.device.bind_image_memory(handle, memory, 0)?;
            let copied = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
            if copied.contains(plan.usage) {
                let ImagePlan { format, extent, layers, .. } = plan;
                return Ok(Self { handle, view: vk::ImageView::null(), format, extent, layers });
            }
            Self::seen(gpu, handle, plan)
        }
    }

    /// An image that is there, with a view of its own.
    pub(crate) fn seen(gpu: &Gpu, handle: vk::Image, plan: ImagePlan) -> Result<Self> {
        let ImagePlan { format, extent, layers, .. } = plan;
        let kind =
            if layers == 1 { vk::ImageViewType::TYPE_2D } else { vk::ImageViewType::TYPE_2D_ARRAY };
        let info = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(kind)
            .format(format)
            .subresource_range(range(format, layers));
        // SAFETY: the image is the device's.
        unsafe {
            let view = gpu.device.create_image_view(&info, None)?;
            gpu.at_end(move |d| d.destroy_image_view(view, None));
            Ok(Self { handle, view, format, extent, layers })
        }
    }

    pub(crate) fn range(&self) -> vk::ImageSubresourceRange {
        range(self.format, self.layers)
    }
}

fn range(format: vk::Format, layers: u32) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default()
        .aspect_mask(aspects(format))
        .level_count(1)
        .layer_count(layers)
}

pub(crate) fn aspects(format: vk::Format) -> vk::ImageAspectFlags {
    match format {
        vk::Format::D32_SFLOAT => vk::ImageAspectFlags::DEPTH,
        vk::Format::D32_SFLOAT_S8_UINT => {
            vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
        }
        _ => vk::ImageAspectFlags::COLOR,
    }
}

/// A buffer that the host can write and read.
pub(crate) struct Buffer {
    pub(crate) handle: vk::Buffer,
    pub(crate) size: u64,
    memory: vk::DeviceMemory,
}

impl Buffer {
    pub(crate) fn new(gpu: &Gpu, size: u64, usage: vk::BufferUsageFlags) -> Result<Self> {
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the buffer is bound to memory of its own, and destroyed with the device.
        unsafe {
            let handle = gpu.device.create_buffer(&info, None)?;
            gpu.at_end(move |d| d.destroy_buffer(handle, None));
            let requirements = gpu.device.get_buffer_memory_requirements(handle);
            let properties =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let memory = gpu.memory(requirements, properties)?;
            gpu.device.bind_buffer_memory(handle, memory, 0)?;
            Ok(Self { handle, size, memory })
        }
    }

    /// With 32-bit words in it.
    pub(crate) fn of(gpu: &Gpu, words: &[u32], usage: vk::BufferUsageFlags) -> Result<Self> {
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_ne_bytes()).collect();
        let buffer = Self::new(gpu, bytes.len() as u64, usage)?;
        // SAFETY: the memory is at least as long as the bytes, and nothing uses it yet.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let at = gpu.device.map_memory(buffer.memory, 0, buffer.size, flags)?;
            at.cast::<u8>().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
            gpu.device.unmap_memory(buffer.memory);
        }
        Ok(buffer)
    }

    pub(crate) fn read(&self, gpu: &Gpu) -> Result<Vec<u8>> {
        let length = usize::try_from(self.size).unwrap_or_default();
        // SAFETY: the memory is at least `size` long, and nothing writes to it now.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let at = gpu.device.map_memory(self.memory, 0, self.size, flags)?;
            let bytes = std::slice::from_raw_parts(at.cast::<u8>(), length).to_vec();
            gpu.device.unmap_memory(self.memory);
            Ok(bytes)
        }
    }
}
