#version 450
// Depth is written even where the shader discards, since the test comes first.
layout(early_fragment_tests) in;
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    if (uint(gl_FragCoord.x) / 4 % 2 == 0) discard;
    target = colour;
}
