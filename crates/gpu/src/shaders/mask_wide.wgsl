// Sets of up to 64 samples: SampleMask of crates/trace/src/trace/fragment.rs in two words.
// uses: wide

alias Mask = Wide;

const MASK_NONE: Mask = WIDE_NONE;
const MASK_WORDS: u32 = 2u;

fn mask_of(low: u32, high: u32) -> Mask {
    return vec2<u32>(low, high);
}

fn mask_word(m: Mask, word: u32) -> u32 {
    return select(m.x, m.y, word == 1u);
}

fn mask_bit(s: u32) -> Mask {
    return wide_bit(s);
}

fn mask_contains(m: Mask, s: u32) -> bool {
    return wide_contains(m, s);
}

fn mask_count(m: Mask) -> u32 {
    return wide_count(m);
}

fn mask_is_empty(m: Mask) -> bool {
    return wide_is_empty(m);
}
