// Figure 7 of crates/rop/src/stochastic/tracked.rs with a thread for each sample: those of a pixel do the same
// but for what is their own sample's. `place_in_lanes` is the file's that uses this one:
// threads look at each other's depths there.
// uses: colour replay tracked

const PIXELS: u32 = GROUP / SAMPLES;

// The thread's sample.
var<private> lane: u32;
var<private> lane_depth: u32;
var<private> lane_winner: u32;

fn lane_load() {
    lane_depth = state_word(AT_DEPTH + lane);
    lane_winner = NO_ROW;
    sampler_load();
}

fn lane_store() {
    if lane_winner != NO_ROW {
        state_put(AT_DEPTH + lane, lane_depth);
        state_put_colour(AT_COLOUR + 3u * lane, stored3(colour(lane_winner)));
    }
    if lane == 0u {
        sampler_store();
    }
}

// Whether the sample is covered and not behind.
fn lane_test(f: Fragment) -> bool {
    return mask_contains(f.coverage, lane) && sample_depth(f, lane, DEPTH_BUFFER_BITS) <= lane_depth;
}

// From line 4 on; `passed` are the samples of the pixel that pass the depth test.
fn lane_draw(f: Fragment, row: u32, passed: Mask) {
    let s = numbered_of(f, passed);
    let tracked = tracked_of(f, s);
    if mask_is_empty(tracked) {
        return;
    }
    let place = place_in_lanes(s);
    if surface_enter(tracked, f) {
        references_start();
    }
    let round = round_of(0u);
    let opacity = threshold_of(f.alpha);
    let count = mask_count(s);
    let key = key_of(round);
    references_begin(round, key, opacity, numbered, count);
    if mask_contains(s & passed, lane) {
        if passes(opacity, reference_of(round, key, opacity, numbered, place)) {
            lane_depth = sample_depth(f, lane, DEPTH_BUFFER_BITS);
            lane_winner = row;
        }
    }
    surface_hold(tracked, count);
}

// Whether another sample of this depth comes before the thread's own.
fn comes_before(sample: u32, its_depth: u32) -> bool {
    let earlier = sample < lane;
    if SORT {
        return its_depth < lane_depth || (its_depth == lane_depth && earlier);
    }
    return earlier;
}
