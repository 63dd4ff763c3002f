// Twin of crates/rop/src/stochastic/tracked.rs: figure 7 of Laine and Karras (2011) with any reference values.
// `references_clear`, `references_load`, `references_store`, `references_start`,
// `references_begin`, `reference_of`, `hits_begin` and `hit` are the design's.
// uses: opacity pixel_order reference_value round samples surface

var<private> pixel_id: u32;

// Without compaction all covered samples are tracked and numbered either way.
const TRACKS_COVERED: bool = TRACK_COVERED && COMPACT;

fn sampler_clear() {
    surface_clear();
    references_clear();
}

fn sampler_load() {
    pixel_id = pixel_index(site.x, site.y);
    surface_load();
    references_load();
}

fn sampler_store() {
    surface_store();
    references_store();
}

// The samples of a fragment that are numbered, and of these or all those that are tracked.
fn numbered_of(f: Fragment, passed: Mask) -> Mask {
    if COMPACT {
        return passed;
    }
    return f.coverage;
}

fn tracked_of(f: Fragment, s: Mask) -> Mask {
    if TRACKS_COVERED {
        return f.coverage;
    }
    return s;
}

fn key_of(round: Round) -> ReferenceKey {
    let key = ReferenceKey(pixel_id, surface_id, round.seed);
    if PREHASH {
        return prehashed(key);
    }
    return key;
}

// From line 4 of the figure to the opacity test; numbers are the figure's lines.
fn choose(round: Round, passed: Mask, f: Fragment) -> Mask {
    let opacity = threshold_of(f.alpha);
    let s = numbered_of(f, passed);
    let tracked = tracked_of(f, s);
    if mask_is_empty(tracked) {
        return MASK_NONE;
    }

    // 4-8.
    if surface_enter(tracked, f) {
        references_start();
    }

    // 9-17: a sample's number is its place in the order, after those that came before.
    let count = mask_count(s);
    let key = key_of(round);
    references_begin(round, key, opacity, numbered, count);
    hits_begin(round, key, opacity);
    places_begin(s, SORT);
    var written = MASK_NONE;
    for (var sample = 0u; sample < SAMPLES; sample++) {
        if mask_contains(s & passed, sample) {
            let place = place_among(s, sample, SORT);
            if hit(round, key, opacity, numbered, place) {
                written |= mask_bit(sample);
            }
        }
    }

    // 18.
    surface_hold(tracked, count);
    return written;
}
