// Twin of crates/rop/src/stochastic/dither.rs: one number a pixel and surface, even over neighbours.
// uses: frame random reference_value

const TILE: u32 = 64u;
const RANK_BITS: u32 = 12u;
const OFFSET: u32 = 0x0ff5e700u;
const FINE: u32 = 0x0f19e000u;
const ROUND: u32 = 0x0c0de500u;

fn dither_value(x: u32, y: u32, key: ReferenceKey) -> u32 {
    if DITHER_WHITE {
        return hash4(key.seed, key.pixel, key.surface, FINE);
    }
    if DITHER_SEQUENCE {
        return reference_value(0u, 0u, key);
    }
    let offset = hash3(key.seed, key.surface, OFFSET);
    // 2^32 is a multiple of the tile: what wraps does not matter.
    let column = (x + offset) % TILE;
    let row = (y + (offset >> 16u)) % TILE;
    let fine = hash4(key.seed, key.pixel, key.surface, FINE) >> RANK_BITS;
    // The ranks follow the samples' places, two in a word.
    let i = row * TILE + column;
    let rank = (tables[SAMPLES + (i >> 1u)] >> ((i & 1u) * 16u)) & 0xffffu;
    return (rank << (32u - RANK_BITS)) | fine;
}

// Dither::in_round: of 2^count_log2 rounds that are stratified together.
fn dither_in_round(x: u32, y: u32, key: ReferenceKey, index: u32, count_log2: u32) -> u32 {
    if DITHER_SEQUENCE {
        return reference_value(index, count_log2, key);
    }
    let all = dither_value(x, y, key);
    if count_log2 == 0u {
        return all;
    }
    let own = hash4(key.seed, key.pixel, key.surface, ROUND + index);
    var before = 0u;
    for (var r = 0u; r < (1u << count_log2); r++) {
        let word = hash4(key.seed, key.pixel, key.surface, ROUND + r);
        before += select(0u, 1u, word < own || (word == own && r < index));
    }
    return (before << (32u - count_log2)) | (all >> count_log2);
}
