#version 450
layout(constant_id = 3) const int LIGHTS = 4;
layout(push_constant) uniform Push { vec4 tint; mat4 turn; } push;
layout(set = 0, binding = 0) uniform Lights { vec4 lights[8]; };
layout(set = 1, binding = 0) uniform sampler2D picture;
layout(set = 1, binding = 1, r32ui) uniform coherent uimage2D counts;
layout(location = 0) in vec3 normal;
layout(location = 1) in vec2 uv;
layout(location = 0) out vec4 result;

float lit(vec3 n, int i) { return max(0.0, dot(n, lights[i].xyz)); }

void main() {
    vec4 texel = textureGrad(picture, uv, dFdx(uv), dFdy(uv));
    if (texel.a == 0.0) discard;
    float light = 0.1;
    for (int i = 0; i < LIGHTS; i++) {
        if (lights[i].w == 0.0) continue;
        if (light > 4.0) break;
        light += lit(normalize(normal), i);
    }
    switch (int(push.tint.w)) {
    case 0: imageAtomicAdd(counts, ivec2(gl_FragCoord.xy), 1u); break;
    case 1: light = 1.0; // falls through
    default: light *= 0.5;
    }
    result = push.turn * (texel * push.tint * light);
}
