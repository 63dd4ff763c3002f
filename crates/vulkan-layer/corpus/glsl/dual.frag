#version 450
layout(location = 0) in vec4 colour;
layout(location = 0, index = 1) out vec4 factor;
layout(location = 0, index = 0) out vec4 result;

void main() {
    result = colour;
    factor = vec4(colour.a);
}
