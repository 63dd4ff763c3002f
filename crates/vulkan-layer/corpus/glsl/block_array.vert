#version 450
// Two locations each.
layout(location = 3) out Handed {
    vec4 colour;
    vec2 uv;
} handed[4];

void main() {
    handed[3].colour = vec4(1.0);
    handed[2].uv = vec2(0.0);
    gl_Position = vec4(0.0);
}
