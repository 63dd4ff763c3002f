// Several entry points in one module, as programs on wgpu have them.
struct Uniforms { turn: mat4x4<f32>, tint: vec4<f32> }
struct Corner {
    @builtin(position) place: vec4<f32>,
    @location(0) colour: vec4<f32>,
    @location(1) uv: vec2<f32>,
    @location(5) @interpolate(flat, either) which: u32,
}

@group(0) @binding(0) var<uniform> uniforms: Uniforms;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var look: sampler;
@group(0) @binding(3) var<storage, read_write> counts: array<atomic<u32>>;

@vertex
fn corner(@location(0) place: vec3<f32>, @builtin(instance_index) instance: u32) -> Corner {
    return Corner(uniforms.turn * vec4(place, 1.0), uniforms.tint, place.xy, instance);
}

@vertex
fn plain(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(vertex));
}

@fragment
fn textured(corner: Corner) -> @location(0) vec4<f32> {
    return corner.colour * textureSample(picture, look, corner.uv);
}

@fragment
fn holes(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    if corner.uv.x < 0.5 || !front {
        discard;
    }
    atomicAdd(&counts[corner.which], 1u);
    return corner.colour;
}

@fragment
fn nothing() {}

@compute @workgroup_size(64)
fn clear(@builtin(global_invocation_id) id: vec3<u32>) {
    atomicStore(&counts[id.x], 0u);
    workgroupBarrier();
}
