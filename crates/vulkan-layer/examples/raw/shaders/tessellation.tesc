#version 450
layout(vertices = 3) out;
layout(location = 0) in vec4 colours_in[];
layout(location = 1) flat in uint instances_in[];
layout(location = 0) out vec4 colours[];
layout(location = 1) out uint instances[];

void main() {
    gl_out[gl_InvocationID].gl_Position = gl_in[gl_InvocationID].gl_Position;
    colours[gl_InvocationID] = colours_in[gl_InvocationID];
    instances[gl_InvocationID] = instances_in[gl_InvocationID];
    gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = 4;
    gl_TessLevelInner[0] = 4;
}
