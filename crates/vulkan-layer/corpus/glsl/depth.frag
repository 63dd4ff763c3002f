#version 450
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 result;

void main() {
    result = colour;
    gl_FragDepth = gl_FragCoord.z * 0.5;
}
