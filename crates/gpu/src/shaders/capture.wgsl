// uses: append

// Draws a scene's triangles, three corners each, in clip space.

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) keep_back: u32,
    @location(2) @interpolate(flat) rows: vec2<u32>,
}

@vertex
fn corner(
    @builtin(vertex_index) index: u32,
    @location(0) position: vec4<f32>,
    @location(1) keep_back: u32,
    // The first row that is recorded, and the first after those.
    @location(2) rows: vec2<u32>,
) -> Corner {
    return Corner(position, index / 3u, keep_back, rows);
}

@fragment
fn record(
    in: Corner,
    @builtin(sample_mask) coverage: u32,
    @builtin(front_facing) front: bool,
) {
    let depth = captured_depth(in.position);
    let row = u32(in.position.y);
    let wanted = row >= in.rows.x && row < in.rows.y;
    if wanted && (front || in.keep_back != 0u) {
        // What the fragment looks like is the scene's own shading to say.
        append_fragment(in.position, depth, coverage, in.triangle, 0u, vec4<f32>());
    }
}
