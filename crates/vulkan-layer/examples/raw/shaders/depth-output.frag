#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    target = colour;
    // Ripples, so that shapes cut each other.
    gl_FragDepth = gl_FragCoord.z + 0.2 * sin(gl_FragCoord.x * 0.2);
}
