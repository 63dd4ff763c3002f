// Threads that look at each other's values through the workgroup's memory: for devices whose
// subgroups hold less than a pixel, or that have none.
// uses: lanes

var<workgroup> depths: array<u32, GROUP>;
var<workgroup> lanes_tested: array<u32, GROUP>;
var<workgroup> longest: atomic<u32>;

// The first thread of the pixel.
var<private> first_lane: u32;

fn place_in_lanes(list: Mask) -> u32 {
    var before = 0u;
    for (var s = 0u; s < SAMPLES; s++) {
        let earlier = mask_contains(list, s) && comes_before(s, depths[first_lane + s]);
        before += select(0u, 1u, earlier);
    }
    return before;
}

@compute @workgroup_size(GROUP)
fn draw_lanes(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    lane = thread % SAMPLES;
    first_lane = thread - lane;
    let block = group.y * groups.x + group.x;
    var range = vec2<u32>(0u, 0u);
    if take_pixel(block * PIXELS + thread / SAMPLES) {
        range = rows_of_pixel();
    }
    let length = range.y - range.x;
    atomicMax(&longest, length);
    if length > 0u {
        lane_load();
    }
    workgroupBarrier();
    // All threads of the group wait for each other, whatever their pixels' lengths.
    let steps = workgroupUniformLoad(&longest);
    for (var i = 0u; i < steps; i++) {
        let row = rows[min(range.x + i, max(range.y, 1u) - 1u)];
        let f = fragment(row);
        depths[thread] = lane_depth;
        lanes_tested[thread] = select(0u, 1u, i < length && lane_test(f));
        workgroupBarrier();
        if i < length {
            var passed = MASK_NONE;
            for (var s = 0u; s < SAMPLES; s++) {
                if lanes_tested[first_lane + s] == 1u {
                    passed |= mask_bit(s);
                }
            }
            lane_draw(f, row, passed);
        }
        workgroupBarrier();
    }
    if length > 0u {
        lane_store();
    }
}
