// The replay's programs: clearing, drawing and ending a pass, a pixel for each thread.
// uses: bindings fragment frame state

// Rows sorted by pixel, in API order within a pixel; where each pixel's end, of all pages.
@group(0) @binding(4) var<storage, read> rows: array<u32>;
@group(0) @binding(5) var<storage, read> ends: array<vec2<u32>>;
// The tile of each 256 pixels of all pages.
@group(0) @binding(6) var<storage, read> tile_of: array<u32>;

const GROUP: u32 = 64u;

// The pixel of a thread, where each has one of its own.
fn own_pixel(group: vec3<u32>, groups: vec3<u32>, thread: u32) -> u32 {
    return (group.y * groups.x + group.x) * GROUP + thread;
}

// Takes a pixel's turn; whether there is such a pixel.
fn take_pixel(place: u32) -> bool {
    pixel = place;
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

// The rows of the pixel that are drawn now: from the one to before the other.
fn rows_of_pixel() -> vec2<u32> {
    let range = ends[params.first_pixel + pixel];
    let skipped = min(params.from_fragment, range.y - range.x);
    let first = range.x + skipped;
    return vec2<u32>(first, first + min(range.y - first, params.fragments));
}

@compute @workgroup_size(GROUP)
fn clear(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if take_pixel(own_pixel(group, groups, thread)) {
        clear_pixel();
    }
}

@compute @workgroup_size(GROUP)
fn draw(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    if !take_pixel(own_pixel(group, groups, thread)) {
        return;
    }
    let range = rows_of_pixel();
    if range.x == range.y {
        return;
    }
    load_pixel();
    for (var i = range.x; i < range.y; i++) {
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
    if take_pixel(own_pixel(group, groups, thread)) {
        end_pixel_pass();
    }
}
