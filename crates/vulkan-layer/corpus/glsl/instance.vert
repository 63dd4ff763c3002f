#version 450
layout(location = 0) flat out int number;
out float gl_ClipDistance[3];

void main() {
    number = gl_InstanceIndex;
    gl_ClipDistance[1] = 1.0;
    gl_PointSize = 1.0;
    gl_Position = vec4(float(gl_VertexIndex));
}
