#version 450
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 first;
layout(location = 1) out vec2 second[2];
layout(location = 3) out ivec4 third;

void main() {
    first = colour;
    second[0] = colour.xy;
    second[1] = colour.zw;
    third = ivec4(colour);
}
