#version 450
// All 128 bytes of push constants, which is what every device has.
layout(push_constant) uniform Shape {
    vec4 place;
    vec4 colour;
    vec4 corners[4];
    vec4 tints[2];
} shape;
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

const uint CORNERS[6] = uint[](0, 1, 2, 1, 3, 2);

void main() {
    uint corner = CORNERS[gl_VertexIndex % 6];
    vec2 at = shape.place.xy + shape.place.z * shape.corners[corner].xy;
    at += float(gl_InstanceIndex) * shape.corners[corner].zw;
    gl_Position = vec4(at, shape.place.w, 1);
    colour = shape.colour;
    instance = uint(gl_InstanceIndex);
}
