#version 450
#extension GL_EXT_multiview : require
// A shape, elsewhere in each view.
layout(push_constant) uniform Shape {
    vec4 place;
    vec4 colour;
} shape;
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

const vec2 CORNERS[6] = vec2[](
    vec2(0, 0), vec2(1, 0), vec2(0, 1), vec2(1, 0), vec2(1, 1), vec2(0, 1));

void main() {
    vec2 at = shape.place.xy + shape.place.z * CORNERS[gl_VertexIndex % 6];
    at += float(gl_InstanceIndex) * vec2(0.17, 0.11);
    at.x += float(gl_ViewIndex) * 0.3;
    gl_Position = vec4(at, shape.place.w, 1);
    colour = shape.colour;
    instance = uint(gl_InstanceIndex);
}
