// The longest of the pixels' lists.

struct Params {
    pixels: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> ends: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> longest: array<atomic<u32>>;

@compute @workgroup_size(256)
fn find(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let pixel = (group.y * groups.x + group.x) * 256u + thread;
    if pixel < params.pixels {
        let length = ends[pixel].y - ends[pixel].x;
        // Most are shorter than the longest so far.
        if length > atomicLoad(&longest[0]) {
            atomicMax(&longest[0], length);
        }
    }
}
