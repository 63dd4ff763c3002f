// uses: append

// Draws a scene's triangles, three corners each, in clip space.

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) keep_back: u32,
}

@vertex
fn corner(
    @builtin(vertex_index) index: u32,
    @location(0) position: vec4<f32>,
    @location(1) keep_back: u32,
) -> Corner {
    return Corner(position, index / 3u, keep_back);
}

@fragment
fn record(
    in: Corner,
    @builtin(sample_mask) coverage: u32,
    @builtin(front_facing) front: bool,
) {
    let depth = captured_depth(in.position);
    if front || in.keep_back != 0u {
        // What the fragment looks like is the scene's own shading to say.
        append_fragment(in.position, depth, coverage, in.triangle, 0u, vec4<f32>());
    }
}
