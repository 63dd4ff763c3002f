#version 450
#pragma use_vulkan_memory_model
#extension GL_KHR_memory_scope_semantics : require
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 result;
layout(set = 0, binding = 0) buffer Count { uint count; };

void main() {
    uint n = atomicAdd(count, 1u, gl_ScopeQueueFamily, gl_StorageSemanticsNone, gl_SemanticsRelaxed);
    result = colour * float(n);
}
