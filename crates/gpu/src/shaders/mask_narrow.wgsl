// Sets of up to 32 samples: SampleMask of crates/trace/src/trace/fragment.rs in one word.

alias Mask = u32;

const MASK_NONE: Mask = 0u;
const MASK_WORDS: u32 = 1u;

fn mask_of(low: u32, high: u32) -> Mask {
    return low;
}

fn mask_word(m: Mask, word: u32) -> u32 {
    return m;
}

fn mask_bit(s: u32) -> Mask {
    return 1u << s;
}

fn mask_contains(m: Mask, s: u32) -> bool {
    return ((m >> s) & 1u) == 1u;
}

fn mask_count(m: Mask) -> u32 {
    return countOneBits(m);
}

fn mask_is_empty(m: Mask) -> bool {
    return m == 0u;
}
