#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require
layout(location = 0) in f16vec4 colour;
layout(location = 0) out f16vec4 result;
layout(location = 1) out float16_t other;

void main() {
    result = colour;
    other = float16_t(0.5);
}
