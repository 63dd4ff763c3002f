#version 450
// Run once a pixel or for each sample, as drivers like it.
layout(location = 0) sample in vec4 colour;
layout(location = 0) out vec4 result;

void main() { result = vec4(1.0); }
