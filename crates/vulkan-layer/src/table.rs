//! The functions of the next layer or the driver, as this layer calls them.

use std::ffi::{CStr, c_char};

use ash::vk;

/// A structure of function pointers. A function that became part of Vulkan later has other names
/// too, of which the first that there is, is taken.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident { $($field:ident: $pfn:ident = $($symbol:literal)|+,)* }) => {
        $(#[$doc])*
        pub(crate) struct $name { $(pub $field: Option<vk::$pfn>,)* }

        impl $name {
            /// # Safety
            /// `get` gives functions of the type that belongs to the name.
            pub(crate) unsafe fn load(get: impl Fn(*const c_char) -> vk::PFN_vkVoidFunction) -> Self {
                let first = |names: &[&CStr]| names.iter().find_map(|name| get(name.as_ptr()));
                Self { $($field: unsafe {
                    std::mem::transmute::<vk::PFN_vkVoidFunction, Option<vk::$pfn>>(
                        first(&[$($symbol),+]),
                    )
                },)* }
            }
        }
    };
}

/// Calls a function of a table. Hooks are handed out only where the next layer has the function, so
/// that it is there; where it were not, nothing happens.
macro_rules! next {
    ($function:expr $(, $argument:expr)* $(,)?) => {
        match $function {
            Some(function) => unsafe { function($($argument),*) },
            None => Default::default(),
        }
    };
}

pub(crate) use next;

table! {
    /// Of an instance.
    InstanceTable {
        destroy_instance: PFN_vkDestroyInstance = c"vkDestroyInstance",
        enumerate_extensions: PFN_vkEnumerateDeviceExtensionProperties
            = c"vkEnumerateDeviceExtensionProperties",
        properties: PFN_vkGetPhysicalDeviceProperties = c"vkGetPhysicalDeviceProperties",
        properties2: PFN_vkGetPhysicalDeviceProperties2
            = c"vkGetPhysicalDeviceProperties2" | c"vkGetPhysicalDeviceProperties2KHR",
        memory: PFN_vkGetPhysicalDeviceMemoryProperties = c"vkGetPhysicalDeviceMemoryProperties",
        features: PFN_vkGetPhysicalDeviceFeatures = c"vkGetPhysicalDeviceFeatures",
        image_format: PFN_vkGetPhysicalDeviceImageFormatProperties
            = c"vkGetPhysicalDeviceImageFormatProperties",
        surface: PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR
            = c"vkGetPhysicalDeviceSurfaceCapabilitiesKHR",
        features2: PFN_vkGetPhysicalDeviceFeatures2
            = c"vkGetPhysicalDeviceFeatures2" | c"vkGetPhysicalDeviceFeatures2KHR",
    }
}

table! {
    /// Of a device.
    DeviceTable {
        get_queue: PFN_vkGetDeviceQueue = c"vkGetDeviceQueue",
        get_queue2: PFN_vkGetDeviceQueue2 = c"vkGetDeviceQueue2",
        queue_wait_idle: PFN_vkQueueWaitIdle = c"vkQueueWaitIdle",
        device_wait_idle: PFN_vkDeviceWaitIdle = c"vkDeviceWaitIdle",
        submit: PFN_vkQueueSubmit = c"vkQueueSubmit",
        submit2: PFN_vkQueueSubmit2 = c"vkQueueSubmit2" | c"vkQueueSubmit2KHR",
        bind_sparse: PFN_vkQueueBindSparse = c"vkQueueBindSparse",
        present: PFN_vkQueuePresentKHR = c"vkQueuePresentKHR",
        queue_begin_label: PFN_vkQueueBeginDebugUtilsLabelEXT = c"vkQueueBeginDebugUtilsLabelEXT",
        queue_end_label: PFN_vkQueueEndDebugUtilsLabelEXT = c"vkQueueEndDebugUtilsLabelEXT",
        queue_insert_label: PFN_vkQueueInsertDebugUtilsLabelEXT
            = c"vkQueueInsertDebugUtilsLabelEXT",
        create_fence: PFN_vkCreateFence = c"vkCreateFence",
        destroy_fence: PFN_vkDestroyFence = c"vkDestroyFence",
        fence_status: PFN_vkGetFenceStatus = c"vkGetFenceStatus",
        reset_fences: PFN_vkResetFences = c"vkResetFences",
        wait_fences: PFN_vkWaitForFences = c"vkWaitForFences",
        wait_semaphores: PFN_vkWaitSemaphores = c"vkWaitSemaphores" | c"vkWaitSemaphoresKHR",
        counter: PFN_vkGetSemaphoreCounterValue
            = c"vkGetSemaphoreCounterValue" | c"vkGetSemaphoreCounterValueKHR",
        create_semaphore: PFN_vkCreateSemaphore = c"vkCreateSemaphore",
        destroy_semaphore: PFN_vkDestroySemaphore = c"vkDestroySemaphore",
        import_semaphore: PFN_vkImportSemaphoreFdKHR = c"vkImportSemaphoreFdKHR",

        create_buffer: PFN_vkCreateBuffer = c"vkCreateBuffer",
        destroy_buffer: PFN_vkDestroyBuffer = c"vkDestroyBuffer",
        buffer_requirements: PFN_vkGetBufferMemoryRequirements = c"vkGetBufferMemoryRequirements",
        address: PFN_vkGetBufferDeviceAddress
            = c"vkGetBufferDeviceAddress" | c"vkGetBufferDeviceAddressKHR",
        allocate: PFN_vkAllocateMemory = c"vkAllocateMemory",
        free_memory: PFN_vkFreeMemory = c"vkFreeMemory",
        bind_buffer: PFN_vkBindBufferMemory = c"vkBindBufferMemory",
        map: PFN_vkMapMemory = c"vkMapMemory",

        create_image: PFN_vkCreateImage = c"vkCreateImage",
        destroy_image: PFN_vkDestroyImage = c"vkDestroyImage",
        image_requirements: PFN_vkGetDeviceImageMemoryRequirements
            = c"vkGetDeviceImageMemoryRequirements" | c"vkGetDeviceImageMemoryRequirementsKHR",
        create_image_view: PFN_vkCreateImageView = c"vkCreateImageView",
        destroy_image_view: PFN_vkDestroyImageView = c"vkDestroyImageView",
        create_swapchain: PFN_vkCreateSwapchainKHR = c"vkCreateSwapchainKHR",
        create_swapchains: PFN_vkCreateSharedSwapchainsKHR = c"vkCreateSharedSwapchainsKHR",
        acquire: PFN_vkAcquireNextImageKHR = c"vkAcquireNextImageKHR",
        acquire2: PFN_vkAcquireNextImage2KHR = c"vkAcquireNextImage2KHR",
        destroy_swapchain: PFN_vkDestroySwapchainKHR = c"vkDestroySwapchainKHR",
        swapchain_images: PFN_vkGetSwapchainImagesKHR = c"vkGetSwapchainImagesKHR",
        create_render_pass: PFN_vkCreateRenderPass = c"vkCreateRenderPass",
        create_render_pass2: PFN_vkCreateRenderPass2
            = c"vkCreateRenderPass2" | c"vkCreateRenderPass2KHR",
        destroy_render_pass: PFN_vkDestroyRenderPass = c"vkDestroyRenderPass",
        create_framebuffer: PFN_vkCreateFramebuffer = c"vkCreateFramebuffer",
        destroy_framebuffer: PFN_vkDestroyFramebuffer = c"vkDestroyFramebuffer",

        create_shader_module: PFN_vkCreateShaderModule = c"vkCreateShaderModule",
        destroy_shader_module: PFN_vkDestroyShaderModule = c"vkDestroyShaderModule",
        create_set_layout: PFN_vkCreateDescriptorSetLayout = c"vkCreateDescriptorSetLayout",
        destroy_set_layout: PFN_vkDestroyDescriptorSetLayout = c"vkDestroyDescriptorSetLayout",
        create_pipeline_layout: PFN_vkCreatePipelineLayout = c"vkCreatePipelineLayout",
        destroy_pipeline_layout: PFN_vkDestroyPipelineLayout = c"vkDestroyPipelineLayout",
        create_pipelines: PFN_vkCreateGraphicsPipelines = c"vkCreateGraphicsPipelines",
        destroy_pipeline: PFN_vkDestroyPipeline = c"vkDestroyPipeline",
        create_pool: PFN_vkCreateDescriptorPool = c"vkCreateDescriptorPool",
        destroy_pool: PFN_vkDestroyDescriptorPool = c"vkDestroyDescriptorPool",
        allocate_sets: PFN_vkAllocateDescriptorSets = c"vkAllocateDescriptorSets",
        update_sets: PFN_vkUpdateDescriptorSets = c"vkUpdateDescriptorSets",

        create_command_pool: PFN_vkCreateCommandPool = c"vkCreateCommandPool",
        destroy_command_pool: PFN_vkDestroyCommandPool = c"vkDestroyCommandPool",
        reset_command_pool: PFN_vkResetCommandPool = c"vkResetCommandPool",
        allocate_command_buffers: PFN_vkAllocateCommandBuffers = c"vkAllocateCommandBuffers",
        free_command_buffers: PFN_vkFreeCommandBuffers = c"vkFreeCommandBuffers",
        reset_command_buffer: PFN_vkResetCommandBuffer = c"vkResetCommandBuffer",
        begin: PFN_vkBeginCommandBuffer = c"vkBeginCommandBuffer",
        end: PFN_vkEndCommandBuffer = c"vkEndCommandBuffer",

        bind_pipeline: PFN_vkCmdBindPipeline = c"vkCmdBindPipeline",
        bind_sets: PFN_vkCmdBindDescriptorSets = c"vkCmdBindDescriptorSets",
        push_set: PFN_vkCmdPushDescriptorSetKHR
            = c"vkCmdPushDescriptorSet" | c"vkCmdPushDescriptorSetKHR",
        push_set_template: PFN_vkCmdPushDescriptorSetWithTemplateKHR
            = c"vkCmdPushDescriptorSetWithTemplate" | c"vkCmdPushDescriptorSetWithTemplateKHR",
        create_template: PFN_vkCreateDescriptorUpdateTemplate
            = c"vkCreateDescriptorUpdateTemplate" | c"vkCreateDescriptorUpdateTemplateKHR",
        destroy_template: PFN_vkDestroyDescriptorUpdateTemplate
            = c"vkDestroyDescriptorUpdateTemplate" | c"vkDestroyDescriptorUpdateTemplateKHR",
        begin_pass: PFN_vkCmdBeginRenderPass = c"vkCmdBeginRenderPass",
        begin_pass2: PFN_vkCmdBeginRenderPass2
            = c"vkCmdBeginRenderPass2" | c"vkCmdBeginRenderPass2KHR",
        next_subpass: PFN_vkCmdNextSubpass = c"vkCmdNextSubpass",
        next_subpass2: PFN_vkCmdNextSubpass2
            = c"vkCmdNextSubpass2" | c"vkCmdNextSubpass2KHR",
        end_pass: PFN_vkCmdEndRenderPass = c"vkCmdEndRenderPass",
        end_pass2: PFN_vkCmdEndRenderPass2 = c"vkCmdEndRenderPass2" | c"vkCmdEndRenderPass2KHR",
        begin_rendering: PFN_vkCmdBeginRendering
            = c"vkCmdBeginRendering" | c"vkCmdBeginRenderingKHR",
        end_rendering: PFN_vkCmdEndRendering
            = c"vkCmdEndRendering" | c"vkCmdEndRenderingKHR",
        set_locations: PFN_vkCmdSetRenderingAttachmentLocationsKHR
            = c"vkCmdSetRenderingAttachmentLocations"
            | c"vkCmdSetRenderingAttachmentLocationsKHR",
        begin_condition: PFN_vkCmdBeginConditionalRenderingEXT
            = c"vkCmdBeginConditionalRenderingEXT",
        end_condition: PFN_vkCmdEndConditionalRenderingEXT = c"vkCmdEndConditionalRenderingEXT",
        execute: PFN_vkCmdExecuteCommands = c"vkCmdExecuteCommands",
        clear_attachments: PFN_vkCmdClearAttachments = c"vkCmdClearAttachments",
        clear_colour_image: PFN_vkCmdClearColorImage = c"vkCmdClearColorImage",
        clear_depth_image: PFN_vkCmdClearDepthStencilImage = c"vkCmdClearDepthStencilImage",
        copy_image: PFN_vkCmdCopyImage = c"vkCmdCopyImage",
        copy_image2: PFN_vkCmdCopyImage2 = c"vkCmdCopyImage2" | c"vkCmdCopyImage2KHR",
        blit_image: PFN_vkCmdBlitImage = c"vkCmdBlitImage",
        blit_image2: PFN_vkCmdBlitImage2 = c"vkCmdBlitImage2" | c"vkCmdBlitImage2KHR",
        resolve_image: PFN_vkCmdResolveImage = c"vkCmdResolveImage",
        resolve_image2: PFN_vkCmdResolveImage2
            = c"vkCmdResolveImage2" | c"vkCmdResolveImage2KHR",
        copy_from_buffer: PFN_vkCmdCopyBufferToImage = c"vkCmdCopyBufferToImage",
        copy_from_buffer2: PFN_vkCmdCopyBufferToImage2
            = c"vkCmdCopyBufferToImage2" | c"vkCmdCopyBufferToImage2KHR",
        copy_to_buffer: PFN_vkCmdCopyImageToBuffer = c"vkCmdCopyImageToBuffer",
        barrier: PFN_vkCmdPipelineBarrier = c"vkCmdPipelineBarrier",
        barrier2: PFN_vkCmdPipelineBarrier2
            = c"vkCmdPipelineBarrier2" | c"vkCmdPipelineBarrier2KHR",
        wait_events: PFN_vkCmdWaitEvents = c"vkCmdWaitEvents",
        wait_events2: PFN_vkCmdWaitEvents2 = c"vkCmdWaitEvents2" | c"vkCmdWaitEvents2KHR",

        draw: PFN_vkCmdDraw = c"vkCmdDraw",
        draw_indexed: PFN_vkCmdDrawIndexed = c"vkCmdDrawIndexed",
        draw_indirect: PFN_vkCmdDrawIndirect = c"vkCmdDrawIndirect",
        draw_indexed_indirect: PFN_vkCmdDrawIndexedIndirect = c"vkCmdDrawIndexedIndirect",
        draw_indirect_count: PFN_vkCmdDrawIndirectCount
            = c"vkCmdDrawIndirectCount" | c"vkCmdDrawIndirectCountKHR" | c"vkCmdDrawIndirectCountAMD",
        draw_indexed_indirect_count: PFN_vkCmdDrawIndexedIndirectCount
            = c"vkCmdDrawIndexedIndirectCount" | c"vkCmdDrawIndexedIndirectCountKHR"
            | c"vkCmdDrawIndexedIndirectCountAMD",
        draw_byte_count: PFN_vkCmdDrawIndirectByteCountEXT = c"vkCmdDrawIndirectByteCountEXT",
        draw_multi: PFN_vkCmdDrawMultiEXT = c"vkCmdDrawMultiEXT",
        draw_multi_indexed: PFN_vkCmdDrawMultiIndexedEXT = c"vkCmdDrawMultiIndexedEXT",

        blend_constants: PFN_vkCmdSetBlendConstants = c"vkCmdSetBlendConstants",
        set_blend_enable: PFN_vkCmdSetColorBlendEnableEXT = c"vkCmdSetColorBlendEnableEXT",
        set_blend_equation: PFN_vkCmdSetColorBlendEquationEXT = c"vkCmdSetColorBlendEquationEXT",
        set_blend_advanced: PFN_vkCmdSetColorBlendAdvancedEXT = c"vkCmdSetColorBlendAdvancedEXT",
        set_write_mask: PFN_vkCmdSetColorWriteMaskEXT = c"vkCmdSetColorWriteMaskEXT",
        set_write_enable: PFN_vkCmdSetColorWriteEnableEXT = c"vkCmdSetColorWriteEnableEXT",
        set_logic_op: PFN_vkCmdSetLogicOpEnableEXT = c"vkCmdSetLogicOpEnableEXT",
        set_alpha_to_one: PFN_vkCmdSetAlphaToOneEnableEXT = c"vkCmdSetAlphaToOneEnableEXT",
        set_alpha_to_coverage: PFN_vkCmdSetAlphaToCoverageEnableEXT
            = c"vkCmdSetAlphaToCoverageEnableEXT",
        set_depth_test: PFN_vkCmdSetDepthTestEnable
            = c"vkCmdSetDepthTestEnable" | c"vkCmdSetDepthTestEnableEXT",
        set_depth_write: PFN_vkCmdSetDepthWriteEnable
            = c"vkCmdSetDepthWriteEnable" | c"vkCmdSetDepthWriteEnableEXT",
        set_depth_op: PFN_vkCmdSetDepthCompareOp
            = c"vkCmdSetDepthCompareOp" | c"vkCmdSetDepthCompareOpEXT",
        set_bounds: PFN_vkCmdSetDepthBoundsTestEnable
            = c"vkCmdSetDepthBoundsTestEnable" | c"vkCmdSetDepthBoundsTestEnableEXT",
        set_stencil_test: PFN_vkCmdSetStencilTestEnable
            = c"vkCmdSetStencilTestEnable" | c"vkCmdSetStencilTestEnableEXT",
        set_stencil_op: PFN_vkCmdSetStencilOp
            = c"vkCmdSetStencilOp" | c"vkCmdSetStencilOpEXT",

        begin_label: PFN_vkCmdBeginDebugUtilsLabelEXT = c"vkCmdBeginDebugUtilsLabelEXT",
        end_label: PFN_vkCmdEndDebugUtilsLabelEXT = c"vkCmdEndDebugUtilsLabelEXT",
        set_name: PFN_vkSetDebugUtilsObjectNameEXT = c"vkSetDebugUtilsObjectNameEXT",
    }
}
