//! Pixels of the program's images, copied between its submissions.

use ash::vk;

use crate::device::Device;
use crate::memory::Buffer;
use crate::objects::Image;
use crate::own::{Waited, run};
use crate::queues::Queue;
use crate::recorder::Recorder;
use crate::table::next;

/// Bytes of a pixel of a format that colours are drawn to, uncompressed.
fn pixel_bytes(format: vk::Format) -> Option<u64> {
    use vk::Format as F;
    Some(match format {
        F::R8_UNORM | F::R8_SRGB | F::R8_UINT | F::R8_SINT => 1,
        F::R8G8_UNORM | F::R8G8_SRGB | F::R16_SFLOAT | F::R16_UNORM | F::R5G6B5_UNORM_PACK16 => 2,
        F::R8G8B8A8_UNORM
        | F::R8G8B8A8_SRGB
        | F::B8G8R8A8_UNORM
        | F::B8G8R8A8_SRGB
        | F::A8B8G8R8_UNORM_PACK32
        | F::A8B8G8R8_SRGB_PACK32
        | F::A2B10G10R10_UNORM_PACK32
        | F::A2R10G10B10_UNORM_PACK32
        | F::B10G11R11_UFLOAT_PACK32
        | F::R16G16_SFLOAT
        | F::R16G16_UNORM
        | F::R32_SFLOAT => 4,
        F::R16G16B16A16_SFLOAT | F::R16G16B16A16_UNORM | F::R32G32_SFLOAT => 8,
        F::R32G32B32A32_SFLOAT => 16,
        _ => return None,
    })
}

/// Why an image's pixels cannot be read, or how many bytes of each there are.
fn possible(image: &Image) -> Result<u64, &'static str> {
    let bytes = pixel_bytes(image.format).ok_or("its format is not known here")?;
    match image {
        Image { samples: 2.., .. } => Err("it has several samples a pixel"),
        Image { readable: false, .. } => Err("the driver does not let it be copied"),
        Image { swapchain: true, acquired: false, .. } => Err("it is being shown"),
        Image { layout: vk::ImageLayout::UNDEFINED, .. } => Err("nothing was drawn to it"),
        _ => Ok(bytes),
    }
}

/// Writes the pixels of the first level and layer of an image as they are now, before or after a
/// submission. Everything that was submitted has been run.
pub(crate) fn picture(
    d: &Device,
    recorder: &mut Recorder,
    queue: &Queue,
    image: &Image,
    submission: u64,
    after: bool,
) {
    let Ok(pixel) = possible(image) else { return };
    let size = u64::from(image.extent.width) * u64::from(image.extent.height) * pixel;
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    let Ok(buffer) = Buffer::new(d.handle, &d.table, &d.memory, size, usage) else { return };
    let copied = run(d, queue, |commands| copy(d, image, buffer.handle, commands));
    match copied {
        Ok(Waited::Done) => {
            let pixels = unsafe { std::slice::from_raw_parts(buffer.bytes, size as usize) };
            recorder.image(image.log());
            recorder.picture(image.number, submission, after, pixels);
        }
        // It may still be written to.
        Ok(Waited::NotYet) => return d.park(buffer),
        Ok(Waited::Failed) => recorder.note("an image cannot be read"),
        Err(result) => recorder.note(&format!("an image cannot be read: {result}")),
    }
    buffer.destroy(d.handle, &d.table);
}

fn copy(d: &Device, image: &Image, to: vk::Buffer, buffer: vk::CommandBuffer) {
    use vk::{AccessFlags as Access, ImageLayout};
    let aspect = vk::ImageAspectFlags::COLOR;
    let between = |from: (ImageLayout, Access), to: (ImageLayout, Access)| {
        let range =
            vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1);
        let barrier = [vk::ImageMemoryBarrier::default()
            .old_layout(from.0)
            .src_access_mask(from.1)
            .new_layout(to.0)
            .dst_access_mask(to.1)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.handle)
            .subresource_range(range)];
        let stages = vk::PipelineStageFlags::ALL_COMMANDS;
        let (none, null, no) = (vk::DependencyFlags::empty(), std::ptr::null(), std::ptr::null());
        let barriers = barrier.as_ptr();
        let () = next!(d.table.barrier, buffer, stages, stages, none, 0, null, 0, no, 1, barriers);
    };
    let all = Access::MEMORY_READ | Access::MEMORY_WRITE;
    let reading = (ImageLayout::TRANSFER_SRC_OPTIMAL, Access::TRANSFER_READ);
    between((image.layout, all), reading);
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(aspect).layer_count(1);
    let region = vk::BufferImageCopy::default()
        .image_subresource(layers)
        .image_extent(vk::Extent3D { depth: 1, ..image.extent });
    let () = next!(d.table.copy_to_buffer, buffer, image.handle, reading.0, to, 1, &region);
    between(reading, (image.layout, all));
}
