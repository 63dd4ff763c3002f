#version 450
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 result;

// Ends within another function, and after a first store.
void cut(float limit) {
    if (colour.a < limit) discard;
}

void main() {
    result = vec4(0.0);
    cut(0.25);
    if (gl_FragCoord.x > 8.0) return;
    cut(0.5);
    result = colour;
}
