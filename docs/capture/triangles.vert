#version 450
// A corner of a triangle: its place in clip space and its colour.
layout(location = 0) in vec4 place;
layout(location = 1) in vec4 colour;
layout(location = 0) flat out uint triangle;
layout(location = 1) flat out vec4 colour_of_triangle;

void main() {
    gl_Position = place;
    triangle = uint(gl_VertexIndex) / 3u;
    colour_of_triangle = colour;
}
