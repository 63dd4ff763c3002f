// Records the fragments that a fragment shader is run for: the twin of append.wgsl, for
// Vulkan, and for OpenGL from 4.5 on with glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE), which
// counts rows from the top as traces do. To be put after a shader's #version, before its own
// text.
//
// Bound as set 0, binding 0, where nothing else is said before.
#ifndef SCREENDOOR_SET
#define SCREENDOOR_SET 0
#endif
#ifndef SCREENDOOR_BINDING
#define SCREENDOOR_BINDING 0
#endif
#ifdef VULKAN
#define SCREENDOOR_PLACE set = SCREENDOOR_SET, binding = SCREENDOOR_BINDING
#else
#define SCREENDOOR_PLACE binding = SCREENDOOR_BINDING
#endif

// What one primitive leaves in one pixel. Eleven words, 44 bytes.
struct CapturedFragment {
    // The pixel's column, and its row times 65536.
    uint pixel;
    uint primitive;
    uint object;
    uint coverage;
    // The depth at the pixel's centre, and its change per pixel to the right and downwards.
    float z;
    float dzdx;
    float dzdy;
    float red;
    float green;
    float blue;
    float alpha;
};

layout(std430, SCREENDOOR_PLACE) buffer CapturedFragments {
    // How many there were: those for which there was no room are counted too.
    uint count;
    CapturedFragment list[];
} captured;

// The depth plane at gl_FragCoord: call it where all fragments of the shader pass, before any
// branch that not all take, for it compares neighbours.
vec3 captured_depth(vec4 position) {
    return vec3(position.z, dFdx(position.z), dFdy(position.z));
}

// Records a fragment. `coverage` is uint(gl_SampleMaskIn[0]); `primitive` rises in the order
// of drawing, and no two primitives share one; `colour` is linear, not multiplied by alpha.
void append_fragment(
    vec4 position,
    vec3 depth,
    uint coverage,
    uint primitive,
    uint object,
    vec4 colour
) {
    // The count must not wrap.
    if (captured.count >= 0xf0000000u) {
        return;
    }
    uint place = atomicAdd(captured.count, 1u);
    if (place < uint(captured.list.length())) {
        uvec2 pixel = uvec2(position.xy);
        captured.list[place] = CapturedFragment(
            pixel.x | pixel.y << 16u, primitive, object, coverage,
            depth.x, depth.y, depth.z,
            colour.r, colour.g, colour.b, colour.a
        );
    }
}
