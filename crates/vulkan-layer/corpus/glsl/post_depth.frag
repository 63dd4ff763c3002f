#version 450
#extension GL_ARB_post_depth_coverage : require
layout(post_depth_coverage) in;
layout(early_fragment_tests) in;
layout(location = 0) out vec4 result;

void main() { result = vec4(float(gl_SampleMaskIn[0])); }
