// Twin of crates/rop/src/contract/over_opaque.rs: opaque geometry first, transparent geometry over it.
// `inner_clear`, `inner_load`, `inner_store`, `inner_draw` and `inner_end_pass` are the design's.
// uses: colour fragment frame state

var<private> opaque_depth: array<u32, SAMPLES>;
var<private> opaque_winner: array<u32, SAMPLES>;
var<private> has_opaque: bool;

const NO_OPAQUE_ROW: u32 = 0xffffffffu;

fn clear_pixel() {
    if OPAQUE_FIRST_HERE {
        state_put(AT_HAS_OPAQUE, 0u);
        for (var s = 0u; s < SAMPLES; s++) {
            state_put(AT_OPAQUE_DEPTH + s, 0xffffffffu);
            state_put_colour(AT_OPAQUE_COLOUR + 3u * s, params.background);
        }
    }
    inner_clear();
}

fn load_pixel() {
    if OPAQUE_FIRST_HERE {
        has_opaque = state_word(AT_HAS_OPAQUE) == 1u;
        for (var s = 0u; s < SAMPLES; s++) {
            opaque_depth[s] = state_word(AT_OPAQUE_DEPTH + s);
            opaque_winner[s] = NO_OPAQUE_ROW;
        }
        if params.pass_number == 0u {
            return;
        }
    }
    inner_load();
}

fn store_pixel() {
    if OPAQUE_FIRST_HERE && params.pass_number == 0u {
        state_put(AT_HAS_OPAQUE, select(0u, 1u, has_opaque));
        for (var s = 0u; s < SAMPLES; s++) {
            if opaque_winner[s] != NO_OPAQUE_ROW {
                state_put(AT_OPAQUE_DEPTH + s, opaque_depth[s]);
                state_put_colour(AT_OPAQUE_COLOUR + 3u * s, stored3(colour(opaque_winner[s])));
            }
        }
        return;
    }
    inner_store();
}

fn draw_fragment(drawn: Fragment, row: u32) {
    var f = drawn;
    var number = params.pass_number;
    if OPAQUE_FIRST_HERE {
        let is_opaque = f.alpha >= 1.0;
        if is_opaque != (number == 0u) {
            return;
        }
        f.coverage = before_opaque(f);
        if mask_is_empty(f.coverage) {
            return;
        }
        if is_opaque {
            opaque_write(f, row);
            return;
        }
        number -= 1u;
    }
    inner_draw(number, f, row);
}

// The samples of a fragment that lie not behind opaque ones.
fn before_opaque(f: Fragment) -> Mask {
    if !has_opaque {
        return f.coverage;
    }
    var passed = MASK_NONE;
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(f.coverage, s) && sample_depth(f, s, 32u) <= opaque_depth[s] {
            passed |= mask_bit(s);
        }
    }
    return passed;
}

fn opaque_write(f: Fragment, row: u32) {
    has_opaque = true;
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(f.coverage, s) {
            opaque_depth[s] = sample_depth(f, s, 32u);
            opaque_winner[s] = row;
        }
    }
}

fn end_pixel_pass() {
    if !OPAQUE_FIRST_HERE {
        inner_end_pass(params.pass_number);
    } else if params.pass_number > 0u {
        inner_end_pass(params.pass_number - 1u);
    }
}
