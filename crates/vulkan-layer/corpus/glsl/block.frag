#version 450
struct Light { vec4 colour; vec3 way[2]; };
layout(location = 1) in Handed {
    mat3 turn;
    vec2 uv[4];
    Light light;
} handed;
layout(location = 0) out vec4 result;

void main() { result = vec4(handed.turn * handed.light.way[1], handed.uv[3].x); }
