#version 450
// The third follows the second at 8, and is two matrices of 4 locations.
out Handed {
    layout(location = 1) vec4 far;
    layout(location = 7) float near;
    layout(location = 8) mat4 turns[2];
    layout(location = 2) vec2 uv;
} handed;

void main() {
    handed.far = vec4(1.0);
    handed.near = 1.0;
    handed.turns[1] = mat4(1.0);
    handed.uv = vec2(0.0);
    gl_Position = vec4(0.0);
}
