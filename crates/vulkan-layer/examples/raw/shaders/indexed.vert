#version 450
// Corners of vertex buffers, places and colours of instances.
layout(location = 0) in vec2 corner;
layout(location = 1) in vec4 place;
layout(location = 2) in vec4 tint;
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

void main() {
    gl_Position = vec4(place.xy + place.z * corner, place.w, 1);
    colour = tint;
    instance = uint(gl_InstanceIndex);
}
