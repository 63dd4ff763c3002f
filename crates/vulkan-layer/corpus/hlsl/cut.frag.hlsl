Texture2D picture : register(t0);
SamplerState look : register(s1);

struct Corner {
    float4 place : SV_Position;
    float2 uv : TEXCOORD0;
    nointerpolation uint which : TEXCOORD1;
};

struct Result {
    float4 colour : SV_Target0;
    float4 other : SV_Target1;
    float depth : SV_Depth;
    uint mask : SV_Coverage;
};

Result main(Corner corner, bool front : SV_IsFrontFace, uint primitive : SV_PrimitiveID) {
    Result result;
    result.colour = picture.Sample(look, corner.uv);
    clip(result.colour.a - 0.5);
    result.other = front ? float4(primitive, corner.which, 0, 1) : float4(0, 0, 0, 0);
    result.depth = corner.place.z * 0.5;
    result.mask = 5;
    return result;
}
