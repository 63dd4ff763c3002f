#version 450
#extension GL_EXT_demote_to_helper_invocation : require
layout(location = 0) in vec4 colour;
layout(location = 0) out vec4 result;
layout(set = 0, binding = 0) uniform sampler2D picture;

void main() {
    if (colour.a < 0.5) demote;
    result = texture(picture, colour.xy);
}
