#version 450
layout(constant_id = 0) const int N = 3;
layout(location = 0) out vec4 colours[N];

void main() {
    colours[0] = vec4(1.0);
    gl_Position = vec4(0.0);
}
