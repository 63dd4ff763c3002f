#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;
layout(location = 1) out vec4 other;

void main() {
    target = colour;
    other = vec4(colour.bgr * 0.5, colour.a);
}
