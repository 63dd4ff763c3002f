#version 450
#extension GL_EXT_fragment_shader_barycentric : require
layout(location = 1) pervertexEXT in vec4 corners[3];
layout(location = 2) in vec2 uv;
layout(location = 0) out vec4 result;

void main() {
    result = gl_BaryCoordEXT.x * corners[0] + gl_BaryCoordEXT.y * corners[1] + uv.xyxy;
}
