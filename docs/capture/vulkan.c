/* Draws triangles with Vulkan, has the fragment shader record its fragments, and writes them as
 * a trace. Without a window; any Vulkan 1.1 driver does, Mesa's software one (lavapipe) too.
 *
 *     glslangValidator -V triangles.vert -o vert.spv
 *     glslangValidator -V -I<folder of append.glsl> triangles.frag -o frag.spv
 *     cc -std=c99 -I<folder of screendoor_trace.h> vulkan.c -lvulkan -o vulkan
 *     ./vulkan vert.spv frag.spv vulkan.arrow
 */
#define SCREENDOOR_TRACE_IMPLEMENTATION
#include "screendoor_trace.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

enum { WIDTH = 320, HEIGHT = 240, SAMPLES = 4 };

/* A corner: its place in clip space (y up, as in Direct3D and WebGPU), and its colour, linear
 * and not multiplied by alpha. */
typedef struct Corner {
    float place[4], colour[4];
} Corner;

static const Corner FAN[] = {
    {{-0.9f, -0.8f, 0.20f, 1}, {0.9f, 0.1f, 0.05f, 0.6f}},
    {{0.5f, -0.7f, 0.70f, 1}, {0.9f, 0.1f, 0.05f, 0.6f}},
    {{-0.2f, 0.9f, 0.40f, 1}, {0.9f, 0.1f, 0.05f, 0.6f}},
    {{-0.6f, -0.9f, 0.60f, 1}, {0.05f, 0.3f, 0.9f, 0.5f}},
    {{0.9f, -0.5f, 0.20f, 1}, {0.05f, 0.3f, 0.9f, 0.5f}},
    {{0.1f, 0.8f, 0.50f, 1}, {0.05f, 0.3f, 0.9f, 0.5f}},
    {{-0.8f, 0.5f, 0.45f, 1}, {0.1f, 0.8f, 0.1f, 0.4f}},
    {{0.8f, 0.4f, 0.45f, 1}, {0.1f, 0.8f, 0.1f, 0.4f}},
    {{0.0f, -0.9f, 0.45f, 1}, {0.1f, 0.8f, 0.1f, 0.4f}},
};

static void fail(const char *what) {
    fprintf(stderr, "vulkan: %s\n", what);
    exit(1);
}

static void check(VkResult result, const char *what) {
    if (result != VK_SUCCESS) fail(what);
}

/* The bytes of a file, and how many. */
static void *contents(const char *path, size_t *bytes) {
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END)) fail(path);
    const long length = ftell(file);
    rewind(file);
    void *all = length > 0 ? malloc((size_t)length) : NULL;
    if (!all || fread(all, 1, (size_t)length, file) != (size_t)length) fail(path);
    fclose(file);
    *bytes = (size_t)length;
    return all;
}

static VkPhysicalDevice physical;
static VkDevice device;
static VkQueue queue;

static VkDeviceMemory memory(VkMemoryRequirements needs, VkMemoryPropertyFlags wanted) {
    VkPhysicalDeviceMemoryProperties all;
    vkGetPhysicalDeviceMemoryProperties(physical, &all);
    VkMemoryAllocateInfo info = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    info.allocationSize = needs.size;
    for (; info.memoryTypeIndex < all.memoryTypeCount; info.memoryTypeIndex++) {
        const VkMemoryType type = all.memoryTypes[info.memoryTypeIndex];
        const bool fits = needs.memoryTypeBits >> info.memoryTypeIndex & 1;
        if (fits && (type.propertyFlags & wanted) == wanted) break;
    }
    if (info.memoryTypeIndex == all.memoryTypeCount) fail("there is no memory of that type");
    VkDeviceMemory found;
    check(vkAllocateMemory(device, &info, NULL, &found), "there is not enough memory");
    return found;
}

/* A buffer that the processor sees, too. */
typedef struct Buffer {
    VkBuffer buffer;
    VkDeviceMemory memory;
    void *data;
} Buffer;

static Buffer make_buffer(VkDeviceSize bytes, VkBufferUsageFlags usage) {
    Buffer made;
    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = bytes, info.usage = usage;
    check(vkCreateBuffer(device, &info, NULL, &made.buffer), "a buffer cannot be made");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, made.buffer, &needs);
    made.memory = memory(
        needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    check(vkBindBufferMemory(device, made.buffer, made.memory, 0), "a buffer has no memory");
    check(vkMapMemory(device, made.memory, 0, bytes, 0, &made.data), "a buffer cannot be seen");
    return made;
}

static void free_buffer(Buffer buffer) {
    vkDestroyBuffer(device, buffer.buffer, NULL);
    vkFreeMemory(device, buffer.memory, NULL);
}

static void open_device(void) {
    VkApplicationInfo application = {VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.apiVersion = VK_API_VERSION_1_1;
    VkInstanceCreateInfo instance_info = {VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    instance_info.pApplicationInfo = &application;
    VkInstance instance;
    check(vkCreateInstance(&instance_info, NULL, &instance), "there is no Vulkan here");
    uint32_t count = 1;
    const VkResult found = vkEnumeratePhysicalDevices(instance, &count, &physical);
    if ((found != VK_SUCCESS && found != VK_INCOMPLETE) || count == 0) fail("there is no device");
    VkPhysicalDeviceFeatures has, wanted = {0};
    vkGetPhysicalDeviceFeatures(physical, &has);
    /* A fragment shader is to write to a buffer. */
    if (!has.fragmentStoresAndAtomics) fail("the device lacks fragmentStoresAndAtomics");
    wanted.fragmentStoresAndAtomics = VK_TRUE;
    const float priority = 1;
    VkDeviceQueueCreateInfo queue_info = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    queue_info.queueCount = 1, queue_info.pQueuePriorities = &priority;
    VkQueueFamilyProperties families[16];
    uint32_t family_count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &family_count, families);
    while (queue_info.queueFamilyIndex < family_count &&
           !(families[queue_info.queueFamilyIndex].queueFlags & VK_QUEUE_GRAPHICS_BIT))
        queue_info.queueFamilyIndex++;
    if (queue_info.queueFamilyIndex == family_count) fail("the device does not draw");
    VkDeviceCreateInfo info = {VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    info.queueCreateInfoCount = 1, info.pQueueCreateInfos = &queue_info;
    info.pEnabledFeatures = &wanted;
    check(vkCreateDevice(physical, &info, NULL, &device), "the device cannot be opened");
    vkGetDeviceQueue(device, queue_info.queueFamilyIndex, 0, &queue);
}

/* A colour target of several samples, of which nothing is kept: what is asked for is which
 * samples are covered. */
static VkImageView make_target(VkFormat format) {
    VkImageCreateInfo info = {VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D, info.format = format;
    info.extent.width = WIDTH, info.extent.height = HEIGHT, info.extent.depth = 1;
    info.mipLevels = 1, info.arrayLayers = 1, info.samples = (VkSampleCountFlagBits)SAMPLES;
    info.usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
    VkImage image;
    check(vkCreateImage(device, &info, NULL, &image), "a target cannot be made");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device, image, &needs);
    check(vkBindImageMemory(device, image, memory(needs, 0), 0), "a target has no memory");
    VkImageViewCreateInfo view_info = {VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    view_info.image = image, view_info.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view_info.format = format, view_info.subresourceRange.aspectMask = VK_IMAGE_ASPECT_COLOR_BIT;
    view_info.subresourceRange.levelCount = view_info.subresourceRange.layerCount = 1;
    VkImageView view;
    check(vkCreateImageView(device, &view_info, NULL, &view), "a target cannot be seen");
    return view;
}

static VkRenderPass make_pass(VkFormat format) {
    VkAttachmentDescription target = {0};
    target.format = format, target.samples = (VkSampleCountFlagBits)SAMPLES;
    target.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR, target.storeOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    target.finalLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    const VkAttachmentReference colour = {0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass = {0};
    subpass.colorAttachmentCount = 1, subpass.pColorAttachments = &colour;
    VkRenderPassCreateInfo info = {VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
    info.attachmentCount = 1, info.pAttachments = &target;
    info.subpassCount = 1, info.pSubpasses = &subpass;
    VkRenderPass pass;
    check(vkCreateRenderPass(device, &info, NULL, &pass), "a pass cannot be made");
    return pass;
}

static VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits which, const char *path) {
    VkShaderModuleCreateInfo module = {VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    void *code = contents(path, &module.codeSize);
    module.pCode = (const uint32_t *)code;
    VkPipelineShaderStageCreateInfo info = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
    info.stage = which, info.pName = "main";
    check(vkCreateShaderModule(device, &module, NULL, &info.module), path);
    free(code);
    return info;
}

/* Without a depth test and without culling: what they reject would not be recorded. */
static VkPipeline make_pipeline(VkPipelineLayout layout, VkRenderPass pass,
    const VkPipelineShaderStageCreateInfo stages[2]) {
    const VkVertexInputBindingDescription binding = {0, sizeof(Corner), VK_VERTEX_INPUT_RATE_VERTEX};
    const VkVertexInputAttributeDescription attributes[2] = {
        {0, 0, VK_FORMAT_R32G32B32A32_SFLOAT, offsetof(Corner, place)},
        {1, 0, VK_FORMAT_R32G32B32A32_SFLOAT, offsetof(Corner, colour)}};
    VkPipelineVertexInputStateCreateInfo input = {
        VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
    input.vertexBindingDescriptionCount = 1, input.pVertexBindingDescriptions = &binding;
    input.vertexAttributeDescriptionCount = 2, input.pVertexAttributeDescriptions = attributes;
    VkPipelineInputAssemblyStateCreateInfo assembly = {
        VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
    assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
    /* Upside down, so that y is up. */
    const VkViewport viewport = {0, HEIGHT, WIDTH, -HEIGHT, 0, 1};
    const VkRect2D scissor = {{0, 0}, {WIDTH, HEIGHT}};
    VkPipelineViewportStateCreateInfo view = {
        VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};
    view.viewportCount = 1, view.pViewports = &viewport;
    view.scissorCount = 1, view.pScissors = &scissor;
    VkPipelineRasterizationStateCreateInfo raster = {
        VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
    raster.polygonMode = VK_POLYGON_MODE_FILL, raster.lineWidth = 1;
    VkPipelineMultisampleStateCreateInfo samples = {
        VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
    samples.rasterizationSamples = (VkSampleCountFlagBits)SAMPLES;
    const VkPipelineColorBlendAttachmentState written = {0};
    VkPipelineColorBlendStateCreateInfo blend = {
        VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
    blend.attachmentCount = 1, blend.pAttachments = &written;
    VkGraphicsPipelineCreateInfo info = {VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
    info.stageCount = 2, info.pStages = stages;
    info.pVertexInputState = &input, info.pInputAssemblyState = &assembly;
    info.pViewportState = &view, info.pRasterizationState = &raster;
    info.pMultisampleState = &samples, info.pColorBlendState = &blend;
    info.layout = layout, info.renderPass = pass;
    VkPipeline pipeline;
    check(vkCreateGraphicsPipelines(device, VK_NULL_HANDLE, 1, &info, NULL, &pipeline),
        "a pipeline cannot be made");
    return pipeline;
}

int main(int argc, char **argv) {
    if (argc < 4) fail("usage: vulkan vert.spv frag.spv TRACE [FILE-OF-CORNERS]");
    const Corner *corners = FAN;
    size_t bytes = sizeof FAN;
    if (argc > 4) corners = (const Corner *)contents(argv[4], &bytes);
    open_device();

    /* The pipeline, and where the fragments' buffer is bound: set 0, binding 0. */
    VkDescriptorSetLayoutBinding slot = {0};
    slot.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, slot.descriptorCount = 1;
    slot.stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT;
    VkDescriptorSetLayoutCreateInfo set_info = {
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    set_info.bindingCount = 1, set_info.pBindings = &slot;
    VkDescriptorSetLayout set_layout;
    check(vkCreateDescriptorSetLayout(device, &set_info, NULL, &set_layout), "no set");
    VkPipelineLayoutCreateInfo layout_info = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout_info.setLayoutCount = 1, layout_info.pSetLayouts = &set_layout;
    VkPipelineLayout layout;
    check(vkCreatePipelineLayout(device, &layout_info, NULL, &layout), "no layout");
    const VkFormat format = VK_FORMAT_R8G8B8A8_UNORM;
    const VkRenderPass pass = make_pass(format);
    const VkPipelineShaderStageCreateInfo stages[2] = {
        stage(VK_SHADER_STAGE_VERTEX_BIT, argv[1]), stage(VK_SHADER_STAGE_FRAGMENT_BIT, argv[2])};
    const VkPipeline pipeline = make_pipeline(layout, pass, stages);
    const VkImageView target = make_target(format);
    VkFramebufferCreateInfo frame_info = {VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
    frame_info.renderPass = pass, frame_info.attachmentCount = 1, frame_info.pAttachments = &target;
    frame_info.width = WIDTH, frame_info.height = HEIGHT, frame_info.layers = 1;
    VkFramebuffer frame;
    check(vkCreateFramebuffer(device, &frame_info, NULL, &frame), "no frame");
    const VkDescriptorPoolSize pool_size = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1};
    VkDescriptorPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool_info.maxSets = 1, pool_info.poolSizeCount = 1, pool_info.pPoolSizes = &pool_size;
    VkDescriptorPool pool;
    check(vkCreateDescriptorPool(device, &pool_info, NULL, &pool), "no pool");
    VkDescriptorSetAllocateInfo allocate = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocate.descriptorPool = pool, allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout;
    VkDescriptorSet set;
    check(vkAllocateDescriptorSets(device, &allocate, &set), "no set");
    const Buffer vertices = make_buffer(bytes, VK_BUFFER_USAGE_VERTEX_BUFFER_BIT);
    memcpy(vertices.data, corners, bytes);

    /* Draw, and again with a larger buffer where there were more fragments than it holds. */
    uint32_t capacity = 1 << 10, count;
    Buffer fragments;
    for (;;) {
        fragments = make_buffer(
            4 + (VkDeviceSize)capacity * sizeof(screendoor_raw_fragment),
            VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
        memset(fragments.data, 0, 4); /* the count */
        const VkDescriptorBufferInfo all = {fragments.buffer, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = set, write.descriptorCount = 1;
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, write.pBufferInfo = &all;
        vkUpdateDescriptorSets(device, 1, &write, 0, NULL);

        VkCommandPoolCreateInfo commands_info = {VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
        VkCommandPool commands;
        check(vkCreateCommandPool(device, &commands_info, NULL, &commands), "no commands");
        VkCommandBufferAllocateInfo one = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
        one.commandPool = commands, one.commandBufferCount = 1;
        VkCommandBuffer draw;
        check(vkAllocateCommandBuffers(device, &one, &draw), "no commands");
        VkCommandBufferBeginInfo begin = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
        check(vkBeginCommandBuffer(draw, &begin), "no commands");
        const VkClearValue black = {{{0, 0, 0, 0}}};
        VkRenderPassBeginInfo begin_pass = {VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
        begin_pass.renderPass = pass, begin_pass.framebuffer = frame;
        begin_pass.renderArea.extent.width = WIDTH, begin_pass.renderArea.extent.height = HEIGHT;
        begin_pass.clearValueCount = 1, begin_pass.pClearValues = &black;
        vkCmdBeginRenderPass(draw, &begin_pass, VK_SUBPASS_CONTENTS_INLINE);
        vkCmdBindPipeline(draw, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
        vkCmdBindDescriptorSets(
            draw, VK_PIPELINE_BIND_POINT_GRAPHICS, layout, 0, 1, &set, 0, NULL);
        const VkDeviceSize from_the_start = 0;
        vkCmdBindVertexBuffers(draw, 0, 1, &vertices.buffer, &from_the_start);
        vkCmdDraw(draw, (uint32_t)(bytes / sizeof(Corner)), 1, 0, 0);
        vkCmdEndRenderPass(draw);
        /* What shaders wrote is to be seen by the processor. */
        VkMemoryBarrier barrier = {VK_STRUCTURE_TYPE_MEMORY_BARRIER};
        barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
        barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
        vkCmdPipelineBarrier(draw, VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT,
            VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, NULL, 0, NULL);
        check(vkEndCommandBuffer(draw), "no commands");
        VkSubmitInfo submit = {VK_STRUCTURE_TYPE_SUBMIT_INFO};
        submit.commandBufferCount = 1, submit.pCommandBuffers = &draw;
        check(vkQueueSubmit(queue, 1, &submit, VK_NULL_HANDLE), "it cannot be drawn");
        check(vkQueueWaitIdle(queue), "the device was lost");
        vkDestroyCommandPool(device, commands, NULL);
        memcpy(&count, fragments.data, 4);
        if (count <= capacity) break;
        free_buffer(fragments);
        capacity = count;
    }

    screendoor_header header = {0};
    header.width = WIDTH, header.height = HEIGHT, header.samples = SAMPLES;
    header.source = "triangles by Vulkan", header.camera = "clip space";
    /* A copy: it is sorted, and memory that devices write to is slow to work in. */
    const size_t length = count * sizeof(screendoor_raw_fragment);
    screendoor_raw_fragment *raw = (screendoor_raw_fragment *)malloc(length + 1);
    if (!raw) fail("there is not enough memory");
    memcpy(raw, (const char *)fragments.data + 4, length);
    screendoor_trace *trace = screendoor_trace_open(argv[3], &header);
    screendoor_trace_push_raw(trace, raw, count);
    free(raw);
    if (!screendoor_trace_close(trace)) fail(screendoor_trace_error(trace));
    screendoor_trace_free(trace);
    printf("%s: %u fragments\n", argv[3], count);
    return 0;
}
