#version 450
// Draws with what the subpass before has drawn here.
layout(input_attachment_index = 0, set = 0, binding = 0) uniform subpassInput before;
layout(location = 0) in vec4 colour;
layout(location = 1) flat in uint instance;
layout(location = 0) out vec4 target;

void main() {
    target = vec4(0.5 * colour.rgb + 0.5 * subpassLoad(before).brg, colour.a);
}
