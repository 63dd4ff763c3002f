struct Masked {
    @location(0) colour: vec4<f32>,
    @builtin(sample_mask) mask: u32,
}

@fragment
fn masked(@builtin(sample_mask) mask: u32, @location(0) colour: vec4<f32>) -> Masked {
    return Masked(colour, mask & 5u);
}

@fragment
fn only_out(@location(0) colour: vec4<f32>) -> Masked {
    return Masked(colour, 3u);
}

@fragment
fn each(@builtin(sample_index) sample: u32) -> @location(0) vec4<f32> {
    return vec4(f32(sample));
}

@fragment
fn interpolated(@location(0) @interpolate(perspective, sample) colour: vec4<f32>) -> @location(0) vec4<f32> {
    return colour;
}
