//! Images that frames are drawn to in turn: a swapchain's, or two of our own.

use ash::vk;

use crate::failure::{Failure, Result};
use crate::gpu::Gpu;
use crate::memory::{Buffer, Image, ImagePlan};
use crate::record::Recorder;
use crate::surface::Surface;
use crate::target::{Images, Target, TargetPlan};

pub(crate) struct Chain {
    pub(crate) targets: Vec<Target>,
    /// The last frame's picture.
    pub(crate) picture: Buffer,
    frames: usize,
    shown: Option<Shown>,
}

struct Shown {
    calls: ash::khr::swapchain::Device,
    swapchain: vk::SwapchainKHR,
    acquired: vk::Fence,
    /// One for each image, since a presentation does not say when it is done with one.
    drawn: Vec<vk::Semaphore>,
}

impl Chain {
    /// In place of `old`, if there is one.
    pub(crate) fn new(
        gpu: &Gpu,
        surface: Option<&Surface>,
        extent: vk::Extent2D,
        old: Option<&Self>,
    ) -> Result<Self> {
        let size = u64::from(extent.width * extent.height * 4);
        let picture = Buffer::new(gpu, size, vk::BufferUsageFlags::TRANSFER_DST)?;
        let (shown, targets) = match surface {
            Some(surface) => {
                let old = old.and_then(|old| old.shown.as_ref());
                let (shown, targets) = Shown::new(gpu, surface, extent, old)?;
                (Some(shown), targets)
            }
            None => {
                let plan = TargetPlan { extent, ..TargetPlan::default() };
                (None, vec![Target::new(gpu, plan.clone())?, Target::new(gpu, plan)?])
            }
        };
        Ok(Self { targets, picture, frames: 0, shown })
    }

    /// Draws a frame: `record` is given the number of the image that it is drawn to. Waits.
    pub(crate) fn frame(
        &mut self,
        gpu: &Gpu,
        record: impl FnOnce(&Self, usize) -> Result<vk::CommandBuffer>,
    ) -> Result<()> {
        let number = match &self.shown {
            Some(shown) => shown.acquire(gpu)?,
            None => self.frames % self.targets.len(),
        };
        self.frames += 1;
        let buffers = [record(self, number)?];
        match &self.shown {
            Some(shown) => {
                let semaphores = [shown.drawn[number]];
                let info = vk::SubmitInfo::default()
                    .command_buffers(&buffers)
                    .signal_semaphores(&semaphores);
                gpu.submit_info(&info)?;
                shown.present(gpu, number, &semaphores)?;
            }
            None => gpu.submit(&buffers)?,
        }
        gpu.wait()
    }

    /// Copies what a pass has drawn to an image, and makes the image ready to be shown.
    pub(crate) fn finish(&self, recorder: &Recorder<'_>, number: usize) {
        let image = &self.targets[number].images.colours[0];
        recorder.barrier(&[]);
        recorder.copy(image, &self.picture);
        if self.shown.is_some() {
            let drawn = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
            recorder.relayout(image, drawn, vk::ImageLayout::PRESENT_SRC_KHR);
        }
    }
}

impl Shown {
    fn new(
        gpu: &Gpu,
        surface: &Surface,
        extent: vk::Extent2D,
        old: Option<&Self>,
    ) -> Result<(Self, Vec<Target>)> {
        let physical = gpu.host.physical;
        // SAFETY: the surface is of the device's instance.
        let (can, formats) = unsafe {
            let calls = &surface.calls;
            (
                calls.get_physical_device_surface_capabilities(physical, surface.handle)?,
                calls.get_physical_device_surface_formats(physical, surface.handle)?,
            )
        };
        let plain = |f: &&vk::SurfaceFormatKHR| {
            [vk::Format::R8G8B8A8_UNORM, vk::Format::B8G8R8A8_UNORM].contains(&f.format)
        };
        let vk::SurfaceFormatKHR { format, color_space } = *formats
            .iter()
            .find(plain)
            .ok_or_else(|| Failure::unsupported("no plain format to present"))?;
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let fits = can.current_extent.width == u32::MAX || can.current_extent == extent;
        if !fits || !can.supported_usage_flags.contains(usage) {
            return Err(Failure::unsupported("the surface's size or usage"));
        }
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.handle)
            .min_image_count(can.min_image_count)
            .image_format(format)
            .image_color_space(color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .pre_transform(can.current_transform)
            .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE)
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true)
            .old_swapchain(old.map(|old| old.swapchain).unwrap_or_default());
        let calls = ash::khr::swapchain::Device::new(&gpu.host.instance, &gpu.device);
        // SAFETY: the device was opened with swapchains; all is destroyed once it is idle.
        unsafe {
            let swapchain = calls.create_swapchain(&info, None)?;
            let destroyer = calls.clone();
            gpu.at_end(move |_| destroyer.destroy_swapchain(swapchain, None));
            let acquired = gpu.device.create_fence(&vk::FenceCreateInfo::default(), None)?;
            gpu.at_end(move |d| d.destroy_fence(acquired, None));
            let (mut drawn, mut targets) = (Vec::new(), Vec::new());
            for handle in calls.get_swapchain_images(swapchain)? {
                let info = vk::SemaphoreCreateInfo::default();
                let semaphore = gpu.device.create_semaphore(&info, None)?;
                gpu.at_end(move |d| d.destroy_semaphore(semaphore, None));
                drawn.push(semaphore);
                let plan = TargetPlan { extent, ..TargetPlan::format(format) };
                let samples = plan.samples;
                let image = ImagePlan { format, extent, layers: 1, samples, usage };
                let colours = vec![Image::seen(gpu, handle, image)?];
                let images = Images { colours, resolves: Vec::new(), depth: None };
                targets.push(Target::of(gpu, plan, images)?);
            }
            Ok((Self { calls, swapchain, acquired, drawn }, targets))
        }
    }

    fn acquire(&self, gpu: &Gpu) -> Result<usize> {
        let fences = [self.acquired];
        // SAFETY: the fence is not in use.
        unsafe {
            let (number, _) = self.calls.acquire_next_image(
                self.swapchain,
                u64::MAX,
                vk::Semaphore::null(),
                self.acquired,
            )?;
            gpu.device.wait_for_fences(&fences, true, u64::MAX)?;
            gpu.device.reset_fences(&fences)?;
            Ok(number as usize)
        }
    }

    fn present(&self, gpu: &Gpu, number: usize, drawn: &[vk::Semaphore]) -> Result<()> {
        let (swapchains, numbers) = ([self.swapchain], [number as u32]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(drawn)
            .swapchains(&swapchains)
            .image_indices(&numbers);
        // SAFETY: the image was acquired and is ready when the semaphore is signalled.
        unsafe { self.calls.queue_present(gpu.queue, &info) }?;
        Ok(())
    }
}
