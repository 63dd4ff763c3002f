#version 450
layout(location = 0) out float result;
layout(location = 2) out vec3 other;

void main() {
    result = 0.5;
    other = vec3(0.25);
}
