#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    target = vec4(colour.rgb * colour.a, colour.a);
}
