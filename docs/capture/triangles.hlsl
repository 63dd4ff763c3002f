#include "append.hlsl"

struct Corner {
    float4 position : SV_Position;
    nointerpolation uint triangle_number : TEXCOORD0;
    nointerpolation float4 colour : TEXCOORD1;
};

Corner corner(float4 place : POSITION, float4 colour : COLOR, uint index : SV_VertexID) {
    Corner result;
    result.position = place;
    result.triangle_number = index / 3u;
    result.colour = colour;
    return result;
}

float4 record(Corner corner, uint coverage : SV_Coverage) : SV_Target {
    float3 depth = captured_depth(corner.position);
    append_fragment(corner.position, depth, coverage, corner.triangle_number, 0u, corner.colour);
    return corner.colour;
}
