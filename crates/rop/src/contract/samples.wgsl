// Twin of crates/rop/src/contract/samples.rs: the multisample buffer of one pixel, and the order of samples.
// Colours wait until the pixel's fragments have all been drawn: until then it is known
// which row won each sample.
// uses: bindings colour fragment frame state

const NO_ROW: u32 = 0xffffffffu;
const FAR: u32 = 0xffffffffu;

var<private> depth: array<u32, SAMPLES>;
var<private> winner: array<u32, SAMPLES>;

fn samples_clear() {
    for (var s = 0u; s < SAMPLES; s++) {
        state_put(AT_DEPTH + s, FAR);
        state_put_colour(AT_COLOUR + 3u * s, params.background);
    }
}

fn samples_load() {
    for (var s = 0u; s < SAMPLES; s++) {
        depth[s] = state_word(AT_DEPTH + s);
        winner[s] = NO_ROW;
    }
}

fn samples_store() {
    for (var s = 0u; s < SAMPLES; s++) {
        if winner[s] != NO_ROW {
            state_put(AT_DEPTH + s, depth[s]);
            state_put_colour(AT_COLOUR + 3u * s, stored3(colour(winner[s])));
        }
    }
}

// Samples::depth_test, with the fragment's depths.
fn depth_test(f: Fragment, bits: u32) -> Mask {
    var passed = MASK_NONE;
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(f.coverage, s) && sample_depth(f, s, bits) <= depth[s] {
            passed |= mask_bit(s);
        }
    }
    return passed;
}

// Samples::write, to all of `written`; `row` is the fragment's.
fn samples_write(f: Fragment, row: u32, written: Mask, bits: u32) {
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(written, s) {
            depth[s] = sample_depth(f, s, bits);
            winner[s] = row;
        }
    }
}

// The place of a sample among those of `list`: sort_by_stored_depth, or in sample order.
fn place_among(list: Mask, sample: u32, sorted: bool) -> u32 {
    var before = 0u;
    for (var s = 0u; s < SAMPLES; s++) {
        var nearer = s < sample;
        if sorted {
            nearer = depth[s] < depth[sample] || (depth[s] == depth[sample] && nearer);
        }
        before += select(0u, 1u, mask_contains(list, s) && nearer);
    }
    return before;
}
