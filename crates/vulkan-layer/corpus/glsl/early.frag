#version 450
layout(early_fragment_tests) in;
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 result;

void main() {
    if (colour.a < 0.5) discard;
    result = colour;
}
