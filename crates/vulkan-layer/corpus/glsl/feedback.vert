#version 450
layout(xfb_buffer = 0, xfb_stride = 32) out;
layout(location = 0, xfb_offset = 16) out vec4 colour;
out gl_PerVertex { layout(xfb_offset = 0) vec4 gl_Position; };

void main() {
    colour = vec4(1.0);
    gl_Position = vec4(0.0);
}
