#version 450
layout(location = 0) in vec3 place;
layout(location = 0) out vec4 colour;
layout(location = 3) out vec2 uv;

void main() {
    colour = vec4(place, 1.0);
    uv = place.xy;
    gl_Position = vec4(place, 1.0);
}
