// Twin of crates/rop/src/contract/samples.rs: the multisample buffer of one pixel, and the order of samples.
// Colours wait until the pixel's fragments have all been drawn: until then it is known
// which row won each sample.
// uses: bindings colour fragment frame state

const NO_ROW: u32 = 0xffffffffu;
const FAR: u32 = 0xffffffffu;

var<private> depth: array<u32, SAMPLES>;
var<private> winner: array<u32, SAMPLES>;
// The depths of the fragment that was tested last.
var<private> tested: array<u32, SAMPLES>;

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
        tested[s] = sample_depth(f, s, bits);
        if mask_contains(f.coverage, s) && tested[s] <= depth[s] {
            passed |= mask_bit(s);
        }
    }
    return passed;
}

// Samples::write, to all of `written`, of the fragment that was tested last; `row` is its.
fn samples_write(row: u32, written: Mask) {
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(written, s) {
            depth[s] = tested[s];
            winner[s] = row;
        }
    }
}

// Whether the places of all samples fit into two words, of four bits each.
const PLACES_FIT: bool = SAMPLES <= 16u;

// Where they fit, the places of the list's samples.
var<private> places: vec2<u32>;

fn place_bit(sample: u32) -> u32 {
    return 1u << ((4u * sample) & 31u);
}

// Gets ready for place_among. Where places fit, two samples are compared once for both.
fn places_begin(list: Mask, sorted: bool) {
    if !PLACES_FIT {
        return;
    }
    // What is not of the list lies behind it.
    var keys: array<u32, SAMPLES>;
    for (var s = 0u; s < SAMPLES; s++) {
        keys[s] = select(FAR, select(0u, depth[s], sorted), mask_contains(list, s));
    }
    places = vec2<u32>(0u);
    for (var s = 0u; s < SAMPLES; s++) {
        // Nor does it count before one that lies as far.
        let counts = select(0u, 0xffffffffu, mask_contains(list, s));
        for (var t = 0u; t < SAMPLES; t++) {
            if t > s {
                let nearer = keys[t] < keys[s];
                let behind = place_bit(t) & counts;
                if (t >> 3u) == (s >> 3u) {
                    places[s >> 3u] += select(behind, place_bit(s), nearer);
                } else {
                    places[s >> 3u] += select(0u, place_bit(s), nearer);
                    places[t >> 3u] += select(behind, 0u, nearer);
                }
            }
        }
    }
}

// The place of a sample of `list` among them: sort_by_stored_depth, or in sample order.
fn place_among(list: Mask, sample: u32, sorted: bool) -> u32 {
    if PLACES_FIT {
        return (places[sample >> 3u] >> ((4u * sample) & 31u)) & 15u;
    }
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
