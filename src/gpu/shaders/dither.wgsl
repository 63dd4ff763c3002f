// Twin of src/rop/dither.rs: one number a pixel and surface, even over neighbours.
// uses: bindings random reference_value

const TILE: u32 = 64u;
const RANK_BITS: u32 = 12u;
const OFFSET: u32 = 0x0ff5e700u;
const FINE: u32 = 0x0f19e000u;

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
