#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    target = colour;
    // Fewer samples further to the right.
    gl_SampleMask[0] = (15 >> int(gl_FragCoord.x) / 50) & gl_SampleMaskIn[0];
}
