#version 450
layout(location = 0) sample in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    target = vec4(colour.rgb * (0.4 + 0.2 * float(gl_SampleID)), colour.a);
}
