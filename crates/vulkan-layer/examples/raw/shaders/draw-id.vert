#version 460
// A shape of each draw of a command, where the draw's number says.
layout(push_constant) uniform Shape {
    vec4 place;
    vec4 colour;
} shape;
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

const vec2 CORNERS[6] = vec2[](
    vec2(0, 0), vec2(1, 0), vec2(0, 1), vec2(1, 0), vec2(1, 1), vec2(0, 1));

void main() {
    float k = float(gl_DrawID);
    vec2 at = shape.place.xy + shape.place.z * CORNERS[gl_VertexIndex % 6] + k * vec2(0.1, 0.2);
    at.x += float(gl_InstanceIndex - gl_BaseInstance) * 0.1;
    gl_Position = vec4(at, shape.place.w, 1);
    colour = vec4(shape.colour.rgb / (1 + k), shape.colour.a);
    instance = uint(gl_BaseInstance);
}
