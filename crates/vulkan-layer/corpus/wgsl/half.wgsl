enable f16;

@vertex
fn corner(@builtin(vertex_index) n: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(f16(n)));
}

@fragment
fn half(@location(0) colour: vec4<f16>) -> @location(0) vec4<f16> {
    return colour * 0.5h;
}
