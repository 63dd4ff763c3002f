#version 450
#extension GL_ARB_fragment_shader_interlock : require
layout(pixel_interlock_ordered) in;
layout(set = 0, binding = 0, r32f) uniform image2D sums;
layout(location = 0) out vec4 result;

void main() {
    beginInvocationInterlockARB();
    ivec2 at = ivec2(gl_FragCoord.xy);
    imageStore(sums, at, imageLoad(sums, at) + 1.0);
    endInvocationInterlockARB();
    result = vec4(1.0);
}
