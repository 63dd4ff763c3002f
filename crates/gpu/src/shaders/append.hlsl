// Records the fragments that a pixel shader is run for: the twin of append.wgsl, for Direct3D
// from shader model 5.0 on. To be put before a shader's own text.
//
// Bound as u0, space 0, where nothing else is said before; where dxc makes SPIR-V of it, as
// set 0, binding 0.
#ifndef SCREENDOOR_REGISTER
#define SCREENDOOR_REGISTER u0
#endif
#ifndef SCREENDOOR_SET
#define SCREENDOOR_SET 0
#endif
#ifndef SCREENDOOR_BINDING
#define SCREENDOOR_BINDING 0
#endif

// The first word is how many fragments there were, those for which there was no room too.
// Behind it stand the fragments, eleven words each (44 bytes): the pixel's column and its row
// times 65536; primitive, object, coverage; depth at the pixel's centre and its change per
// pixel to the right and downwards; red, green, blue, alpha.
#ifdef __spirv__
[[vk::binding(SCREENDOOR_BINDING, SCREENDOOR_SET)]]
#endif
RWByteAddressBuffer captured : register(SCREENDOOR_REGISTER);

// The depth plane at SV_Position: call it where all fragments of the shader pass, before any
// branch that not all take, for it compares neighbours.
float3 captured_depth(float4 position) {
    return float3(position.z, ddx(position.z), ddy(position.z));
}

// Records a fragment. `coverage` is SV_Coverage; `primitive` rises in the order of drawing,
// and no two primitives share one; `colour` is linear, not multiplied by alpha.
void append_fragment(
    float4 position,
    float3 depth,
    uint coverage,
    uint primitive,
    uint object,
    float4 colour
) {
    // The count must not wrap.
    if (captured.Load(0) >= 0xf0000000u) {
        return;
    }
    uint place;
    captured.InterlockedAdd(0, 1u, place);
    uint bytes;
    captured.GetDimensions(bytes);
    if (place < (bytes - 4u) / 44u) {
        uint2 pixel = uint2(position.xy);
        uint at = 4u + 44u * place;
        captured.Store4(at, uint4(pixel.x | pixel.y << 16u, primitive, object, coverage));
        captured.Store4(at + 16u, asuint(float4(depth, colour.r)));
        captured.Store3(at + 32u, asuint(colour.gba));
    }
}
