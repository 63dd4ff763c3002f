#version 450
// The depth is ignored: tests come before it.
layout(early_fragment_tests) in;
layout(location = 0) out vec4 result;

void main() {
    result = vec4(1.0);
    gl_FragDepth = 0.25;
}
