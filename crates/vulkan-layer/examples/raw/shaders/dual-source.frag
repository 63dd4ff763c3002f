#version 450
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0, index = 0) out vec4 target;
layout(location = 0, index = 1) out vec4 coverage;

void main() {
    target = vec4(colour.rgb * colour.a, colour.a);
    // What each colour lets through, as coloured glass does.
    coverage = vec4(colour.gbr * colour.a, colour.a);
}
