struct Corner {
    float4 place : SV_Position;
    float2 uv : TEXCOORD0;
    nointerpolation uint which : TEXCOORD1;
    float4x3 turn : TEXCOORD2;
    float cut[2] : SV_ClipDistance;
};

Corner main(float3 place : POSITION, uint instance : SV_InstanceID) {
    Corner corner;
    corner.place = float4(place, 1);
    corner.uv = place.xy;
    corner.which = instance;
    corner.turn = (float4x3)0;
    corner.cut[0] = corner.cut[1] = 1;
    return corner;
}
