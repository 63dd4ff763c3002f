#version 450
layout(location = 2) in Handed {
    vec4 colour;
    sample vec2 uv;
} handed;
layout(location = 0) out vec4 result;

void main() { result = handed.colour + handed.uv.xyxy; }
