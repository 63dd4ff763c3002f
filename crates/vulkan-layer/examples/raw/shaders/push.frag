#version 450
layout(push_constant) uniform Shape {
    vec4 place;
    vec4 colour;
    vec4 corners[4];
    vec4 tints[2];
} shape;
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    target = colour * shape.tints[instance % 2];
}
