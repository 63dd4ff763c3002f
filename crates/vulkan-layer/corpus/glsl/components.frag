#version 450
layout(location = 0) in vec4 colour;
layout(location = 0, component = 3) out float alpha;
layout(location = 0, component = 0) out vec2 red_green;
layout(location = 1, component = 1) out vec2 others[2];

void main() {
    alpha = colour.a;
    red_green = colour.rg;
    others[0] = colour.ba;
    others[1] = colour.bb;
}
