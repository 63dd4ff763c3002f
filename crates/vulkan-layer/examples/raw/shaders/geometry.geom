#version 450
// Each triangle, and a smaller one beside it.
layout(triangles) in;
layout(triangle_strip, max_vertices = 6) out;
layout(location = 0) in vec4 colours[];
layout(location = 1) flat in uint instances[];
layout(location = 0) out vec4 colour;
layout(location = 1) flat out uint instance;

void main() {
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 3; i++) {
            vec4 at = gl_in[i].gl_Position;
            gl_Position = vec4(at.xy * (1 - 0.4 * k) + 0.3 * k, at.zw);
            colour = colours[i];
            instance = instances[i] + uint(k);
            gl_PrimitiveID = gl_PrimitiveIDIn;
            EmitVertex();
        }
        EndPrimitive();
    }
}
