#version 450
layout(triangles, equal_spacing, ccw) in;
layout(location = 0) in vec4 colours[];
layout(location = 1) in uint instances[];
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

void main() {
    vec3 t = gl_TessCoord;
    vec4 at = t.x * gl_in[0].gl_Position + t.y * gl_in[1].gl_Position + t.z * gl_in[2].gl_Position;
    // Bulges, so that the new edges show.
    at.xy *= 1 + 0.3 * t.x * t.y * t.z;
    gl_Position = at;
    colour = t.x * colours[0] + t.y * colours[1] + t.z * colours[2];
    instance = instances[0];
}
