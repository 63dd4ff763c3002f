//! Which functions this layer stands in front of.

use std::ffi::{CStr, c_char};

use ash::vk;

use crate::device::{self, create_device, destroy_device};
use crate::{barriers, commands, draws, dynamic, images, instance, layouts};
use crate::{passes, pipelines, queues, rendering, submit, swapchains, writes};

/// Functions by name.
macro_rules! hooks {
    ($(#[$doc:meta])* $by_name:ident { $($($name:literal)|+ => $hook:path,)* }) => {
        $(#[$doc])*
        fn $by_name(name: &CStr) -> vk::PFN_vkVoidFunction {
            match name.to_bytes() {
                $($($name)|+ => unsafe {
                    std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>($hook as *const ())
                },)*
                _ => None,
            }
        }
    };
}

hooks! {
    /// Of instances and physical devices.
    instance_hook {
        b"vkGetInstanceProcAddr" => get_instance_proc_addr,
        b"vkCreateInstance" => instance::create_instance,
        b"vkDestroyInstance" => instance::destroy_instance,
        b"vkEnumerateDeviceExtensionProperties" => instance::enumerate_extensions,
        b"vkGetPhysicalDeviceProperties" => instance::properties,
        b"vkGetPhysicalDeviceProperties2" | b"vkGetPhysicalDeviceProperties2KHR"
            => instance::properties2,
        b"vkCreateDevice" => create_device,
    }
}

hooks! {
    /// Of devices.
    device_hook {
        b"vkGetDeviceProcAddr" => get_device_proc_addr,
        b"vkDestroyDevice" => destroy_device,
        b"vkGetDeviceQueue" => queues::get_queue,
        b"vkGetDeviceQueue2" => queues::get_queue2,

        b"vkCreateImage" => images::create_image,
        b"vkDestroyImage" => images::destroy_image,
        b"vkGetDeviceImageMemoryRequirements" | b"vkGetDeviceImageMemoryRequirementsKHR"
            => images::requirements,
        b"vkCreateImageView" => images::create_image_view,
        b"vkDestroyImageView" => images::destroy_image_view,
        b"vkCreateSwapchainKHR" => swapchains::create_swapchain,
        b"vkCreateSharedSwapchainsKHR" => swapchains::create_swapchains,
        b"vkAcquireNextImageKHR" => swapchains::acquire,
        b"vkAcquireNextImage2KHR" => swapchains::acquire2,
        b"vkDestroySwapchainKHR" => swapchains::destroy_swapchain,
        b"vkGetSwapchainImagesKHR" => swapchains::swapchain_images,

        b"vkCreateRenderPass" => passes::create_render_pass,
        b"vkCreateRenderPass2" | b"vkCreateRenderPass2KHR" => passes::create_render_pass2,
        b"vkDestroyRenderPass" => passes::destroy_render_pass,
        b"vkCreateFramebuffer" => passes::create_framebuffer,
        b"vkDestroyFramebuffer" => passes::destroy_framebuffer,
        b"vkCmdBeginRenderPass" => rendering::begin_pass,
        b"vkCmdBeginRenderPass2" | b"vkCmdBeginRenderPass2KHR" => rendering::begin_pass2,
        b"vkCmdNextSubpass" => rendering::subpass,
        b"vkCmdNextSubpass2" | b"vkCmdNextSubpass2KHR" => rendering::subpass2,
        b"vkCmdEndRenderPass" => rendering::end_pass,
        b"vkCmdEndRenderPass2" | b"vkCmdEndRenderPass2KHR" => rendering::end_pass2,
        b"vkCmdBeginRendering" | b"vkCmdBeginRenderingKHR" => rendering::begin_rendering,
        b"vkCmdEndRendering" | b"vkCmdEndRenderingKHR" => rendering::end_rendering,

        b"vkCmdSetRenderingAttachmentLocations" | b"vkCmdSetRenderingAttachmentLocationsKHR"
            => rendering::set_locations,

        b"vkCreateDescriptorUpdateTemplate" | b"vkCreateDescriptorUpdateTemplateKHR"
            => layouts::create_template,
        b"vkDestroyDescriptorUpdateTemplate" | b"vkDestroyDescriptorUpdateTemplateKHR"
            => layouts::destroy_template,
        b"vkDestroyDescriptorSetLayout" => layouts::destroy_set_layout,
        b"vkCreateDescriptorSetLayout" => layouts::create_set_layout,
        b"vkCreatePipelineLayout" => layouts::create_pipeline_layout,
        b"vkDestroyPipelineLayout" => layouts::destroy_pipeline_layout,

        b"vkCreateShaderModule" => pipelines::create_shader_module,
        b"vkDestroyShaderModule" => pipelines::destroy_shader_module,
        b"vkCreateGraphicsPipelines" => pipelines::create_pipelines,
        b"vkDestroyPipeline" => pipelines::destroy_pipeline,

        b"vkAllocateCommandBuffers" => commands::allocate,
        b"vkFreeCommandBuffers" => commands::free,
        b"vkDestroyCommandPool" => commands::destroy_pool,
        b"vkResetCommandPool" => commands::reset_pool,
        b"vkResetCommandBuffer" => commands::reset,
        b"vkBeginCommandBuffer" => commands::begin,
        b"vkEndCommandBuffer" => commands::end,
        b"vkCmdBindPipeline" => commands::bind_pipeline,
        b"vkCmdBindDescriptorSets" => commands::bind_sets,
        b"vkCmdPushDescriptorSet" | b"vkCmdPushDescriptorSetKHR" => commands::push_set,
        b"vkCmdPushDescriptorSetWithTemplate" | b"vkCmdPushDescriptorSetWithTemplateKHR"
            => commands::push_set_template,
        b"vkCmdExecuteCommands" => commands::execute,
        b"vkCmdBeginConditionalRenderingEXT" => writes::begin_condition,
        b"vkCmdEndConditionalRenderingEXT" => writes::end_condition,
        b"vkCmdClearDepthStencilImage" => writes::clear_depth_image,
        b"vkCmdClearAttachments" => writes::clear_attachments,
        b"vkCmdClearColorImage" => writes::clear_colour_image,
        b"vkCmdCopyImage" => writes::copy_image,
        b"vkCmdCopyImage2" | b"vkCmdCopyImage2KHR" => writes::copy_image2,
        b"vkCmdBlitImage" => writes::blit_image,
        b"vkCmdBlitImage2" | b"vkCmdBlitImage2KHR" => writes::blit_image2,
        b"vkCmdResolveImage" => writes::resolve_image,
        b"vkCmdResolveImage2" | b"vkCmdResolveImage2KHR" => writes::resolve_image2,
        b"vkCmdCopyBufferToImage" => writes::copy_from_buffer,
        b"vkCmdCopyBufferToImage2" | b"vkCmdCopyBufferToImage2KHR" => writes::copy_from_buffer2,
        b"vkCmdPipelineBarrier" => barriers::barrier,
        b"vkCmdPipelineBarrier2" | b"vkCmdPipelineBarrier2KHR" => barriers::barrier2,
        b"vkCmdWaitEvents" => barriers::wait_events,
        b"vkCmdWaitEvents2" | b"vkCmdWaitEvents2KHR" => barriers::wait_events2,

        b"vkCmdDraw" => draws::draw,
        b"vkCmdDrawIndexed" => draws::draw_indexed,
        b"vkCmdDrawIndirect" => draws::draw_indirect,
        b"vkCmdDrawIndexedIndirect" => draws::draw_indexed_indirect,
        b"vkCmdDrawIndirectCount" | b"vkCmdDrawIndirectCountKHR" | b"vkCmdDrawIndirectCountAMD"
            => draws::draw_indirect_count,
        b"vkCmdDrawIndexedIndirectCount" | b"vkCmdDrawIndexedIndirectCountKHR"
            | b"vkCmdDrawIndexedIndirectCountAMD" => draws::draw_indexed_indirect_count,
        b"vkCmdDrawIndirectByteCountEXT" => draws::draw_byte_count,
        b"vkCmdDrawMultiEXT" => draws::draw_multi,
        b"vkCmdDrawMultiIndexedEXT" => draws::draw_multi_indexed,

        b"vkCmdSetBlendConstants" => dynamic::blend_constants,
        b"vkCmdSetColorBlendEnableEXT" => dynamic::blend_enable,
        b"vkCmdSetColorBlendEquationEXT" => dynamic::blend_equation,
        b"vkCmdSetColorBlendAdvancedEXT" => dynamic::blend_advanced,
        b"vkCmdSetColorWriteMaskEXT" => dynamic::write_mask,
        b"vkCmdSetColorWriteEnableEXT" => dynamic::write_enable,
        b"vkCmdSetLogicOpEnableEXT" => dynamic::logic_op,
        b"vkCmdSetAlphaToCoverageEnableEXT" => dynamic::alpha_to_coverage,
        b"vkCmdSetAlphaToOneEnableEXT" => dynamic::alpha_to_one,
        b"vkCmdSetDepthTestEnable" | b"vkCmdSetDepthTestEnableEXT" => dynamic::depth_test,
        b"vkCmdSetDepthWriteEnable" | b"vkCmdSetDepthWriteEnableEXT" => dynamic::depth_write,
        b"vkCmdSetDepthCompareOp" | b"vkCmdSetDepthCompareOpEXT" => dynamic::depth_op,
        b"vkCmdSetDepthBoundsTestEnable" | b"vkCmdSetDepthBoundsTestEnableEXT" => dynamic::bounds,
        b"vkCmdSetStencilTestEnable" | b"vkCmdSetStencilTestEnableEXT" => dynamic::stencil_test,
        b"vkCmdSetStencilOp" | b"vkCmdSetStencilOpEXT" => dynamic::stencil_op,

        b"vkQueueSubmit" => submit::queue_submit,
        b"vkQueueSubmit2" | b"vkQueueSubmit2KHR" => submit::queue_submit2,
        b"vkQueueBindSparse" => submit::bind_sparse,
        b"vkQueuePresentKHR" => submit::present,
        b"vkQueueWaitIdle" => submit::queue_wait_idle,
        b"vkDeviceWaitIdle" => submit::device_wait_idle,
        b"vkGetFenceStatus" => submit::fence_status,
        b"vkWaitForFences" => submit::wait_fences,
        b"vkWaitSemaphores" | b"vkWaitSemaphoresKHR" => submit::wait_semaphores,
        b"vkCreateSemaphore" => submit::create_semaphore,
        b"vkDestroySemaphore" => submit::destroy_semaphore,
        b"vkImportSemaphoreFdKHR" => submit::import_semaphore,
        b"vkQueueBeginDebugUtilsLabelEXT" => queues::begin_label,
        b"vkQueueEndDebugUtilsLabelEXT" => queues::end_label,
        b"vkQueueInsertDebugUtilsLabelEXT" => queues::insert_label,
    }
}

hooks! {
    /// Of names that programs give: heard whether or not the driver listens.
    label_hook {
        b"vkCmdBeginDebugUtilsLabelEXT" => barriers::begin_label,
        b"vkCmdEndDebugUtilsLabelEXT" => barriers::end_label,
        b"vkSetDebugUtilsObjectNameEXT" => barriers::set_name,
    }
}

/// A device's function: ours where the next layer has it, too.
fn of_device(name: &CStr, next: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
    next.and_then(|_| device_hook(name)).or_else(|| label_hook(name)).or(next)
}

// Neither of the two is exported: a program's own call would find it in place of the loader's of the
// same name.

pub(crate) unsafe extern "system" fn get_instance_proc_addr(
    handle: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    let text = unsafe { CStr::from_ptr(name) };
    if handle == vk::Instance::null() {
        return instance_hook(text);
    }
    let instance = unsafe { instance::instance(handle) }?;
    let next = unsafe { (instance.get)(handle, name) };
    // Nothing is in the way of a program that is not to be captured.
    if device::SETTINGS.folder.is_none() {
        return next.and_then(|_| passive_hook(text)).or(next);
    }
    next.and_then(|_| instance_hook(text)).or_else(|| of_device(text, next))
}

hooks! {
    /// What has to be known of any program.
    passive_hook {
        b"vkGetInstanceProcAddr" => get_instance_proc_addr,
        b"vkDestroyInstance" => instance::destroy_instance,
        b"vkCreateDevice" => create_device,
        b"vkGetDeviceProcAddr" => get_device_proc_addr,
        b"vkDestroyDevice" => destroy_device,
    }
}

pub(crate) unsafe extern "system" fn get_device_proc_addr(
    handle: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    let text = unsafe { CStr::from_ptr(name) };
    let next = unsafe { device::next(handle, name) };
    match unsafe { device::device(handle) } {
        Some(device) if !device.passive => of_device(text, next),
        _ => next.and_then(|_| passive_hook(text)).or(next),
    }
}
