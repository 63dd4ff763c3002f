// Sets of up to 64 members, as SampleMask of crates/trace/src/trace/fragment.rs: two words, the lower first.

alias Wide = vec2<u32>;

const WIDE_NONE: Wide = vec2<u32>(0u, 0u);

fn wide_bit(s: u32) -> Wide {
    return vec2<u32>(select(0u, 1u << (s & 31u), s < 32u), select(0u, 1u << (s & 31u), s >= 32u));
}

// The first n members, n up to 64.
fn wide_first(n: u32) -> Wide {
    return vec2<u32>(first_bits(min(n, 32u)), first_bits(max(n, 32u) - 32u));
}

fn first_bits(n: u32) -> u32 {
    return select((1u << (n & 31u)) - 1u, 0xffffffffu, n >= 32u);
}

fn wide_contains(m: Wide, s: u32) -> bool {
    return ((select(m.x, m.y, s >= 32u) >> (s & 31u)) & 1u) == 1u;
}

fn wide_count(m: Wide) -> u32 {
    return countOneBits(m.x) + countOneBits(m.y);
}

fn wide_is_empty(m: Wide) -> bool {
    return (m.x | m.y) == 0u;
}
