#version 450
layout(location = 0) flat out double one;
layout(location = 1) flat out dvec2 two;
layout(location = 2) flat out dvec3 three;
layout(location = 4) flat out dvec4 four[2];
layout(location = 8) flat out dmat2x3 matrix;

void main() {
    one = 1.0LF;
    two = dvec2(2.0LF);
    three = dvec3(3.0LF);
    four[1] = dvec4(4.0LF);
    matrix = dmat2x3(1.0LF);
    gl_Position = vec4(0.0);
}
