#version 450
#extension GL_EXT_buffer_reference : require
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Colours { vec4 colour[]; };
layout(push_constant) uniform Push { Colours colours; };
layout(location = 0) flat in int which;
layout(location = 0) out vec4 result;

void main() { result = colours.colour[which]; }
