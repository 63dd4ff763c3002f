enable primitive_index;

struct Targets {
    @location(0) first: vec4<f32>,
    @location(1) second: vec2<f32>,
    @location(2) third: u32,
}

@fragment
fn targets(@builtin(primitive_index) primitive: u32) -> Targets {
    return Targets(vec4(1.0), vec2(0.5), primitive);
}

struct Deep {
    @location(0) colour: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn depth(@builtin(position) place: vec4<f32>) -> Deep {
    return Deep(vec4(place.z), place.z * 0.5);
}
