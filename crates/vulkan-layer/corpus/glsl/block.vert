#version 450
struct Light { vec4 colour; vec3 way[2]; };
// The locations 1 to 10: 3 of the matrix, 4, and 1 + 2 of the light.
layout(location = 1) out Handed {
    mat3 turn;
    vec2 uv[4];
    Light light;
} handed;

void main() {
    handed.turn = mat3(1.0);
    handed.uv[3] = vec2(0.0);
    handed.light.way[1] = vec3(1.0);
    gl_Position = vec4(0.0);
}
