#version 450
layout(depth_less) out float gl_FragDepth;
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 result;

void main() {
    if (colour.a < 0.5) discard;
    result = colour;
    gl_FragDepth = gl_FragCoord.z - 0.125 * colour.r;
}
