// Twin of crates/rop/src/stochastic/surface.rs: tracking of surfaces.
// uses: fragment state

var<private> covered: Mask;
var<private> surface_id: u32;
var<private> numbered: u32;
// The primitive or object that drew last, and whether any has.
var<private> last: u32;
var<private> has_last: bool;

const SURFACES_BY_SOURCE: bool = SURFACES_PRIMITIVE || SURFACES_OBJECT;

fn surface_clear() {
    state_put_mask(AT_COVERED, MASK_NONE);
    state_put(AT_SURFACE, 0u);
    state_put(AT_NUMBERED, 0u);
    if SURFACES_BY_SOURCE {
        state_put(AT_LAST, 0u);
        state_put(AT_LAST + 1u, 0u);
    }
}

fn surface_load() {
    covered = state_mask(AT_COVERED);
    surface_id = state_word(AT_SURFACE);
    numbered = state_word(AT_NUMBERED);
    if SURFACES_BY_SOURCE {
        last = state_word(AT_LAST);
        has_last = state_word(AT_LAST + 1u) == 1u;
    }
}

fn surface_store() {
    state_put_mask(AT_COVERED, covered);
    state_put(AT_SURFACE, surface_id);
    state_put(AT_NUMBERED, numbered);
    if SURFACES_BY_SOURCE {
        state_put(AT_LAST, last);
        state_put(AT_LAST + 1u, select(0u, 1u, has_last));
    }
}

// SurfaceTracker::enter; whether the surface is new. Its first sample's number in this
// fragment is `numbered`.
fn surface_enter(s: Mask, f: Fragment) -> bool {
    var starts = !mask_is_empty(s & covered);
    if SURFACES_EVERY_FRAGMENT {
        starts = true;
    }
    if SURFACES_BY_SOURCE {
        let source = select(f.object, f.primitive, SURFACES_PRIMITIVE);
        starts = starts || (has_last && last != source);
        last = source;
        has_last = true;
    }
    if starts {
        surface_id += 1u;
        covered = MASK_NONE;
        numbered = 0u;
    }
    return starts;
}

// SurfaceTracker::hold.
fn surface_hold(s: Mask, count: u32) {
    covered |= s;
    numbered += count;
}
