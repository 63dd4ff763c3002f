#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out uvec4 target;

void main() {
    target = uvec4(colour * 255);
}
