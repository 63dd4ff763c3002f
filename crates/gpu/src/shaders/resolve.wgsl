// From a pixel's samples to its colour, where the design's own sum is the plain text's.
// uses: replay

@group(0) @binding(7) var<storage, read_write> picture: array<f32>;

@compute @workgroup_size(GROUP)
fn resolve(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if take_pixel(own_pixel(group, groups, thread)) {
        let colour = resolve_pixel();
        picture[3u * pixel] = colour.x;
        picture[3u * pixel + 1u] = colour.y;
        picture[3u * pixel + 2u] = colour.z;
    }
}
