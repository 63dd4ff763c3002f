enable dual_source_blending;

struct Both {
    @location(0) @blend_src(0) colour: vec4<f32>,
    @location(0) @blend_src(1) factor: vec4<f32>,
}

@fragment
fn both() -> Both {
    return Both(vec4(0.25), vec4(0.5));
}
