#version 450
// Has all inputs that a record needs.
layout(location = 0) flat in int instance;
layout(location = 0) out vec4 result;

void main() {
    result = vec4(gl_FragCoord.z, float(gl_PrimitiveID), gl_FrontFacing ? 1.0 : 0.0,
                  float(gl_SampleMaskIn[0] + instance));
}
