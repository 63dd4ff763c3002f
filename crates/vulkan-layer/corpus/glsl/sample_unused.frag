#version 450
// Run once a pixel all the same.
layout(location = 0) sample in vec4 colour;
layout(location = 0) out vec4 result;

void main() { result = vec4(1.0); }
