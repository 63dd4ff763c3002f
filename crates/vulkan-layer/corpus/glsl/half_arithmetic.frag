#version 450
#extension GL_EXT_shader_explicit_arithmetic_types_float16 : require
#extension GL_EXT_shader_16bit_storage : require
layout(location = 0) in vec4 colour;
layout(location = 0) out f16vec3 result;

void main() { result = f16vec3(colour.rgb) * float16_t(0.5); }
