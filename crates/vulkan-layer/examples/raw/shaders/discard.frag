#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    // One pixel in four of a checkered pattern is not drawn.
    uvec2 pixel = uvec2(gl_FragCoord.xy) / 3;
    if ((pixel.x + pixel.y + instance) % 4 == 0) discard;
    target = colour;
}
