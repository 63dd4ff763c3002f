// The replay's programs: clearing, drawing and ending a pass, a pixel for each thread.
// uses: bindings fragment state

// Rows sorted by pixel, in API order within a pixel; where each pixel's end, of all pages.
@group(0) @binding(4) var<storage, read> rows: array<u32>;
@group(0) @binding(5) var<storage, read> ends: array<vec2<u32>>;
// The tile of each 256 pixels of all pages.
@group(0) @binding(6) var<storage, read> tile_of: array<u32>;

const GROUP: u32 = 64u;

// Names the pixel of a thread; whether there is one.
fn take_pixel(group: vec3<u32>, groups: vec3<u32>, thread: u32) -> bool {
    pixel = (group.y * groups.x + group.x) * GROUP + thread;
    if pixel >= params.taken {
        return false;
    }
    let tile = tile_of[(params.first_pixel + pixel) >> 8u];
    site = vec2<u32>(
        (tile % params.tile_columns) * 16u + (pixel & 15u),
        (tile / params.tile_columns) * 16u + ((pixel >> 4u) & 15u),
    );
    return true;
}

@compute @workgroup_size(GROUP)
fn clear(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if take_pixel(group, groups, thread) {
        clear_pixel();
    }
}

@compute @workgroup_size(GROUP)
fn draw(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if !take_pixel(group, groups, thread) {
        return;
    }
    let range = ends[params.first_pixel + pixel];
    if range.y - range.x <= params.from_fragment {
        return;
    }
    let first = range.x + params.from_fragment;
    let end = first + min(range.y - first, params.fragments);
    load_pixel();
    for (var i = first; i < end; i++) {
        let row = rows[i];
        draw_fragment(fragment(row), row);
    }
    store_pixel();
}

@compute @workgroup_size(GROUP)
fn end_pass(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if take_pixel(group, groups, thread) {
        end_pixel_pass();
    }
}
