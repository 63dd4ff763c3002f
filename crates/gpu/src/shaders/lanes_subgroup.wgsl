// Threads that look at each other's values within a subgroup, which holds whole pixels.
// uses: lanes

// The first thread of the pixel within the subgroup.
var<private> first_lane: u32;

fn place_in_lanes(list: Mask) -> u32 {
    var before = 0u;
    for (var s = 0u; s < SAMPLES; s++) {
        let its_depth = subgroupShuffle(lane_depth, first_lane + s);
        before += select(0u, 1u, mask_contains(list, s) && comes_before(s, its_depth));
    }
    return before;
}

// The threads of the pixel that say yes.
fn mask_of_lanes(yes: bool) -> Mask {
    let all = subgroupBallot(yes);
    let word = first_lane >> 5u;
    let shift = first_lane & 31u;
    let low = select(select(all.x, all.y, word == 1u), select(all.z, all.w, word == 3u), word > 1u);
    let high = select(all.y, all.w, word > 1u);
    // A pixel of 64 samples takes two words, all others a part of one.
    return mask_of(low >> shift, high) & mask_of(params.samples_low, params.samples_high);
}

@compute @workgroup_size(GROUP)
fn draw_lanes(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_size) size: u32,
    @builtin(subgroup_invocation_id) thread: u32,
) {
    lane = thread % SAMPLES;
    first_lane = thread - lane;
    let block = group.y * groups.x + group.x;
    if !take_pixel(block * PIXELS + (subgroup * size + thread) / SAMPLES) {
        return;
    }
    let range = rows_of_pixel();
    if range.x == range.y {
        return;
    }
    lane_load();
    for (var i = range.x; i < range.y; i++) {
        let row = rows[i];
        let f = fragment(row);
        lane_draw(f, row, mask_of_lanes(lane_test(f)));
    }
    lane_store();
}
