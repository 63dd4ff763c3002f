#version 450
// A triangle (3 vertices) or a square (6), with each instance a little further along, and a little
// lower what begins at a later vertex.
layout(push_constant) uniform Shape {
    vec4 place; // x, y, size, depth
    vec4 colour;
} shape;
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

const vec2 CORNERS[6] = vec2[](
    vec2(0, 0), vec2(1, 0), vec2(0, 1), vec2(1, 0), vec2(1, 1), vec2(0, 1));

void main() {
    vec2 corner = CORNERS[gl_VertexIndex % 6];
    float k = float(gl_InstanceIndex);
    vec2 at = shape.place.xy + shape.place.z * corner + k * vec2(0.17, 0.11);
    at.y += 0.2 * float(gl_VertexIndex / 6);
    // Depth leans, so that it has slopes.
    float depth = shape.place.w + 0.03 * corner.x - 0.02 * corner.y + 0.04 * k;
    gl_Position = vec4(at, depth, 1);
    colour = vec4(shape.colour.rgb * (1 - 0.4 * corner.y), shape.colour.a * (1 - 0.3 * corner.x));
    instance = uint(gl_InstanceIndex);
}
