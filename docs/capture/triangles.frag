#version 450
#extension GL_GOOGLE_include_directive : require
#include "append.glsl"

layout(location = 0) flat in uint triangle;
layout(location = 1) flat in vec4 colour_of_triangle;
layout(location = 0) out vec4 colour;

void main() {
    vec3 depth = captured_depth(gl_FragCoord);
    colour = colour_of_triangle;
    append_fragment(gl_FragCoord, depth, uint(gl_SampleMaskIn[0]), triangle, 0u, colour);
}
